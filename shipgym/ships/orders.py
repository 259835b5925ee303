"""Orders that no ship can be given: told before they are simulated."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.errors import InputError

Floats = NDArray[np.float64]

FASTEST_SHAFT = 5.0  # times the shaft speed at service speed; beyond it stands in other units


class Ordered(Protocol):
    """What a ship has to say about the orders she can be given."""

    @property
    def name(self) -> str:
        """Name of the ship."""

    @property
    def command_names(self) -> tuple[str, ...]:
        """Rudder, and shaft speed where there is one."""

    @property
    def service_shaft_speed(self) -> float:
        """1/s."""

    @property
    def turns_astern(self) -> bool:
        """Whether her shaft may turn astern."""


def checked_orders(model: Ordered, commands: ArrayLike) -> Floats:
    """Orders of shape (n_steps, n_command), within what a rudder and a shaft can be asked for.

    A rudder ordered beyond its limit is brought to the limit, as its gear would do; beyond a right angle it
    was meant in other units. InputError names the first row out of range.
    """
    orders = np.asarray(commands, dtype=float)
    names = model.command_names
    if orders.ndim != 2 or orders.shape[1] != len(names) or len(orders) < 2:
        raise InputError(
            f"commands: shape {orders.shape} found, expected (n_steps, {len(names)}) for {', '.join(names)}, "
            "with at least 2 steps"
        )
    check_units(model, orders)
    if "n" in names and not model.turns_astern:
        expected = f"a number >= 0: the equations of {model.name!r} hold for a shaft turning ahead only"
        _within(orders[:, names.index("n")], 0.0, np.inf, "shaft speed", expected, "commands")
    return orders


def check_units(model: Ordered, orders: Floats, where: str = "commands") -> None:
    """InputError for orders of shape (n, n_command) that are not finite or not in rad and 1/s."""
    names = model.command_names
    if not np.all(np.isfinite(orders)):
        raise InputError(f"{where}: row {int(np.argwhere(~np.isfinite(orders))[0, 0])} is not finite")
    if "delta" in names:
        rudder = orders[:, names.index("delta")]
        _within(rudder, -np.pi / 2, np.pi / 2, "rudder", "rad (not degrees) between -pi/2 and pi/2", where)
    if "n" in names:
        most = FASTEST_SHAFT * model.service_shaft_speed
        expected = (
            f"1/s (not rpm) between {-most if model.turns_astern else 0.0:.4g} and {most:.4g}; "
            f"{model.service_shaft_speed:.4g} at service speed"
        )
        _within(orders[:, names.index("n")], -most, most, "shaft speed", expected, where)


def _within(values: Floats, low: float, high: float, what: str, expected: str, where: str) -> None:
    wrong = np.flatnonzero((values < low) | (values > high))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(f"{where}: row {row}: {what} {values[row]:g} found, expected {expected}")
