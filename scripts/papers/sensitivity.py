"""Sensitivity of a manoeuvre to each coefficient of a model (Cao 2015)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from shipgym.models import ShipModel
from shipgym.trials.trial import Trial

CHANGE = 0.01  # relative step to either side
CHANNELS = ("u", "v", "r", "psi")


def sensitivity(
    model: ShipModel, manoeuvre: Callable[[ShipModel], Trial]
) -> dict[str, float]:
    """Change of a simulated manoeuvre per per cent of each coefficient, per cent.

    Root mean square change of u, v, r and psi, each by its span.
    """
    run = manoeuvre(model)
    spans = {name: np.ptp(run[name]) for name in CHANNELS}
    effects = {}
    for name, value in model.coefficients.items():
        more, less = (
            manoeuvre(
                replace(
                    model, coefficients={**model.coefficients, name: value * factor}
                )
            )
            for factor in (1.0 + CHANGE, 1.0 - CHANGE)
        )
        common = slice(min(len(more), len(less)))
        squares = [
            np.mean((more[one][common] - less[one][common]) ** 2) / span**2
            for one, span in spans.items()
        ]
        effects[name] = float(np.sqrt(np.mean(squares))) / (2.0 * CHANGE)
    return effects
