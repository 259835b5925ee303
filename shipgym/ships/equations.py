"""Ships with their own equations: a record of coefficients and published functions.

A file with such a ship defines `Coefficients`, a `NamedTuple` of numbers with their
published values, `accelerations(motion, c, ship)`, where the speed of the shaft is a
state `shaft_acceleration(n, command, c, ship)`, and `SHIP`, which says the rest. The
functions are plain Python; `shipgym.engine` compiles them.
"""

import importlib
import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number, check_text, placed, unexpected
from shipgym.engine.compiled_ship import CompiledShip, compiled_ship
from shipgym.engine.motion import Accelerations, Motion, Ship
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
from shipgym.ships.reference_ships import published_ships
from shipgym.ships.steering import SteeringGear

ACCELERATIONS = ("udot", "vdot", "rdot", "pdot", "qdot")
Equations = Callable[[Any, Any, Any], Accelerations]


def record_of(values: Mapping[str, float], module: str) -> Any:
    """Make a record of coefficients with these values as defaults."""
    names = list(values)
    defaults = list(values.values())
    record = namedtuple("Coefficients", names, defaults=defaults, module=module)  # type: ignore[misc]
    record.__annotations__ = dict.fromkeys(names, float)
    return record


def published(name: str, module: str) -> dict[str, Any]:
    """Fields of `ShipEquations` that were published of a reference ship."""
    table = published_ships()[name]
    return {
        "name": name,
        "source": table["source"],
        "coefficients_record": record_of(table["coefficients"], module),
        "particulars": Particulars(**table["particulars"]),
        "steering": SteeringGear(**table["steering"]),
        "service_shaft_speed": table["service_shaft_speed"],
    }


@dataclass(frozen=True)
class ShipEquations:
    """Equations of motion of one ship, with their numbers."""

    name: str  # by which `load_model` and model files know the ship
    source: str  # where the equations were published
    # a `NamedTuple` of floats, each with its published value as the default
    coefficients_record: Record
    # from (motion, coefficients, ship), see `Motion` and `Ship` of
    # `shipgym.engine.motion`, to udot, vdot in m/s^2, rdot, pdot in rad/s^2, and the
    # rate of the memory of yaw, 0 as a rule; body frame, origin midship
    accelerations: Equations
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
    path: Path | None = field(default=None, repr=False)
    # as a model file has it: the publication's units
    normalisation: ClassVar[str] = "own"
    quantity: ClassVar[str] = "force"  # what the coefficients make up
    # whether the dimensions are those of the particulars
    scales: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_text(self.name, "ship equations: name")
        where = f"equations of {self.name!r}"
        check_text(self.source, f"{where}: source")
        self._check_coefficients(where)
        what = "a function (motion, c, ship)"
        check_function(self.accelerations, 3, f"{where}: accelerations", what)
        shaft = self.shaft_acceleration
        if shaft is not None:
            what = "a function (n, command, c, ship)"
            check_function(shaft, 4, f"{where}: shaft_acceleration", what)
        if shaft is not None or self.service_shaft_speed:
            check_number(
                self.service_shaft_speed,
                f"{where}: service_shaft_speed",
                above=0.0,
            )
        with placed(where):
            self.particulars.require("speed")
            self._try()

    def _check_coefficients(self, where: str) -> None:
        record = self.coefficients_record
        if not is_record(record) or set(field_types(record).values()) != {float}:
            expected = "a NamedTuple of floats"
            raise unexpected(f"{where}: coefficients_record", expected, record)
        values = record._field_defaults  # type: ignore[attr-defined]
        for name in field_types(record):
            place = f"{where}: coefficient {name!r}"
            if name not in values:
                raise InputError(f"{place}: expected a default, got no value")
            check_number(values[name], place)

    def _try(self) -> None:
        """Accelerations of one state in plain Python, for its clear messages."""
        L = self.particulars["length"]
        U = self.particulars["speed"]
        n = self.service_shaft_speed
        gear = self.steering
        ship = Ship(L, U, gear.limit, gear.rate, 0.0, n, math.inf, U)
        at = {"psi": 0.1, "u": 0.9 * U, "v": 0.1 * U, "r": 0.1 * U / L, "n": n}
        at |= {"p": 0.01, "phi": 0.01, "delta": 0.1}
        motion = Motion(**dict.fromkeys(Motion._fields, 0.0) | at)
        c = self.coefficients_record()
        found = asked(self.accelerations, motion, c, ship)
        is_five = isinstance(found, tuple) and len(found) == len(ACCELERATIONS)
        if not is_five or not all(isinstance(one, (int, float)) for one in found):
            expected = (
                "five numbers, a tuple: udot, vdot, rdot, pdot, qdot, 0 for those that"
                " the ship does not have"
            )
            raise unexpected("accelerations", expected, found)
        if self.shaft_acceleration is not None:
            rate = asked(self.shaft_acceleration, n, 0.9 * n, c, ship)
            if not isinstance(rate, (int, float)):
                raise unexpected("shaft_acceleration", "a number, int or float", rate)

    def fault(
        self, state: Mapping[str, float], numbers: Sequence[Any], ship: Ship
    ) -> str:
        """Place where plain Python fails at a state, and why."""
        at = {name: state.get(name, 0.0) for name in Motion._fields}
        c = self.coefficients_record(*numbers)
        try:
            asked(self.accelerations, Motion(**at), c, ship)
        except InputError as error:
            return str(error)
        return place_of(self.accelerations)

    def __reduce__(self) -> Any:
        """Find a shipped ship by name in another process, others by their file."""
        if self.path is not None:
            return read_ship_equations, (self.path,)
        return _named, (self.accelerations.__module__,)

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names of the published coefficients, in their order."""
        return tuple(self.coefficients)

    @property
    def coefficients(self) -> dict[str, float]:
        """The published coefficients."""
        published = self.coefficients_record()._asdict()  # type: ignore[attr-defined]
        return {name: float(value) for name, value in published.items()}

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
        """Functions to be compiled, the same for all coefficients."""
        hooks: list[tuple[str, Any]] = [("accelerations", self.accelerations)]
        if self.shaft_acceleration is not None:
            hooks.append(("shaft_acceleration", self.shaft_acceleration))
        return compiled_ship(
            name=self.name,
            state_names=self.state_names,
            coefficients=self.coefficients_record,
            functions=tuple(hooks),
            lag=lag,
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
        """Equations as written in a model file."""
        return {"name": self.name, "source": self.source}


def read_ship_equations(path: str | Path) -> ShipEquations:
    """Run a Python file and return the ship that it defines as `SHIP`.

    Raises InputError for a file that is not there, cannot be run, or defines no `SHIP`.
    """
    path = Path(path).resolve()
    expected = "SHIP = ShipEquations(...)"
    module = asked(load_file, path, f"a Python file that defines {expected}")
    ship = getattr(module, "SHIP", None)
    if not isinstance(ship, ShipEquations):
        raise unexpected(str(path), expected, ship)
    refuse_closure(ship.accelerations)
    refuse_closure(ship.shaft_acceleration)
    object.__setattr__(ship, "path", path)
    return ship


def _named(module: str) -> ShipEquations:
    """The ship of an importable file."""
    ship: ShipEquations = importlib.import_module(module).SHIP
    return ship
