"""Equations of motion of one ship and their numbers, as simulations need them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from shipgym.arrays import Floats
from shipgym.checks import check_number, quoted
from shipgym.engine.compiled_ship import CompiledShip
from shipgym.engine.motion import Ship
from shipgym.errors import InputError
from shipgym.ships.envelope import Envelope
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import get_dynamics, get_structure
from shipgym.ships.term_table import Structure

if TYPE_CHECKING:  # most models have a table of terms
    from shipgym.ships.equations import ShipEquations

MODEL_FORMAT = 1  # of model files


@dataclass(frozen=True, eq=False)
class ManoeuvringModel:
    """Structure and coefficients of a ship, with uncertainty; see `ShipModel`."""

    name: str
    structure: str
    particulars: Particulars
    steering: SteeringGear
    coefficients: dict[str, float]
    covariance: Floats | None = None
    envelope: Envelope | None = None
    provenance: dict[str, Any] | None = None
    # by default, and for a copy with another structure, what is registered by its name
    dynamics: Structure | ShipEquations = None  # type: ignore[assignment]
    service_shaft_speed: float = 0.0
    #: coefficients drawn from a posterior, shape (n_draws, n_coefficients)
    draws: Floats | None = None

    def __post_init__(self) -> None:
        self.particulars.require("speed")
        if self.dynamics is None or self.dynamics.name != self.structure:
            dynamics = get_dynamics(self.structure)
            object.__setattr__(self, "dynamics", dynamics)
        coefficients = self._checked_coefficients()
        object.__setattr__(self, "coefficients", coefficients)

        shaft = self.service_shaft_speed
        needs_shaft = self.dynamics.scales and "n" in self.command_names
        if needs_shaft and not shaft > 0:
            raise InputError(
                f"service_shaft_speed of {self.name!r}: expected that at service speed"
                f" in 1/s, because structure {self.structure!r} has a shaft speed, got"
                f" {shaft:g}"
            )

    def _checked_coefficients(self) -> dict[str, float]:
        """Coefficients as floats, in the order of the structure."""
        names = self.dynamics.coefficient_names
        given = self.coefficients
        if given.keys() != set(names):
            missing = quoted(name for name in names if name not in given)
            unknown = quoted(name for name in given if name not in names)
            raise InputError(
                f"coefficients of {self.name!r}: expected the {len(names)} of its"
                f" structure; missing: {missing}; unknown: {unknown}"
            )
        return {
            name: check_number(given[name], f"coefficients.{name}") for name in names
        }

    @property
    def table(self) -> Structure:
        """Table of terms of the structure; InputError for equations written by hand."""
        if isinstance(self.dynamics, Structure):
            return self.dynamics
        return get_structure(self.structure)  # which refuses her

    # ---- coefficients ----------------------------------------------------------------

    @property
    def acceleration_matrix(self) -> Floats:
        """Matrix from coefficients to accelerations, as a `Structure` has it."""
        return self.table.acceleration_matrix(
            self.particulars, self.service_shaft_speed
        )

    def with_coefficients(self, values: Floats) -> Self:
        """Copy with other coefficients, in their order, shape (n_coefficients,)."""
        coefficients = dict(zip(self.coefficients, values.tolist(), strict=True))
        return replace(self, coefficients=coefficients)

    def with_accelerations(self, coefficients: Mapping[str, Floats]) -> Self:
        """Copy with the coefficients of regressions on accelerations, SI."""
        stacked = np.concatenate([coefficients[q] for q in self.table.regressed])
        values = np.linalg.solve(self.acceleration_matrix, stacked)
        return self.with_coefficients(values)

    # ---- parts of simulations --------------------------------------------------------

    @property
    def compiled(self) -> CompiledShip:
        """Functions and records to compile, shared by models that differ in numbers."""
        lag = self.steering.time_constant > 0.0
        return self.dynamics.compiled(self.coefficients, lag)

    def ship_numbers(self, water_depth: float = np.inf, step: float = 0.0) -> Floats:
        """Numbers that `compiled` reads, in its layout: `Ship`, then coefficients.

        `step`, s, is that of her simulation, which a lag of her steering gear has to be
        long enough for.

        Raises InputError for water that is too shallow, and for particulars that the
        structure cannot use.
        """
        self.check_depth(water_depth)
        values = tuple(self.coefficients.values())
        if values not in self._numbers:
            self._numbers.clear()
            self._numbers[values] = self.dynamics.numbers(
                self.coefficients,
                self.particulars,
                self.service_shaft_speed,
            )
        ship = ship_of(self, water_depth, step)
        return np.concatenate([ship, self._numbers[values]])

    @cached_property
    def _numbers(self) -> dict[tuple[float, ...], Floats]:
        """Last numbers of the dynamics, by the coefficients they were computed from."""
        return {}

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state, in the order of `derivatives`."""
        return self.dynamics.state_names

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names of the commands."""
        return self.dynamics.command_names

    @property
    def travel_time(self) -> float:
        """Time to travel one ship length at service speed, s."""
        return float(self.particulars["length"] / self.particulars["speed"])

    @cached_property
    def service_state(self) -> Floats:
        """State straight ahead north at service speed, shape (n_state,)."""
        values = {"u": self.particulars["speed"], "n": self.service_shaft_speed}
        return np.array([values.get(name, 0.0) for name in self.state_names])

    @property
    def service_command(self) -> Floats:
        """Rudder amidships and shaft at service speed, shape (n_command,)."""
        return np.array([0.0, self.service_shaft_speed])[: len(self.command_names)]

    # ---- rates of change -------------------------------------------------------------

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
        from shipgym.engine.loops import ship_loop  # a linear design does without

        states = _with_last_axis("state", state, self.state_names)
        commands = _with_last_axis("command", command, self.command_names)
        wrong = states[~np.isfinite(states)]
        if wrong.size:
            raise InputError(f"state: expected finite numbers, got {wrong[0]}")

        # one row for each state
        shape = np.broadcast_shapes(states.shape[:-1], commands.shape[:-1])
        rows = _rows(states, shape)
        orders = _rows(commands, shape)
        check_units(self, orders, "command")
        rates = np.empty_like(rows)
        loop = ship_loop(self.compiled, "derivatives")
        loop(rows, two_commands(orders), self.ship_numbers(water_depth), rates)
        return rates.reshape(*shape, len(self.state_names))

    def rates(
        self, channels: Mapping[str, Floats], water_depth: float = np.inf
    ) -> dict[str, Floats]:
        """`derivatives` by name at channels (n_samples,); absent states are 0."""
        none = np.zeros(len(channels["u"]))
        states = [channels.get(name, none) for name in self.state_names]
        commands = [channels[name] for name in self.command_names]
        rates = self.derivatives(
            np.stack(states, axis=-1),
            np.stack(commands, axis=-1),
            water_depth,
        )
        columns = rates.T
        return dict(zip(self.state_names, columns, strict=True))

    def plain_rates(self, state: Mapping[str, float]) -> dict[str, float]:
        """`derivatives` by name at one state, in plain Python: nothing is compiled.

        States that are absent are 0; a shaft is ordered to turn as in service. A rate
        is nan where Python has no number.
        """
        from shipgym.engine.loops import plain_loop

        row = np.array([[state.get(name, 0.0) for name in self.state_names]])
        orders = np.array([[state.get("delta", 0.0), self.service_shaft_speed]])
        rates = np.full_like(row, np.nan)
        loop = plain_loop(self.compiled, "derivatives")
        with np.errstate(all="ignore"), suppress(ArithmeticError, ValueError):
            loop(row, orders, self.ship_numbers(), rates)
        return dict(zip(self.state_names, rates[0].tolist(), strict=True))

    # ---- model file ------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Content of a model file, ready for JSON (see `shipgym.models.model_file`)."""
        covariance = self.covariance
        envelope = self.envelope
        fields = {
            "format": MODEL_FORMAT,
            "name": self.name,
            "structure": self.dynamics.to_dict(),
            "normalisation": self.dynamics.normalisation,
            "coefficients": self.coefficients,
            "covariance": None if covariance is None else covariance.tolist(),
            "particulars": self.particulars.to_dict(),
            "steering": self.steering.to_dict(),
            "service_shaft_speed": self.service_shaft_speed,
            "envelope": None if envelope is None else envelope.to_dict(),
            "provenance": self.provenance,
        }
        if self.draws is not None:
            fields["draws"] = self.draws.tolist()
        return fields

    def check_depth(self, water_depth: float) -> None:
        """Refuse water too shallow, or shallow water for a deep-water model."""
        if water_depth == np.inf:
            return
        hint = "in m, or inf for deep water"
        check_number(water_depth, "water_depth", above=0.0, hint=hint)
        if not self.dynamics.shallow_water:
            raise InputError(
                f"water_depth: expected none, because {self.name!r} is a deep-water"
                f" model, got {water_depth:g} m; leave it out"
            )
        draught = self.particulars["draught"]
        if not water_depth > draught:
            raise InputError(
                f"water_depth: expected more than the draught of {draught:g} m, got"
                f" {water_depth:g} m"
            )


def _with_last_axis(argument: str, given: ArrayLike, names: tuple[str, ...]) -> Floats:
    array = np.asarray(given, dtype=float)
    n = len(names)
    if array.ndim == 0 or array.shape[-1] != n:
        listed = ", ".join(names)
        raise InputError(
            f"{argument}: expected shape (..., {n}) for {listed}, got {array.shape}"
        )
    return array


def _rows(array: Floats, shape: tuple[int, ...]) -> Floats:
    """Rows of an array broadcast to a shape in front of its last axis."""
    width = array.shape[-1]
    repeated = np.broadcast_to(array, (*shape, width))
    return np.array(repeated).reshape(-1, width)


def ship_of(
    model: ManoeuvringModel, water_depth: float = np.inf, step: float = 0.0
) -> Ship:
    """Record of the numbers that every ship has besides its coefficients."""
    gear = model.steering
    p = model.particulars
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


# ---- orders ------------------------------------------------------------


def check_units(
    model: ManoeuvringModel, orders: Floats, where: str = "commands"
) -> None:
    """Refuse orders, shape (n, n_command), not finite or not in rad and 1/s."""
    wrong = np.argwhere(~np.isfinite(orders))
    if len(wrong):
        row, column = wrong[0].tolist()
        raise InputError(
            f"{where}: row {row}: expected finite numbers, got {orders[row, column]}"
        )
    _check_within(
        orders[:, 0],
        -np.pi / 2,
        np.pi / 2,
        "a rudder in rad (not degrees) between -pi/2 and pi/2",
        where,
    )
    fastest_shaft = 5.0  # times the speed in service; beyond it the units are wrong
    if "n" in model.command_names:
        service = model.service_shaft_speed
        most = fastest_shaft * service
        least = -most if model.dynamics.astern else 0.0
        _check_within(
            orders[:, 1],
            least,
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
