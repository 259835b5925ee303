"""Ships with equations of their own: a record of coefficients and functions that read like the publication.

A file with such a ship defines `Coefficients`, a `NamedTuple` of numbers with their
published values, `accelerations(motion, c, ship)`, where the speed of the shaft is a
state `shaft_acceleration(n, command, c, ship)`, and `SHIP`, which says the rest. The
functions are plain Python; `shipgym.engine` compiles them.
"""

import importlib
import math
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_flag, check_number, check_text, placed
from shipgym.engine.compiled_ship import CompiledShip, compiled_ship
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.records import Record, field_types, is_record
from shipgym.errors import InputError
from shipgym.python_files import (
    asked,
    check_function,
    load_file,
    place_of,
    refuse_closure,
)
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear

RATES = ("udot", "vdot", "rdot", "pdot", "qdot")
Accelerations = Callable[[Any, Any, Any], tuple[float, float, float, float, float]]


def record_of(values: Mapping[str, float], module: str) -> Any:
    """A record of coefficients with these values as defaults, for the file of a ship."""
    names, defaults = [*values], [*values.values()]
    record = namedtuple("Coefficients", names, defaults=defaults, module=module)  # type: ignore[misc]
    record.__annotations__ = dict.fromkeys(values, float)
    return record


@dataclass(frozen=True)
class ShipEquations:
    """The equations of motion of one ship, with her numbers."""

    name: str  # by which `load_model` and model files know the ship
    source: str  # where the equations were published
    coefficients_record: (
        Record  # a `NamedTuple` of floats, each with its published value as the default
    )
    # from (motion, coefficients, ship), see `Motion` and `Ship` of
    # `shipgym.engine.motion`, to udot, vdot in m/s^2, rdot, pdot in rad/s^2, and the
    # rate of the memory of yaw, 0 as a rule; body frame, origin midship
    accelerations: Accelerations
    particulars: Particulars  # with length and service speed
    steering: SteeringGear
    _: KW_ONLY
    # from (n, command, coefficients, ship) to the acceleration of the shaft, 1/s^2:
    # then its speed is a state. Without it the shaft turns as commanded
    shaft_acceleration: Callable[[float, float, Any, Any], float] | None = None
    # 1/s; 0 without a propeller of her own, her only command then the rudder
    service_shaft_speed: float = 0.0
    rolls: bool = False  # whether roll rate and heel are among her states
    shallow_water: bool = False  # whether the equations know the depth of the water
    astern: bool = False  # whether the propeller holds for a shaft that turns astern
    # coefficients that choose between forms of the equations: the functions read them
    # as constants of the same name in their file, which are compiled in
    switches: tuple[str, ...] = ()
    path: Path | None = field(default=None, repr=False)
    normalisation: ClassVar[str] = (
        "own"  # as a model file has it: the publication's units
    )
    quantity: ClassVar[str] = "force"  # what the coefficients make up
    scales: ClassVar[bool] = (
        False  # whether the dimensions are those of the particulars
    )

    def __post_init__(self) -> None:
        check_text(self.name, "ship equations: name")
        where = f"equations of {self.name!r}"
        check_text(self.source, f"{where}: source")
        record = self.coefficients_record
        if not is_record(record) or any(
            kind is not float for kind in field_types(record).values()
        ):
            raise InputError(
                f"{where}: coefficients_record {record!r} found, expected a NamedTuple"
                " of floats"
            )
        valued = record._field_defaults  # type: ignore[attr-defined]
        for name in self.coefficient_names:
            if name not in valued:
                raise InputError(
                    f"{where}: coefficient {name!r} has no value, expected a default"
                )
            check_number(valued[name], f"{where}: coefficient {name!r}")
        for name in (
            self.switches if isinstance(self.switches, tuple) else (self.switches,)
        ):
            if name not in self.coefficient_names:
                raise InputError(
                    f"{where}: switches: {name!r} found, expected a tuple of names of"
                    " coefficients"
                )
        for name in ("rolls", "shallow_water", "astern"):
            check_flag(getattr(self, name), f"{where}: {name}")
        check_function(
            self.accelerations,
            3,
            f"{where}: accelerations",
            "a function (motion, c, ship)",
        )
        if self.shaft_acceleration is not None:
            what = "a function (n, command, c, ship)"
            check_function(
                self.shaft_acceleration, 4, f"{where}: shaft_acceleration", what
            )
        if self.shaft_acceleration is not None or self.service_shaft_speed:
            check_number(
                self.service_shaft_speed, f"{where}: service_shaft_speed", above=0.0
            )
        self.particulars.require("speed")
        self._try(where)

    def _try(self, where: str) -> None:
        """Work out the accelerations of one state as plain Python, whose messages are the clearest."""
        L, U = self.particulars["length"], self.particulars["speed"]
        n, limit, rate = (
            self.service_shaft_speed,
            self.steering.limit,
            self.steering.rate,
        )
        ship = Ship(L, U, limit, rate, 0.0, n, math.inf, U)
        motion = Motion(
            0.0, 0.0, 0.1, 0.9 * U, 0.1 * U, 0.1 * U / L, 0.01, 0.01, 0.0, 0.1, n
        )
        coefficients = self.coefficients_record()
        with placed(where):
            found = asked(self.accelerations, motion, coefficients, ship)
            if not isinstance(found, tuple) or len(found) != len(RATES):
                raise InputError(
                    f"accelerations returns {found!r}, expected five numbers, a tuple:"
                    " udot, vdot, rdot, pdot, qdot, 0 for those that the ship does not"
                    " have"
                )
            rates = dict(zip(RATES, found, strict=True))
            if self.shaft_acceleration is not None:
                rates["shaft_acceleration"] = asked(
                    self.shaft_acceleration, n, 0.9 * n, coefficients, ship
                )
            for name, value in rates.items():
                if not isinstance(value, (int, float)):
                    raise InputError(
                        f"{name} is {value!r}, expected a number, int or float"
                    )

    def fault(
        self, state: Mapping[str, float], coefficients: Mapping[str, float], ship: Ship
    ) -> str:
        """Where plain Python fails at a state, and why; the place of the accelerations if it does not."""
        motion = Motion(*[state.get(name, 0.0) for name in Motion._fields])
        try:
            asked(
                self.accelerations,
                motion,
                self.coefficients_record(**coefficients),
                ship,
            )
        except InputError as error:
            return str(error)
        return place_of(self.accelerations)

    def __reduce__(self) -> Any:
        """Another process finds a ship of this package by her name, another by her file."""
        if self.path is not None:
            return read_ship_equations, (self.path,)
        return _named, (self.accelerations.__module__,)

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names in the order of the record."""
        names: tuple[str, ...] = self.coefficients_record._fields  # type: ignore[attr-defined]
        return names

    @property
    def coefficients(self) -> dict[str, float]:
        """The published coefficients."""
        return {
            name: float(value)
            for name, value in self.coefficients_record()._asdict().items()
        }  # type: ignore[attr-defined]

    @property
    def command_names(self) -> tuple[str, ...]:
        """Rudder, and shaft speed where the ship has a propeller."""
        return ("delta", "n") if self.service_shaft_speed else ("delta",)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state."""
        roll = ("p", "phi") if self.rolls else ()
        shaft = ("n",) if self.shaft_acceleration is not None else ()
        return ("x", "y", "psi", "u", "v", "r", *roll, "delta", *shaft)

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """What is compiled of the ship: the same whatever her coefficients are, but for the switches."""
        functions: dict[str, Any] = {"accelerations": self.accelerations}
        functions |= {name: bool(coefficients[name]) for name in self.switches}
        if self.shaft_acceleration is not None:
            functions["shaft_acceleration"] = self.shaft_acceleration
        return compiled_ship(
            self.name,
            self.state_names,
            self.coefficients_record,
            tuple(functions.items()),
            lag,
        )

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the coefficients' record."""
        return np.array([coefficients[name] for name in self.coefficient_names])

    def to_dict(self) -> dict[str, Any]:
        """As they stand in a model file."""
        return {"name": self.name, "source": self.source}


def read_ship_equations(path: str | Path) -> ShipEquations:
    """The ship that a Python file defines as `SHIP`; the file is run.

    Raises InputError for a file that is not there, cannot be run, or defines no `SHIP`.
    """
    path = Path(path).resolve()
    written = "SHIP = ShipEquations(...)"
    ship = getattr(
        load_file(path, f"a Python file that defines {written}"), "SHIP", None
    )
    if not isinstance(ship, ShipEquations):
        raise InputError(f"{path}: SHIP = {ship!r} found, expected {written}")
    for one in (ship.accelerations, ship.shaft_acceleration):
        refuse_closure(one)
    object.__setattr__(ship, "path", path)
    return ship


def _named(module: str) -> ShipEquations:
    """The ship of an importable file."""
    ship: ShipEquations = importlib.import_module(module).SHIP
    return ship
