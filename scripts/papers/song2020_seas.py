"""Hual Trooper identified in sea state 2 to 3, and the innovation of chapter 4.

Song trains with random disturbances and in seas of about state 3, whose records are not
published. In their place her Nomoto equations sail a zigzag in a current, wind and
waves between states 2 and 3, and instruments log it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from identification.estimators.recursive import MultiInnovationLeastSquares
from identification.pipeline import identify
from papers.row import Row
from papers.song2020_nomoto import (
    ANGLE,
    DURATION,
    OMEGA,
    PARTICULARS,
    SEED,
    TRUTH,
    errors,
    indices,
    logged,
    regression,
    ship,
    trial,
)
from shipgym.manoeuvres import zigzag
from shipgym.sea import Current, Waves, Weather, Wind
from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]

SEA = Weather(
    Current(0.3, 90.0),
    Wind(5.3, 45.0),
    Waves(0.5, 6.5, 45.0),
    name="sea state 2 to 3",
)


@cache
def trial_in_seas(structure: str) -> Trial:
    """A zigzag in the seas, as instruments log it, the wind among them."""
    angle = ANGLE[structure]
    run = zigzag(
        ship(structure),
        angle,
        angle,
        duration=DURATION,
        dt=0.1,
        weather=SEA,
        seed=SEED,
    )
    wind = {"wind_speed": 5.3, "wind_from": np.radians(45.0)}
    return logged(run, f"zigzag {angle}/{angle}", wind)


def by_differences(structure: str) -> dict[str, float]:
    """Coefficients by the paper's multi-innovation least squares on differences."""
    estimator = MultiInnovationLeastSquares(omega=OMEGA)
    estimator.fit(*regression(structure, trial_in_seas(structure)))
    return dict(zip(TRUTH[structure], estimator.coef_.tolist(), strict=True))


@cache
def identified(structure: str, knows_seas: bool) -> Mapping[str, float]:
    """Coefficients by simulation, with current and wind removed or left in."""
    removed = "auto" if knows_seas else "none"
    found = identify(
        [trial_in_seas(structure)],
        structure,
        "output-error",
        particulars=PARTICULARS,
        current=removed,
        wind=removed,
        rudder_bias="none",
    )
    return found.coefficients


def sea_rows() -> Iterator[Row]:
    """Identification in the seas, without and with what is known about them."""
    for structure, truth in TRUTH.items():
        expected = indices(truth)
        ours = errors(indices(by_differences(structure)), expected)
        without, known = (
            errors(indices(identified(structure, knows_seas)), expected)
            for knows_seas in (False, True)
        )
        for name in expected:
            yield Row(
                "Sea state 2 to 3",
                f"{name}: error, %; at best: current and wind removed",
                None,
                ours[name],
                known[name],
                "below that without",
                known[name] < without[name],
                "the paper's records are not published; 0.3 m/s of current, 5.3 m/s of"
                " wind, 0.5 m of waves, the noise of instruments",
            )
            yield Row(
                "Sea state 2 to 3",
                f"{name}: error, %; at best: seas left in the record",
                None,
                None,
                without[name],
            )


def multi_innovation(structure: str, is_odd: bool) -> dict[str, float]:
    """Equation 4-12, one innovation a step, as printed (even in e) or odd."""
    X, y = regression(structure, trial(structure))
    size = np.sqrt(np.mean(X**2, axis=0))
    theta = np.zeros(X.shape[1])
    P = 1e6 * np.eye(X.shape[1])
    for phi, target in zip(X / size, y.tolist(), strict=True):
        error = target - float(phi @ theta)
        bend = np.tanh(OMEGA * error)
        gain = P @ phi / (1.0 + phi @ P @ phi)
        theta = theta + gain * (bend / OMEGA if is_odd else error * bend)
        P = P - np.outer(gain, phi @ P)
    return dict(zip(TRUTH[structure], (theta / size).tolist(), strict=True))


def parity_rows() -> Iterator[Row]:
    """Equations 4-9 to 4-12 as printed, and as they have to be."""
    truth = indices(TRUTH["nomoto"])
    forms = {
        "e tanh(omega e), as printed, even in e": False,
        "tanh(omega e) / omega, odd in e": True,
    }
    for form, is_odd in forms.items():
        found = indices(multi_innovation("nomoto", is_odd))
        for name, value in truth.items():
            yield Row(
                "Equations 4-9 to 4-12",
                f"{name} by {form}: error, %",
                None,
                100.0 * (found[name] / value - 1.0),
                None,
                note=(
                    "the odd form is ours, not the paper's"
                    if is_odd
                    else "an error of either sign pushes the same way"
                ),
            )
