"""Orders that no ship can be given: told before they are simulated."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.errors import InputError
from shipgym.ships.equations import Equations
from shipgym.ships.ship_model import ShipModel

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
    check_units(model, orders)
    if "n" in names and not turns_astern(model):
        expected = f"a number >= 0: the equations of {model.name!r} hold for a shaft turning ahead only"
        _within(orders[:, names.index("n")], 0.0, np.inf, "shaft speed", expected, "commands")
    return orders


def check_units(model: ShipModel, orders: Floats, where: str = "commands") -> None:
    """Refuse orders of shape (n, n_command) that are no numbers, or in other units than rad and 1/s.

    Raises
    ------
    InputError
        Naming the first row out of range.
    """
    names = model.command_names
    if not np.all(np.isfinite(orders)):
        raise InputError(f"{where}: row {int(np.argwhere(~np.isfinite(orders))[0, 0])} is not finite")
    if "delta" in names:
        rudder = orders[:, names.index("delta")]
        _within(rudder, -np.pi / 2, np.pi / 2, "rudder", "rad (not degrees) between -pi/2 and pi/2", where)
    if "n" in names:
        most = FASTEST_SHAFT * model.service_shaft_speed
        expected = (
            f"1/s (not rpm) between {-most if turns_astern(model) else 0.0:.4g} and {most:.4g}; "
            f"{model.service_shaft_speed:.4g} at service speed"
        )
        _within(orders[:, names.index("n")], -most, most, "shaft speed", expected, where)


def turns_astern(model: ShipModel) -> bool:
    """Whether the shaft may turn astern: a table of terms is taken at its word."""
    dynamics = model.dynamics
    if isinstance(dynamics, Equations):
        return dynamics.astern
    reference = getattr(dynamics, "reference", None)
    return reference is None or turns_astern(reference)


def _within(values: Floats, low: float, high: float, what: str, expected: str, where: str) -> None:
    wrong = np.flatnonzero((values < low) | (values > high))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(f"{where}: row {row}: {what} {values[row]:g} found, expected {expected}")
