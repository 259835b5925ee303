"""Orders to rudder and shaft: checked, and in the form that loops take."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.errors import InputError


class Commanded(Protocol):
    """A model that takes orders."""

    @property
    def command_names(self) -> tuple[str, ...]:
        """Rudder, and shaft speed where the model has one."""

    @property
    def service_shaft_speed(self) -> float:
        """Shaft speed at service speed, 1/s."""

    @property
    def turns_astern(self) -> bool:
        """True where the shaft may turn astern."""


def checked_orders(model: Commanded, commands: ArrayLike) -> Floats:
    """Orders of shape (n_steps, n_command), within the limits of rudder and shaft.

    A rudder ordered beyond its limit is brought to the limit, as its gear would do;
    beyond a right angle it was meant in other units. InputError names the first row out
    of range.
    """
    orders = np.asarray(commands, dtype=float)
    names = model.command_names
    n = len(names)
    if orders.ndim != 2 or orders.shape[1] != n or len(orders) < 2:
        listed = ", ".join(names)
        raise InputError(
            f"commands: expected shape (n_steps, {n}) for {listed},"
            f" with at least 2 steps, got {orders.shape}"
        )
    check_units(model, orders)
    if "n" in names and not model.turns_astern:
        _check_within(
            orders[:, names.index("n")],
            0.0,
            np.inf,
            "a shaft speed >= 0, because the equations hold for a shaft ahead only",
            "commands",
        )
    return orders


def check_units(model: Commanded, orders: Floats, where: str = "commands") -> None:
    """Refuse orders, shape (n, n_command), not finite or not in rad and 1/s."""
    names = model.command_names
    wrong = np.argwhere(~np.isfinite(orders))
    if len(wrong):
        row, column = wrong[0].tolist()
        raise InputError(
            f"{where}: row {row}: expected finite numbers, got {orders[row, column]}"
        )
    if "delta" in names:
        _check_within(
            orders[:, names.index("delta")],
            -np.pi / 2,
            np.pi / 2,
            "a rudder in rad (not degrees) between -pi/2 and pi/2",
            where,
        )
    fastest_shaft = 5.0  # times the speed in service; beyond it the units are wrong
    if "n" in names:
        service = model.service_shaft_speed
        most = fastest_shaft * service
        least = -most if model.turns_astern else 0.0
        _check_within(
            orders[:, names.index("n")],
            -most,
            most,
            f"a shaft speed in 1/s (not rpm) between {least:.4g} and {most:.4g},"
            f" {service:.4g} at service speed",
            where,
        )


def _check_within(
    values: Floats, low: float, high: float, expected: str, where: str
) -> None:
    beyond = (values < low) | (values > high)
    if beyond.any():
        row = int(beyond.argmax())
        value = values[row]
        raise InputError(f"{where}: row {row}: expected {expected}, got {value:g}")


def two_commands(commands: Floats) -> Floats:
    """Rudder and shaft speed as loops take them, shape (n, 2); 0 without a shaft."""
    two = np.zeros((len(commands), 2))
    two[:, : commands.shape[1]] = commands
    return two
