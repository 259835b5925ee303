"""Facts that a report's verdict begins with: ship, data, prediction, and what to know before use."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from identification.validation.warnings import concerns
from shipgym.pages import NONE, Html, card, html, join, number, paragraph, section

if TYPE_CHECKING:
    from identification.result import IdentificationResult


def ship_card(result: IdentificationResult) -> Html:
    """Size and speed."""
    ship = result.model.particulars
    mass = "" if ship.mass is None else f", mass {number(ship['mass'] / 1000.0, 3)}&nbsp;t"
    return card(
        "Ship",
        f"L = {ship['length']:.4g} m",
        Html(f"service speed {number(ship['speed'], 3)} m/s{mass}"),
    )


def data_card(result: IdentificationResult) -> Html:
    """How many trials."""
    uses = [trial.use for trial in result.trials]
    samples = sum(len(trial) for trial in result.trials)
    minutes = sum(trial.duration for trial in result.trials) / 60.0
    return card(
        "Data",
        f"{uses.count('fit')} trials to fit",
        Html(f"{uses.count('validate')} to validate; {samples} samples, {number(minutes, 2)} min"),
    )


def quality_card(result: IdentificationResult) -> Html:
    """Heading error on the trials that were not fitted, else on those that were."""
    trials = result.metrics["trials"]
    unseen = {name: metrics for name, metrics in trials.items() if metrics["use"] == "validate"}
    errors = {
        name: float(np.degrees(metrics["rmse"]["psi"]))
        for name, metrics in (unseen or trials).items()
        if metrics["rmse"]["psi"] is not None
    }
    if not errors:
        return card("Prediction", NONE, "no heading was measured")
    worst = max(errors, key=lambda name: errors[name])
    which = "trials not fitted" if unseen else "fitted trials, none to validate"
    return card(
        "Prediction",
        f"{np.median(list(errors.values())):.1f}°",
        f"heading rmse, median of {which}; largest {errors[worst]:.1f}° ({PurePath(worst).name})",
    )


def concerns_list(result: IdentificationResult) -> Html:
    """What has to be known before the model is used."""
    items = join(Html(f"<li>{html(text[0].upper() + text[1:])}.</li>") for text in concerns(result))
    return Html(f'<ul class="concerns">{items}</ul>' if items else "")


def remedy_section() -> Html:
    """What to do about an unstable model."""
    return section(
        "remedy",
        "What to do",
        paragraph(
            "An unstable fit usually means that the trials do not hold enough: manoeuvres with other "
            "rudder angles and to the other side, a turning circle, more samples. Or that the data is not "
            "what the ship file says: check the signs of the rudder and of sway and yaw, the units, and "
            "whether the velocities are those of midship."
        ),
        paragraph(
            "A simpler structure, or the default method with its guard against models that run away, may "
            "hold as well."
        ),
    )
