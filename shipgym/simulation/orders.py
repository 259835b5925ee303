"""Orders that no ship can be given: told before they are simulated."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.errors import InputError
from shipgym.models.equations import Equations
from shipgym.models.ship_model import ShipModel

Floats = NDArray[np.float64]

FASTEST_SHAFT = 5.0  # times the shaft speed at service speed; beyond it stands in other units


def checked_orders(model: ShipModel, commands: ArrayLike) -> Floats:
    """Orders of shape (n_steps, n_command), within what a rudder and a shaft can be asked for.

    A rudder ordered beyond its limit is brought to the limit, as its gear would do; beyond a right angle
    it was meant in other units.

    Raises
    ------
    InputError
        Naming the first row out of range.
    """
    orders = np.asarray(commands, dtype=float)
    names = model.command_names
    if orders.ndim != 2 or orders.shape[1] != len(names) or len(orders) < 2:
        raise InputError(
            f"commands: shape {orders.shape} found, expected (n_steps, {len(names)}) for {', '.join(names)}, "
            "with at least 2 steps"
        )
    if not np.all(np.isfinite(orders)):
        raise InputError(f"commands: row {int(np.argwhere(~np.isfinite(orders))[0, 0])} is not finite")
    if "delta" in names:
        rudder = orders[:, names.index("delta")]
        _within(rudder, -np.pi / 2, np.pi / 2, "rudder", "rad (not degrees) between -pi/2 and pi/2")
    if "n" in names:
        low, high, expected = _shaft_range(model)
        _within(orders[:, names.index("n")], low, high, "shaft speed", expected)
    return orders


def _shaft_range(model: ShipModel) -> tuple[float, float, str]:
    """Least and largest order of the shaft, 1/s, and how to say so."""
    most = FASTEST_SHAFT * model.service_shaft_speed
    limits = f"{model.service_shaft_speed:.4g} at service speed"
    dynamics = model.dynamics
    if not isinstance(dynamics, Equations) or dynamics.astern:
        return -most, most, f"1/s (not rpm) between {-most:.4g} and {most:.4g}; {limits}"
    if "n" in model.state_names:
        return 0.0, most, f"1/s (not rpm) between 0 and {most:.4g}, the shaft turning ahead; {limits}"
    # its advance ratio divides by the shaft speed
    least = float(np.nextafter(0.0, 1.0))
    return least, most, f"1/s (not rpm) above 0, the shaft turning ahead, up to {most:.4g}; {limits}"


def _within(values: Floats, low: float, high: float, what: str, expected: str) -> None:
    wrong = np.flatnonzero((values < low) | (values > high))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(f"commands: row {row}: {what} {values[row]:g} found, expected {expected}")
