"""Grey box: a reference ship's accelerations, converted by similarity, plus terms.

Source: Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via
adaptive RM-SVM with minor rudder. Their equation 11 adds accelerations of two different
ships; here those of the reference ship are converted back to the target first.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_flag
from shipgym.engine.compiled_ship import CompiledShip, compiled_ship
from shipgym.engine.motion import Accelerations, Motion, Ship
from shipgym.engine.record_code import changer
from shipgym.engine.records import Record
from shipgym.errors import InputError
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.term_functions import (
    accelerations_function,
    accelerations_source,
    coefficients_record,
)
from shipgym.ships.term_table import (
    ALWAYS_MEASURED,
    MEASURED,
    Structure,
    structure_fields,
)

SOURCE = (
    "Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via"
    " adaptive RM-SVM with minor rudder"
)


@dataclass(frozen=True)
class GreyBox(Structure):
    """A reference ship's accelerations plus a table of terms.

    The target's state is converted to the reference ship by the prime system of the
    service speeds (u and v by the ratio of the speeds, r and p by that of speed over
    length, heel and rudder as they are), and the reference ship's accelerations back to
    the target. The terms are added. Water is deep. The shaft turns as commanded,
    whatever lag the reference ship's has.

    Raises InputError for a table of forces, and for a reference ship that is a grey box
    itself or has no rudder.
    """

    # the reference ship: with equations of its own or a table of terms, without heave
    # or trim
    reference: ManoeuvringModel | None = None
    # whether the target's shaft speed is known: then the reference ship's is that times
    # the ratio of the shaft speeds at service speed. If not, its shaft turns as at
    # service speed
    shaft: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        where = f"structure '{self.name}'"
        if isinstance(self.ship.dynamics, GreyBox):
            raise InputError(
                f"{where}: expected a reference ship or a table of terms, got"
                f" {self.ship.name!r}, a grey box itself; take that grey box's own"
                " reference"
            )
        if self.quantity != "acceleration":
            raise InputError(
                f"{where}: expected quantity 'acceleration', because the terms are"
                " added to the reference ship's accelerations, got 'force'"
            )
        if self.shaft and "n" not in self.ship.command_names:
            raise InputError(
                f"{where}: expected shaft false, because reference"
                f" {self.ship.name!r} has no shaft speed, got true; leave it out"
            )

    @property
    def ship(self) -> ManoeuvringModel:
        """The reference ship."""
        assert self.reference is not None
        return self.reference

    @property
    def rolls(self) -> bool:
        """True where the reference ship, and with it the target, rolls."""
        return "phi" in self.ship.state_names

    @property
    def remembers(self) -> bool:
        """True where the reference ship has a memory of yaw, and with it the target."""
        return "q" in self.ship.state_names

    @cached_property
    def required_channels(self) -> tuple[str, ...]:
        """Channels a trial needs: those of the terms and of the reference ship."""
        needed = set(self.channels | ALWAYS_MEASURED)
        if self.rolls:
            needed.add("p")
            needed.add("phi")
        if self.shaft:
            needed.add("n")
        return tuple(name for name in MEASURED if name in needed)

    @property
    def has_rudder(self) -> bool:
        """True: the rudder of the reference ship turns it."""
        return True

    @property
    def needs_shaft_speed(self) -> bool:
        """True where the shaft speed at service speed has to be known."""
        return self.shaft or super().needs_shaft_speed

    @property
    def astern(self) -> bool:
        """True where the reference ship's shaft may turn astern."""
        return self.ship.dynamics.astern

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """Make what is compiled: the reference ship's functions and the terms."""
        # an equation without terms is the reference ship's alone
        source = accelerations_source(
            self.equations,
            prime=self.normalisation == "prime",
            damped=False,
        )
        functions = {"term_accelerations": accelerations_function(source)}
        terms = coefficients_record(self._n_terms, "GreyBoxTerms")
        return self.compiled_with(terms, functions, lag)

    def compiled_with(
        self, terms: Record, functions: dict[str, Any], lag: bool, **staged: Any
    ) -> CompiledShip:
        """Functions to be compiled of the reference ship and a sum of terms."""
        reference = self.ship.compiled
        hooks = {
            **reference.functions,
            "accelerations": accelerations,
            "reference_accelerations": reference.functions["accelerations"],
            "KNOWS_SHAFT": self.shaft,
            **functions,
        }
        hooks.pop("shaft_acceleration", None)  # the shaft turns as commanded
        return compiled_ship(
            name="a grey box",
            state_names=self.state_names,
            coefficients=_coefficients(reference.coefficients, terms),
            functions=tuple(hooks.items()),
            lag=lag,
            staged=tuple(staged.items()),
        )

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the compiled functions: the reference ship's, then the terms'."""
        terms = self.term_numbers(coefficients, particulars, shaft_speed)
        return np.concatenate([self.ship.ship_numbers(), terms])

    def to_dict(self) -> dict[str, Any]:
        """The table and the whole reference ship, as written in a model file."""
        return {
            **super().to_dict(),
            "shaft": self.shaft,
            "reference": self.ship.to_dict(),
        }

    @classmethod
    def read(
        cls, table: Mapping[str, Any], where: str, reference: ManoeuvringModel
    ) -> Self:
        """Read what `to_dict` wrote, given the reference; errors begin with `where`."""
        shaft = table.get("shaft", False)
        check_flag(shaft, f"{where}.shaft")
        fields = structure_fields(table, where)
        return cls(**fields, reference=reference, shaft=shaft)


moving = changer(Motion, "u", "v", "r", "p", "q", "n")
KNOWS_SHAFT = False  # whether the reference ship's shaft turns with the target's


def reference_accelerations(motion: Motion, c: Any, ship: Ship) -> Any:
    """Hook: the reference ship's accelerations."""


def term_accelerations(motion: Motion, c: Any, ship: Ship) -> Any:
    """Hook: the sum of the terms."""


def accelerations(motion: Motion, c: Any, ship: Ship) -> Accelerations:
    """The reference ship's at the converted state, converted back, and the terms."""
    fast = c.known.speed / ship.speed
    quick = fast * ship.length / c.known.length
    n = c.known.shaft
    if KNOWS_SHAFT:
        n = motion.n * (c.known.shaft / ship.shaft)
    at = moving(
        motion,
        fast * motion.u,
        fast * motion.v,
        quick * motion.r,
        quick * motion.p,
        quick * quick * motion.q,
        n,
    )
    surge, sway, yaw, roll, memory = reference_accelerations(at, c.reference, c.known)
    udot, vdot, rdot, _, _ = term_accelerations(motion, c.terms, ship)
    linear = 1.0 / (fast * quick)
    angular = 1.0 / (quick * quick)
    return (
        udot + linear * surge,
        vdot + linear * sway,
        rdot + angular * yaw,
        angular * roll,
        angular * memory / quick,
    )


@cache
def _coefficients(reference: Record, terms: Record) -> Record:
    """Record of a grey box's coefficients: the reference ship's and the terms'."""
    fields = [("known", Ship), ("reference", reference), ("terms", terms)]
    return NamedTuple("GreyBoxCoefficients", fields)  # type: ignore[return-value]
