"""The equations of motion of one ship with her numbers: what every simulation is made from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.engine.compiled_ship import CompiledShip
from shipgym.engine.loops import ship_loop
from shipgym.engine.motion import Ship
from shipgym.errors import InputError
from shipgym.ships.envelope import Envelope
from shipgym.ships.equations import ShipEquations
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import (
    PRINTED,
    SHIPPED_EQUATIONS,
    get_dynamics,
    get_structure,
)
from shipgym.ships.term_table import Structure

FORMAT = 1  # of model files
FASTEST_SHAFT = (
    5.0  # times the shaft speed at service speed; beyond it stands in other units
)


@dataclass(frozen=True, eq=False)
class ManoeuvringModel:
    """A ship's structure and coefficients, their uncertainty and envelope; fields as in `ShipModel`."""

    name: str
    structure: str
    particulars: Particulars
    steering: SteeringGear
    coefficients: dict[str, float]
    covariance: Floats | None = None
    envelope: Envelope | None = None
    provenance: dict[str, Any] | None = None
    own_table: Structure | ShipEquations | None = None
    service_shaft_speed: float = 0.0

    def __post_init__(self) -> None:
        if (
            self.own_table is None
            and self.structure not in PRINTED | SHIPPED_EQUATIONS.keys()
        ):
            # another process lacks what is registered
            object.__setattr__(self, "own_table", get_dynamics(self.structure))
        self.particulars.require("speed")
        names = self.dynamics.coefficient_names
        missing = [name for name in names if name not in self.coefficients]
        unknown = [name for name in self.coefficients if name not in names]
        if missing or unknown:
            raise InputError(
                f"coefficients of {self.name!r}: structure {self.structure!r} has"
                f" {len(names)}; missing: {', '.join(missing) or 'none'}; unknown:"
                f" {', '.join(unknown) or 'none'}"
            )
        ordered = {name: float(self.coefficients[name]) for name in names}
        for name, value in ordered.items():
            if not np.isfinite(value):
                raise InputError(
                    f"coefficients of {self.name!r}: {name} is {value}, expected a"
                    " number"
                )
        object.__setattr__(self, "coefficients", ordered)
        if (
            self.dynamics.scales
            and "n" in self.command_names
            and not self.service_shaft_speed > 0
        ):
            raise InputError(
                f"service_shaft_speed of {self.name!r}: {self.service_shaft_speed:g}"
                " found, expected that at service speed in 1/s: structure"
                f" {self.structure!r} has a shaft speed"
            )
        if self.covariance is not None and self.covariance.shape != (
            len(names),
            len(names),
        ):
            raise InputError(
                f"covariance of {self.name!r}: shape {self.covariance.shape}, expected"
                f" ({len(names)}, {len(names)}), one row and column a coefficient"
            )

    @property
    def table(self) -> Structure:
        """The table of terms of its structure; InputError for a ship with equations written by hand."""
        dynamics = self.dynamics
        return (
            dynamics
            if isinstance(dynamics, Structure)
            else get_structure(self.structure)
        )

    @property
    def dynamics(self) -> Structure | ShipEquations:
        """The table of terms, or the equations of a ship that has her own."""
        return (
            get_dynamics(self.structure) if self.own_table is None else self.own_table
        )

    @property
    def acceleration_matrix(self) -> Floats:
        """From the coefficients to those of the accelerations, as `Structure.acceleration_matrix`."""
        return self.table.acceleration_matrix(
            self.particulars, self.service_shaft_speed
        )

    def with_coefficients(self, values: Floats) -> Self:
        """A copy with other coefficients, in their order, shape (n_coefficients,)."""
        return replace(
            self,
            coefficients=dict(zip(self.coefficients, values.tolist(), strict=True)),
        )

    def with_accelerations(self, coefficients: Mapping[str, Floats]) -> Self:
        """A copy with the coefficients that follow from those of each regression on accelerations, SI."""
        stacked = np.concatenate([coefficients[q] for q in self.table.regressed])
        return self.with_coefficients(
            np.linalg.solve(self.acceleration_matrix, stacked)
        )

    @property
    def travel_time(self) -> float:
        """Time to travel one ship length at service speed, s."""
        return float(self.particulars["length"] / self.particulars["speed"])

    @property
    def compiled(self) -> CompiledShip:
        """What is compiled of the ship: one for all models that differ in numbers only."""
        return self.dynamics.compiled(
            self.coefficients, self.steering.time_constant > 0.0
        )

    def ship_numbers(self, water_depth: float = np.inf, step: float = 0.0) -> Floats:
        """Numbers of the ship in the order of `compiled.layout`: `Ship`, then coefficients.

        `step`, s, is that of her simulation, which a lag of her steering gear has to be
        long enough for.

        Raises InputError for water that is too shallow, and for particulars that the
        structure cannot use.
        """
        self.check_depth(water_depth)
        of, kept = tuple(self.coefficients.values()), self._numbers
        if of not in kept:
            own = self.dynamics.numbers(
                self.coefficients, self.particulars, self.service_shaft_speed
            )
            kept.clear()
            kept[of] = own
        return np.concatenate([ship_of(self, water_depth, step), kept[of]])

    @cached_property
    def _numbers(self) -> dict[tuple[float, ...], Floats]:
        return {}  # by the coefficients that they were made of

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state, in the order of `derivatives`."""
        return self.dynamics.state_names

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names of the commands."""
        return self.dynamics.command_names

    @property
    def turns_astern(self) -> bool:
        """Whether the shaft may turn astern: a table of terms is taken at its word."""
        return self.dynamics.astern

    @cached_property
    def service_state(self) -> Floats:
        """Straight ahead north at service speed with the rudder amidships, shape (n_state,)."""
        values = {"u": self.particulars["speed"], "n": self.service_shaft_speed}
        return np.array([values.get(name, 0.0) for name in self.state_names])

    @property
    def service_command(self) -> Floats:
        """Rudder amidships and shaft at service speed, shape (n_command,)."""
        return np.array([0.0, self.service_shaft_speed])[: len(self.command_names)]

    def derivatives(
        self, state: ArrayLike, command: ArrayLike, water_depth: float = np.inf
    ) -> Floats:
        """Time derivative of the state, steering gear included.

        Raises InputError for another number of states or commands, for those that are
        not finite or in other units (degrees, revolutions per minute), or for water
        that is too shallow.

        Parameters
        ----------
        state : array-like of shape (..., n_state)
            In the order of `state_names`, SI units.
        command : array-like of shape (..., n_command)
            In the order of `command_names`: rudder angle in rad, positive to starboard.
        water_depth : float
            In m; only deep water is known to identified structures.
        """
        depth = np.asarray(water_depth, dtype=float)
        self.check_depth(float(depth.min()))
        states = _with_last_axis("state", state, self.state_names)
        commands = _with_last_axis("command", command, self.command_names)
        if not np.all(np.isfinite(states)):
            raise InputError(
                f"state: {states[~np.isfinite(states)][0]} found, expected finite"
                " numbers"
            )
        check_units(self, commands.reshape(-1, len(self.command_names)), "command")
        shape = np.broadcast_shapes(states.shape[:-1], commands.shape[:-1], depth.shape)
        flat = np.array(np.broadcast_to(states, (*shape, states.shape[-1]))).reshape(
            -1, states.shape[-1]
        )
        flat_commands = np.broadcast_to(commands, (*shape, commands.shape[-1])).reshape(
            len(flat), -1
        )
        depths = np.array(np.broadcast_to(depth, shape)).reshape(-1)
        out = np.empty_like(flat)
        loop = ship_loop(self.compiled, "derivatives")
        loop(flat, two_commands(flat_commands), depths, self.ship_numbers(), out)
        return out.reshape(*shape, len(self.state_names))

    def rates(
        self, channels: Mapping[str, Floats], water_depth: float = np.inf
    ) -> dict[str, Floats]:
        """`derivatives` by name at channels of shape (n_samples,); a state that is absent is 0."""
        none = np.zeros(len(channels["u"]))
        states = np.stack(
            [channels.get(name, none) for name in self.state_names], axis=-1
        )
        commands = np.stack([channels[name] for name in self.command_names], axis=-1)
        return dict(
            zip(
                self.state_names,
                self.derivatives(states, commands, water_depth).T,
                strict=True,
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """What a model file holds, ready for JSON (format in `shipgym.ships.model_file`)."""
        return {
            "format": FORMAT,
            "name": self.name,
            "structure": self.dynamics.to_dict(),
            "normalisation": self.dynamics.normalisation,
            "coefficients": self.coefficients,
            "covariance": None if self.covariance is None else self.covariance.tolist(),
            "particulars": self.particulars.to_dict(),
            "steering": self.steering.to_dict(),
            "service_shaft_speed": self.service_shaft_speed,
            "envelope": None if self.envelope is None else self.envelope.to_dict(),
            "provenance": self.provenance,
        }

    def check_depth(self, water_depth: float) -> None:
        """InputError for water that is too shallow, or shallow water and a ship that knows none."""
        if water_depth == np.inf:
            return
        check_number(
            water_depth, "water_depth", above=0.0, hint="in m, or inf for deep water"
        )
        if not self.dynamics.shallow_water:
            raise InputError(
                f"water_depth: {water_depth:g} m found, but {self.name!r} is a"
                " deep-water model; leave it out"
            )
        draught = self.particulars["draught"]
        if not water_depth > draught:
            raise InputError(
                f"water_depth: {water_depth:g} m found, expected more than the draught"
                f" of {draught:g} m"
            )


def _with_last_axis(argument: str, given: ArrayLike, names: tuple[str, ...]) -> Floats:
    array = np.asarray(given, dtype=float)
    if array.ndim == 0 or array.shape[-1] != len(names):
        raise InputError(
            f"{argument}: shape {array.shape} found, expected (..., {len(names)}) for"
            f" {', '.join(names)}"
        )
    return array


def two_commands(commands: Floats) -> Floats:
    """Rudder and shaft speed as loops take them, shape (n, 2); a ship without shaft has speed 0."""
    two = np.zeros((len(commands), 2))
    two[:, : commands.shape[1]] = commands
    return two


def checked_orders(model: ManoeuvringModel, commands: ArrayLike) -> Floats:
    """Orders of shape (n_steps, n_command), within what a rudder and a shaft can be asked for.

    A rudder ordered beyond its limit is brought to the limit, as its gear would do;
    beyond a right angle it was meant in other units. InputError names the first row out
    of range.
    """
    orders = np.asarray(commands, dtype=float)
    names = model.command_names
    if orders.ndim != 2 or orders.shape[1] != len(names) or len(orders) < 2:
        raise InputError(
            f"commands: shape {orders.shape} found, expected (n_steps, {len(names)})"
            f" for {', '.join(names)}, with at least 2 steps"
        )
    check_units(model, orders)
    if "n" in names and not model.turns_astern:
        expected = (
            f"a number >= 0: the equations of {model.name!r} hold for a shaft turning"
            " ahead only"
        )
        _within(
            orders[:, names.index("n")],
            0.0,
            np.inf,
            "shaft speed",
            expected,
            "commands",
        )
    return orders


def check_units(
    model: ManoeuvringModel, orders: Floats, where: str = "commands"
) -> None:
    """InputError for orders of shape (n, n_command) that are not finite or not in rad and 1/s."""
    names = model.command_names
    if not np.all(np.isfinite(orders)):
        raise InputError(
            f"{where}: row {int(np.argwhere(~np.isfinite(orders))[0, 0])} is not finite"
        )
    if "delta" in names:
        rudder = orders[:, names.index("delta")]
        _within(
            rudder,
            -np.pi / 2,
            np.pi / 2,
            "rudder",
            "rad (not degrees) between -pi/2 and pi/2",
            where,
        )
    if "n" in names:
        most = FASTEST_SHAFT * model.service_shaft_speed
        expected = (
            f"1/s (not rpm) between {-most if model.turns_astern else 0.0:.4g} and"
            f" {most:.4g}; {model.service_shaft_speed:.4g} at service speed"
        )
        _within(
            orders[:, names.index("n")], -most, most, "shaft speed", expected, where
        )


def _within(
    values: Floats, low: float, high: float, what: str, expected: str, where: str
) -> None:
    for row in np.flatnonzero((values < low) | (values > high))[:1]:
        raise InputError(
            f"{where}: row {row}: {what} {values[row]:g} found, expected {expected}"
        )


def ship_of(
    model: ManoeuvringModel, water_depth: float = np.inf, step: float = 0.0
) -> Ship:
    """What every ship has beside her coefficients, as a record, for simulations in steps of some seconds."""
    gear, p = model.steering, model.particulars
    return Ship(
        length=p["length"],
        speed=p["speed"],
        rudder_limit=gear.limit,
        rudder_rate=gear.rate,
        gear_frequency=gear.frequency(step),
        shaft=float(model.service_shaft_speed),
        water_depth=water_depth,
        scale_speed=p["speed"],
    )
