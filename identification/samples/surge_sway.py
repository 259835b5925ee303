"""Surge and sway of any ship by quadratic equations, to see a current behind them.

All quantities are in units of the ship's length and service speed.
"""

from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats

#: Mean and standard deviation of the coefficients before any trial, in the order of the
#: terms of `accelerations`: those of surge, those of sway, and that of the wind.
PRIOR = (
    (0.0, 0.02),
    (-0.10, 0.2),
    (-0.05, 0.2),
    (0.9, 0.6),
    (-0.5, 1.5),
    (0.0, 0.3),
    (-0.03, 0.15),
    (-0.03, 0.15),
    (0.0, 0.02),
    (-0.9, 0.6),
    (-3.0, 4.0),
    (-0.35, 0.25),
    (0.0, 0.5),
    (-0.5, 1.5),
    (0.0, 1.5),
    (-0.06, 0.1),
    (-0.04, 0.1),
    (1.0, 0.25),
)
MEAN, DEVIATION = np.array(PRIOR).T
N_COEFFICIENTS = len(PRIOR)


class SurgeSwayInputs(NamedTuple):
    """Measured quantities that move a ship in surge and sway."""

    r: Any
    delta: Any
    n: Any  # by that at the start
    ahead: Any  # acceleration by wind
    aside: Any


def accelerations(
    u: Any, v: Any, at: SurgeSwayInputs, coefficients: Floats
) -> tuple[Any, Any]:
    """Surge and sway acceleration by quadratic equations of any ship."""
    r, delta, n, ahead, aside = at
    surge = (
        1.0,
        u - n,
        u**2 - n**2,
        v * r,
        v**2,
        r**2,
        delta**2,
        u**2 * delta**2,
    )
    sway = (
        1.0,
        u * v,
        v * abs(v),
        u * r,
        r * abs(r),
        v * abs(r),
        r * abs(v),
        u**2 * delta,
        delta,
    )
    *others, wind = coefficients
    own, aside_own = others[: len(surge)], others[len(surge) :]
    along = sum(
        c * term
        for c, term in zip(
            own,
            surge,
            strict=True,
        )
    )
    across = sum(c * term for c, term in zip(aside_own, sway, strict=True))
    return along + wind * ahead, across + wind * aside
