"""A ship as a manoeuvring model: structure, coefficients, how certain they are, and where they hold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.kernels import layout
from shipgym.ships.envelope import Envelope
from shipgym.ships.equations import EQUATIONS, Equations
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.ships.structures import PRINTED, Structure, get_structure

if TYPE_CHECKING:
    from shipgym.sea.conditions import Weather
    from shipgym.trials.trial import Trial

Floats = NDArray[np.float64]
Seed = int | np.random.Generator


@dataclass(frozen=True, eq=False)
class ShipModel:
    """A manoeuvring model of one ship.

    Attributes
    ----------
    name : str
        Name of the ship or of the model file.
    structure : str
        Name of its structure.
    particulars : Particulars
        Length, mass, added mass, service speed, ...; what was estimated is marked.
    steering : SteeringGear
        Rudder limit, rate and lag.
    coefficients : dict of str to float
        By name, in the normalisation of the structure, rudder positive to starboard.
    covariance : array of shape (n_coefficients, n_coefficients) or None
        Of the coefficients in their order; None where not identified.
    envelope : Envelope or None
        Of the data it was identified from.
    provenance : dict or None
        Method, settings, software version and trials it came from, or the source of a reference ship.
    own_table : Structure or None
        The table of terms a model file came with, or a registered one; by default the printed one of the
        structure's name.
    service_shaft_speed : float
        Shaft speed at service speed, 1/s; 0 where the model knows no shaft.
    """

    name: str
    structure: str
    particulars: Particulars
    steering: SteeringGear
    coefficients: dict[str, float]
    covariance: Floats | None = None
    envelope: Envelope | None = None
    provenance: dict[str, Any] | None = None
    own_table: Structure | None = None
    service_shaft_speed: float = 0.0

    def __post_init__(self) -> None:
        if self.own_table is None and self.structure not in PRINTED | EQUATIONS.keys():
            object.__setattr__(self, "own_table", get_structure(self.structure))  # another process lacks it
        self.particulars.require("speed")
        names = self.dynamics.coefficient_names
        missing = [name for name in names if name not in self.coefficients]
        unknown = [name for name in self.coefficients if name not in names]
        if missing or unknown:
            raise InputError(
                f"coefficients of {self.name!r}: structure {self.structure!r} has {len(names)}; "
                f"missing: {', '.join(missing) or 'none'}; unknown: {', '.join(unknown) or 'none'}"
            )
        ordered = {name: float(self.coefficients[name]) for name in names}
        wrong = [name for name, value in ordered.items() if not np.isfinite(value)]
        if wrong:
            raise InputError(
                f"coefficients of {self.name!r}: {wrong[0]} is {ordered[wrong[0]]}, expected a number"
            )
        object.__setattr__(self, "coefficients", ordered)
        if (
            isinstance(self.dynamics, Structure)
            and "n" in self.command_names
            and not self.service_shaft_speed > 0
        ):
            raise InputError(
                f"service_shaft_speed of {self.name!r}: {self.service_shaft_speed:g} found, expected that at "
                f"service speed in 1/s: the terms of structure {self.structure!r} have a shaft speed"
            )
        if self.covariance is not None and self.covariance.shape != (len(names), len(names)):
            raise InputError(
                f"covariance of {self.name!r}: shape {self.covariance.shape}, "
                f"expected ({len(names)}, {len(names)}), one row and column a coefficient"
            )

    @property
    def table(self) -> Structure:
        """The table of terms of its structure.

        Raises
        ------
        InputError
            If the ship has equations written by hand instead.
        """
        return get_structure(self.structure) if self.own_table is None else self.own_table

    @property
    def dynamics(self) -> Structure | Equations:
        """The table of terms, or the equations of a reference ship."""
        if self.own_table is None and self.structure in EQUATIONS:
            return EQUATIONS[self.structure]
        return self.table

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state, in the order of `derivatives`."""
        return self.dynamics.state_names

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names of the commands."""
        return self.dynamics.command_names

    @cached_property
    def service_state(self) -> Floats:
        """Straight ahead north at service speed with the rudder amidships, shape (n_state,)."""
        values = {"u": self.particulars["speed"], "n": self.service_shaft_speed}
        return np.array([values.get(name, 0.0) for name in self.state_names])

    @property
    def service_command(self) -> Floats:
        """Rudder amidships and shaft at service speed, shape (n_command,)."""
        return np.array([0.0, self.service_shaft_speed])[: len(self.command_names)]

    def derivatives(self, state: ArrayLike, command: ArrayLike, water_depth: float = np.inf) -> Floats:
        """Time derivative of the state, steering gear included.

        Parameters
        ----------
        state : array-like of shape (..., n_state)
            In the order of `state_names`, SI units.
        command : array-like of shape (..., n_command)
            In the order of `command_names`: rudder angle in rad, positive to starboard.
        water_depth : float
            In m; only deep water is known to identified structures.

        Returns
        -------
        array of shape (..., n_state)

        Raises
        ------
        InputError
            For another number of states or commands, for those that are not finite or in other units
            (degrees, revolutions per minute), or for water that is too shallow.
        """
        depth = np.asarray(water_depth, dtype=float)
        self.check_depth(float(depth.min()))
        states = np.asarray(state, dtype=float)
        from shipgym.ships.orders import check_units

        _expect_last_axis("state", states, self.state_names)
        commands = np.asarray(command, dtype=float)
        _expect_last_axis("command", commands, self.command_names)
        if not np.all(np.isfinite(states)):
            raise InputError(f"state: {states[~np.isfinite(states)][0]} found, expected finite numbers")
        check_units(self, commands.reshape(-1, len(self.command_names)), "command")
        shape = np.broadcast_shapes(states.shape[:-1], commands.shape[:-1], depth.shape)
        flat = np.array(np.broadcast_to(states, (*shape, states.shape[-1]))).reshape(-1, states.shape[-1])
        flat_commands = np.broadcast_to(commands, (*shape, commands.shape[-1])).reshape(len(flat), -1)
        out = np.empty((len(flat), layout.N_STATE))
        self.kernel("derivatives").derivatives(
            self.kernel_states(flat),
            two_commands(flat_commands),
            np.array(np.broadcast_to(depth, shape)).reshape(-1),
            self.ship_tile(),
            out,
        )
        return self.own_states(out).reshape(*shape, len(self.state_names))

    def check_depth(self, water_depth: float) -> None:
        """Refuse water that is too shallow, or shallow water in a ship that knows none.

        Raises
        ------
        InputError
        """
        if water_depth == np.inf:
            return
        check_number(water_depth, "water_depth", above=0.0, hint="in m, or inf for deep water")
        if not self.dynamics.shallow_water:
            raise InputError(
                f"water_depth: {water_depth:g} m found, but {self.name!r} is a deep-water model; leave it out"
            )
        draught = self.particulars["draught"]
        if not water_depth > draught:
            raise InputError(
                f"water_depth: {water_depth:g} m found, expected more than the draught of {draught:g} m"
            )

    def kernel_states(self, states: Floats) -> Floats:
        """States of shape (n, n_state) with the columns that the kernels know, those without use 0."""
        wide = np.zeros((len(states), layout.N_STATE))
        wide[:, self._columns] = states
        return wide

    def own_states(self, states: Floats) -> Floats:
        """The columns of `state_names` among the kernels', shape (n, n_state)."""
        return states[:, self._columns]

    @cached_property
    def _columns(self) -> list[int]:
        return [layout.STATE_NAMES.index(name) for name in self.kernel_names]

    @property
    def kernel_names(self) -> tuple[str, ...]:
        """Names of the kernels' columns of its state; the memory `q` of yaw lies where others keep roll."""
        return tuple("p" if name == "q" else name for name in self.state_names)

    def simulate(
        self,
        commands: ArrayLike,
        dt: float,
        state: ArrayLike | None = None,
        water_depth: float = np.inf,
        weather: Weather | str | None = None,
        seed: Seed = 0,
    ) -> Trial:
        """Simulate with commands held over each step (classical Runge-Kutta).

        Parameters
        ----------
        commands : array-like of shape (n_steps, n_command)
            Rudder angle in rad, positive to starboard.
        dt : float
            Step, s.
        state : array-like of shape (n_state,), optional
            Where to start; by default straight ahead at service speed.
        water_depth : float
            In m, for ships that know shallow water.
        weather : Weather or str, optional
            A weather or the name of a sea state; by default calm.
        seed : int or Generator
            Of the weather.

        Returns
        -------
        Trial
            n_steps + 1 samples with the state and the commands (`delta_command`). In weather x and y are over
            ground, u and v through the water; psi, r, p and phi are without the first-order motion in waves,
            which is in `psi_wave`, `r_wave`, `phi_wave`, `p_wave`; `current_north`, `current_east`,
            `wind_speed` and `wind_from` tell the weather. What instruments show of it all:
            `shipgym.trials.sensors.Sensors`.

        Raises
        ------
        UnstableModelError
            Where the ship leaves every physical range; carries the time and the last physical state.
        """
        from shipgym.ships.simulate import simulate

        return simulate(self, commands, dt, state, water_depth, weather=weather, seed=seed)

    def sample(self, n: int, seed: int | np.random.Generator) -> list[ShipModel]:
        """Models whose coefficients are drawn from the identified covariance.

        Parameters
        ----------
        n : int
            How many.
        seed : int or Generator
            Of the draw.

        Returns
        -------
        list of ShipModel

        Raises
        ------
        InputError
            If the model has no covariance.
        """
        if self.covariance is None:
            raise InputError(
                f"model {self.name!r} has no covariance: only identified models can be sampled from"
            )
        mean = np.array(list(self.coefficients.values()))
        values, vectors = np.linalg.eigh(_scaled(self.covariance))
        root = _scale(self.covariance)[:, None] * vectors * np.sqrt(np.clip(values, 0.0, None))
        draws = mean + np.random.default_rng(seed).standard_normal((n, len(mean))) @ root.T
        return [
            replace(
                self,
                name=f"{self.name}-draw-{i}",
                coefficients=dict(zip(self.coefficients, draw.tolist(), strict=True)),
                covariance=None,
            )
            for i, draw in enumerate(draws)
        ]

    def save(self, path: str | Path) -> None:
        """Write the model as a JSON file (format in `shipgym.ships.model_file`)."""
        from shipgym.ships.model_file import save

        save(self, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> ShipModel:
        """Read a model file.

        Raises
        ------
        InputError
            Naming the file and the field at fault.
        """
        from shipgym.ships.model_file import load

        return load(Path(path))

    @cached_property
    def accelerations_source(self) -> str:
        """Source of the accelerations that are compiled into the kernels."""
        return self.dynamics.accelerations_source(self.coefficients)

    def kernel(self, name: str, weather: bool = False, task: str | None = None) -> ModuleType:
        """One file of kernels, compiled with this ship, for calm water or weather, with a task or none."""
        from shipgym.engine.compiled import kernel

        return kernel(self.accelerations_source, name, weather, task)

    def ship_column(self, water_depth: float = np.inf, weather: Floats | None = None) -> Floats:
        """Constants and coefficients in the order of the kernels' rows, shape (n_rows,).

        `weather` holds the rows that tell of it (`shipgym.ships.conditions`); none in calm water.
        """
        p, gear = self.particulars, self.steering
        coefficients = self.dynamics.kernel_coefficients(self.coefficients, p, self.service_shaft_speed)
        column = np.zeros(layout.row(layout.COEFFICIENTS) + len(coefficients))
        column[layout.row(layout.LENGTH)] = p["length"]
        column[layout.row(layout.SERVICE_SPEED)] = p["speed"]
        column[layout.row(layout.RUDDER_LIMIT)] = gear.limit
        column[layout.row(layout.RUDDER_RATE)] = gear.rate
        column[layout.row(layout.GEAR_FREQUENCY)] = 1.0 / gear.time_constant if gear.time_constant else 0.0
        column[layout.row(layout.SERVICE_SHAFT)] = self.service_shaft_speed
        column[layout.row(layout.WATER_DEPTH)] = water_depth
        column[layout.row(layout.SCALE_SPEED)] = p["speed"]
        low, high, centre, shape, weather_at, end = map(layout.row, (
            layout.ENVELOPE_LOW, layout.ENVELOPE_HIGH, layout.ENVELOPE_CENTRE, layout.ENVELOPE_SHAPE,
            layout.WEATHER, layout.COEFFICIENTS,
        ))  # fmt: skip
        column[low:high], column[high:centre] = -np.inf, np.inf
        if self.envelope is not None:
            column[low:high], column[high:centre] = self.envelope.low, self.envelope.high
            column[centre:shape] = self.envelope.centre
            column[shape:weather_at] = self.envelope.shape[np.triu_indices(4)]
        if weather is not None:
            column[weather_at:end] = weather
        column[end:] = coefficients
        return column

    def ship_tile(self, water_depth: float = np.inf, weather: Floats | None = None) -> Floats:
        """A tile with the ship in each lane, as the kernels read it, shape (n_rows * 64,), a new array."""
        self.check_depth(water_depth)
        return np.repeat(self.ship_column(water_depth, weather), layout.LANES)


def _expect_last_axis(argument: str, array: Floats, names: tuple[str, ...]) -> None:
    if array.ndim == 0 or array.shape[-1] != len(names):
        raise InputError(
            f"{argument}: shape {array.shape} found, expected (..., {len(names)}) for {', '.join(names)}"
        )


def two_commands(commands: Floats) -> Floats:
    """Rudder and shaft speed for the kernels, shape (n, 2); a ship without shaft has speed 0."""
    two = np.zeros((len(commands), 2))
    two[:, : commands.shape[1]] = commands
    return two


def _scale(covariance: Floats) -> Floats:
    """Standard deviations, 1 where zero."""
    deviation = np.sqrt(np.diag(covariance))
    return np.where(deviation > 0.0, deviation, 1.0)


def _scaled(covariance: Floats) -> Floats:
    """Correlation matrix: coefficients of 1e-5 and of 1 have to be drawn equally well."""
    scale = _scale(covariance)
    scaled: Floats = covariance / np.outer(scale, scale)
    return scaled
