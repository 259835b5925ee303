"""Surge and sway of any ship by quadratic equations, to see a current behind them.

All quantities are in units of the ship's length and service speed.
"""

from typing import Any, NamedTuple

import numpy as np


class Coefficients(NamedTuple):
    """Coefficients of `accelerations`."""

    X_0: Any
    X_u: Any
    X_uu: Any
    X_vr: Any
    X_vv: Any
    X_rr: Any
    X_dd: Any
    X_uudd: Any
    Y_0: Any
    Y_uv: Any
    Y_vv: Any
    Y_ur: Any
    Y_rr: Any
    Y_vr: Any
    Y_rv: Any
    Y_uud: Any
    Y_d: Any
    wind: Any


#: Mean and standard deviation of the coefficients before any trial.
PRIOR = Coefficients(
    X_0=(0.0, 0.02),
    X_u=(-0.10, 0.2),
    X_uu=(-0.05, 0.2),
    X_vr=(0.9, 0.6),
    X_vv=(-0.5, 1.5),
    X_rr=(0.0, 0.3),
    X_dd=(-0.03, 0.15),
    X_uudd=(-0.03, 0.15),
    Y_0=(0.0, 0.02),
    Y_uv=(-0.9, 0.6),
    Y_vv=(-3.0, 4.0),
    Y_ur=(-0.35, 0.25),
    Y_rr=(0.0, 0.5),
    Y_vr=(-0.5, 1.5),
    Y_rv=(0.0, 1.5),
    Y_uud=(-0.06, 0.1),
    Y_d=(-0.04, 0.1),
    wind=(1.0, 0.25),
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
    u: Any, v: Any, at: SurgeSwayInputs, c: Coefficients
) -> tuple[Any, Any]:
    """Surge and sway acceleration by quadratic equations of any ship."""
    return _surge_acceleration(u, v, at, c), _sway_acceleration(u, v, at, c)


def _surge_acceleration(u: Any, v: Any, at: SurgeSwayInputs, c: Coefficients) -> Any:
    return (
        c.X_0
        + c.X_u * (u - at.n)
        + c.X_uu * (u**2 - at.n**2)
        + c.X_vr * v * at.r
        + c.X_vv * v**2
        + c.X_rr * at.r**2
        + (c.X_dd + c.X_uudd * u**2) * at.delta**2
        + c.wind * at.ahead
    )


def _sway_acceleration(u: Any, v: Any, at: SurgeSwayInputs, c: Coefficients) -> Any:
    return (
        c.Y_0
        + c.Y_uv * u * v
        + c.Y_vv * v * abs(v)
        + c.Y_ur * u * at.r
        + c.Y_rr * at.r * abs(at.r)
        + c.Y_vr * v * abs(at.r)
        + c.Y_rv * at.r * abs(v)
        + (c.Y_uud * u**2 + c.Y_d) * at.delta
        + c.wind * at.aside
    )
