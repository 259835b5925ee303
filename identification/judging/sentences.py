"""What holds a hard turn, the bias of the rudder, current and wind, in words."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

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
            f" {posterior['power']:.2g}, {posterior['effective_samples']:.0f} effective"
            " samples)"
        )
    source = "the residuals of the fit, correlated in time and between the equations"
    error = provenance.get("model_error")
    if error:
        source += f", times {error['factor']:.2g} for model error ({error['how']})"
    return source


def turn_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """What holds a hard turn of a model, by its provenance, and within how much."""
    error = provenance.get("model_error", {}).get("hard_turn")
    if not error:
        return []
    return [
        "No trial turns through half a circle: the angle of a hard turn is taken to be"
        f" known to {100.0 * error['size']:.0f} % (standard error; {error['how']}). A"
        " turn at full rudder would show it."
    ]


def bias_sentences(bias: dict[str, Any] | None) -> list[str]:
    """The bias in words; none where there is none."""
    if bias is None:
        return []
    side = "starboard" if bias["angle_deg"] > 0.0 else "port"
    verdict = "which does not differ from zero"
    if bias["significant"]:
        verdict = "the model has it" if bias["in_model"] else "by norrbin-bias"
    return [
        f"Rudder bias: the ship runs straight with {abs(bias['angle_deg']):.2g} ±"
        f" {1.96 * bias['standard_error_deg']:.2g} deg (95 %) to {side}; {verdict}."
    ]


def sea_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """Current and wind of the trials, by the provenance of a model, in words.

    Trials of the same current stand together.
    """
    trials_of = defaultdict[str, list[str]](list)
    for trial, row in provenance.get("currents", {}).items():
        trials_of[current_text(row)].append(PurePath(trial).name)
    sentences = [f"{', '.join(names)}: {text}" for text, names in trials_of.items()]
    if "wind" in provenance:
        speeds = provenance["wind"]["mean_speeds"].values()
        sentences.append(
            f"wind of {min(speeds):.2g} to {max(speeds):.2g} m/s on average: its forces"
            " are removed"
        )
    return sentences


def current_text(row: Mapping[str, Any]) -> str:
    """One current in words, its source and errors, and whether it was removed."""
    text = f"current of {set_and_drift(row['north'], row['east'])} ({row['source']}"
    if "standard_errors" in row:
        north, east = row["standard_errors"]
        text += f"; standard errors {north:.3f} north, {east:.3f} m/s east"
    return f"{text}); {'removed' if row['taken_out'] else 'left in'}"
