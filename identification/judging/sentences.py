"""What holds a hard turn, the bias of the rudder, current and wind, in words."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from identification.samples.velocities import SIGNIFICANT
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.trials.navigation import set_and_drift


def findings(provenance: Mapping[str, Any]) -> list[str]:
    """What was found of hard turn, rudder bias, current and wind, in sentences."""
    return [
        *turn_sentences(provenance),
        *bias_sentences(provenance.get("rudder_bias")),
        *sea_sentences(provenance),
    ]


def error_source(provenance: Mapping[str, Any]) -> str:
    """Where the standard errors come from."""
    posterior = provenance.get("posterior")
    if posterior and posterior["kept"]:
        return (
            "a posterior by sampling (likelihood to the power"
            f" {posterior['power']:.2g}, {posterior['walkers']} walkers,"
            f" {posterior['steps']} steps, acceptance {posterior['acceptance']:.2f},"
            f" autocorrelation time {posterior['autocorrelation_time']:.0f} steps,"
            f" split R-hat {posterior['r_hat']:.3f},"
            f" {posterior['effective_samples']:.0f} effective samples)"
        )
    source = "the residuals of the fit, correlated in time and between the equations"
    error = provenance.get("model_error")
    if error:
        source += f", times {error['factor']:.2g} for model error ({error['how']})"
    return source


def turn_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """What holds a hard turn of a model, by its provenance, and within how much."""
    sentences = []
    error = provenance.get("model_error", {}).get("hard_turn")
    if error:
        percent = 100.0 * error["size"]
        sentences.append(
            "No trial turns through half a circle: the angle of a hard turn is taken"
            f" to be known to {percent:.0f} % (standard error; {error['how']}). A turn"
            " at full rudder would show it."
        )
    return sentences


def bias_sentences(bias: dict[str, Any] | None) -> list[str]:
    """The bias in words; none where there is none."""
    if bias is None:
        return []
    angle, error = bias["angle_deg"], bias["standard_error_deg"]
    side = "starboard" if angle > 0.0 else "port"
    margin = 1.96 * error
    found = (
        f"Rudder bias: the ship runs straight with {abs(angle):.2g} ± {margin:.2g} deg"
        f" (95 %) to {side}"
    )
    if not bias["significant"]:
        return [f"{found}, which does not differ from zero."]
    if bias["in_model"]:
        return [f"{found}; the model has it."]
    structure = bias["structure"]
    return [
        f"{found}, by {structure}; the structure has no constant for it: it belongs to"
        f" the rudder's zero, or take structure {structure!r}."
    ]


def sea_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """Current and wind of the trials, by the provenance of a model, in words."""
    sentences = list[str]()
    if "currents" in provenance:
        sentences += _current_sentences(provenance["currents"])
    if "wind" in provenance:
        wind = provenance["wind"]
        speeds = wind["mean_speeds"].values()
        low = min(speeds)
        high = max(speeds)
        sentences.append(
            f"wind of {low:.2g} to {high:.2g} m/s on average: its forces are removed"
        )
    return sentences


def _current_sentences(currents: Mapping[str, Any]) -> list[str]:
    """Trials of the same current together."""
    trials_of = defaultdict[str, list[str]](list)
    for trial, row in currents.items():
        text = current_text(row)
        name = PurePath(trial).name
        trials_of[text].append(name)

    sentences = []
    for text, names in trials_of.items():
        trials = ", ".join(names)
        sentences.append(f"{trials}: {text}")
    return sentences


def current_text(row: Mapping[str, Any]) -> str:
    """One current in words: set and drift, interval, and whether there is one."""
    sources = {
        "all trials": "one for all",
        "trial": "its own",
        "given": "as given",
        "columns": "from columns",
    }
    found = set_and_drift(row["north"], row["east"])
    source = row["source"]
    parts = [f"current of {found}", sources[source]]
    if "standard_errors" in row:
        parts += _current_interval(row)
    elif source in ("trial", "all trials"):
        parts.append("a guess without an interval, as the trials keep to one heading")

    text = ", ".join(parts)
    end = "removed" if row["taken_out"] else "left in"
    return f"{text}; {end}"


def _current_interval(row: Mapping[str, Any]) -> list[str]:
    """95 % interval of a current, and whether it differs from zero."""
    north, east = row["north"], row["east"]
    north_error, east_error = row["standard_errors"]
    north_margin = NORMAL_95 * north_error
    east_margin = NORMAL_95 * east_error
    differs = row["probability"] < SIGNIFICANT
    verb = "differs" if differs else "does not differ"
    return [
        f"north {north:.3f} ± {north_margin:.3f}",
        f"east {east:.3f} ± {east_margin:.3f} m/s (95 %)",
        f"which {verb} from zero",
    ]
