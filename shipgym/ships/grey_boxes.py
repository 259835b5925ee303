"""The grey box: the accelerations of a reference ship, converted by similarity, and a table of terms.

Source: Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via
adaptive RM-SVM with minor rudder. Their equation 11 adds accelerations of two different
ships; here those of the reference ship are converted back to the target first.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.engine.compiled_ship import CompiledShip, compiled_ship
from shipgym.engine.motion import Motion, Ship
from shipgym.engine.records import Record
from shipgym.errors import InputError
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.structures import WITH_REFERENCE
from shipgym.ships.term_functions import (
    accelerations_function,
    accelerations_source,
    coefficients_record,
)
from shipgym.ships.term_table import ALWAYS_MEASURED, MEASURED, Structure
from shipgym.ships.terms import read_terms

GREY_BOX = WITH_REFERENCE
SOURCE = (
    "Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via"
    " adaptive RM-SVM with minor rudder"
)
LINEAR = read_terms("du, v, r, delta, 1")


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
        if self.reference is None:
            raise InputError(
                f"{where}: no reference found, expected a ManoeuvringModel, or the name"
                " of a shipped model"
            )
        if isinstance(self.reference.dynamics, GreyBox):
            raise InputError(
                f"{where}: reference {self.reference.name!r} is a grey box itself,"
                " expected a reference ship or a table of terms; take that grey box's"
                " own reference"
            )
        if self.quantity != "acceleration":
            raise InputError(
                f"{where}: quantity 'force' found, expected 'acceleration': the terms"
                " are added to the reference ship's accelerations"
            )
        if self.shaft and "n" not in self.reference.command_names:
            raise InputError(
                f"{where}: shaft true found, but reference {self.reference.name!r} has"
                " no shaft speed; leave it out"
            )

    @property
    def ship(self) -> ManoeuvringModel:
        """The reference ship."""
        assert self.reference is not None
        return self.reference

    @property
    def rolls(self) -> bool:
        """Whether the reference ship has a rolling motion, and with it the target."""
        return "phi" in self.ship.state_names

    @property
    def remembers(self) -> bool:
        """Whether the reference ship has a memory of yaw, and with it the target."""
        return "q" in self.ship.state_names

    @cached_property
    def required_channels(self) -> tuple[str, ...]:
        """Channels a trial needs: those of the terms and those that the reference ship is evaluated at."""
        needed = self.channels | ALWAYS_MEASURED
        needed |= {"p", "phi"} if self.rolls else set()
        needed |= {"n"} if self.shaft else set()
        return tuple(name for name in MEASURED if name in needed)

    @property
    def has_rudder(self) -> bool:
        """Whether a rudder turns it: that of the reference ship does."""
        return True

    @property
    def needs_shaft_speed(self) -> bool:
        """Whether the shaft speed at service speed has to be known."""
        return self.shaft or super().needs_shaft_speed

    @property
    def astern(self) -> bool:
        """Whether the reference ship's shaft may turn astern."""
        return self.ship.turns_astern

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """What is compiled of a ship with this grey box: the reference ship's functions and the terms."""
        terms = coefficients_record(len(self._terms), "GreyBoxTerms")
        return self._compiled(
            terms,
            {"term_accelerations": accelerations_function(self._source)},
            lag,
        )

    def _compiled(
        self, terms: Record, functions: dict[str, Any], lag: bool, **staged: Any
    ) -> CompiledShip:
        """Functions of the reference ship, of the terms with their record of coefficients, and their sum."""
        reference = self.ship.compiled
        hooks = {
            **reference.functions,
            "accelerations": accelerations,
            "reference_accelerations": reference.functions["accelerations"],
            "KNOWS_SHAFT": self.shaft,
            **functions,
        }
        hooks.pop("shaft_acceleration", None)  # the shaft turns as commanded
        record = _coefficients(reference.coefficients, terms)
        named = tuple(hooks.items()), lag, tuple(staged.items())
        return compiled_ship("a grey box", self.state_names, record, *named)

    @cached_property
    def _source(self) -> str:
        """Written once; an equation without terms is the reference ship's alone."""
        return accelerations_source(self._sums, damped=False)

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the coefficients: the reference ship's, then those of the terms."""
        terms = self.term_numbers(coefficients, particulars, shaft_speed)
        return np.concatenate([self.ship.ship_numbers(), terms])

    def converted_accelerations(
        self,
        channels: Mapping[str, Any],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> dict[str, Floats]:
        """Accelerations of the reference ship, evaluated at and converted back to the target.

        The channels of the target are u, v, r, delta, and n, p, phi where known, each
        of shape (n_samples,), SI units; its particulars give length and service speed,
        the shaft speed is that at service speed, 1/s. Returns arrays of shape
        (n_samples,) by equation `u`, `v`, `r`, and `q` where the reference ship has a
        memory of yaw.
        """
        ship = self.ship
        fast = ship.particulars["speed"] / particulars["speed"]
        quick = fast * particulars["length"] / ship.particulars["length"]
        scale = {
            "u": fast,
            "v": fast,
            "r": quick,
            "p": quick,
            "phi": 1.0,
            "q": quick**2,
            "delta": 1.0,
        }
        values = {
            name: scale[name] * np.asarray(channels[name])
            for name in scale
            if name in channels
        }
        values["n"] = np.full_like(values["u"], ship.service_shaft_speed)
        if self.shaft:
            values["n"] = np.asarray(channels["n"]) * (
                ship.service_shaft_speed / shaft_speed
            )
        back = {
            "u": 1.0 / (fast * quick),
            "v": 1.0 / (fast * quick),
            "r": quick**-2,
            "q": quick**-3,
        }
        rates = ship.rates(values)
        return {q: rates[q] * back[q] for q in back if q in rates}

    def to_dict(self) -> dict[str, Any]:
        """The table and the whole reference ship, as they stand in a model file."""
        return {
            **super().to_dict(),
            "shaft": self.shaft,
            "reference": self.ship.to_dict(),
        }


KNOWS_SHAFT = False  # whether the reference ship's shaft turns with the target's


def reference_accelerations(motion: Motion, c: Any, ship: Ship) -> Any:
    """A hook: the accelerations of the reference ship."""


def term_accelerations(motion: Motion, c: Any, ship: Ship) -> Any:
    """A hook: the sum of the terms."""


def accelerations(
    motion: Motion, c: Any, ship: Ship
) -> tuple[float, float, float, float, float]:
    """The reference ship's at the converted state, converted back, and the terms."""
    fast = c.known.speed / ship.speed
    quick = fast * ship.length / c.known.length
    at = Motion(
        x=0.0,
        y=0.0,
        psi=0.0,
        u=fast * motion.u,
        v=fast * motion.v,
        r=quick * motion.r,
        p=quick * motion.p,
        phi=motion.phi,
        q=quick * quick * motion.q,
        delta=motion.delta,
        n=motion.n * (c.known.shaft / ship.shaft) if KNOWS_SHAFT else c.known.shaft,
    )
    surge, sway, yaw, roll, memory = reference_accelerations(at, c.reference, c.known)
    udot, vdot, rdot, _, _ = term_accelerations(motion, c.terms, ship)
    linear, angular = 1.0 / (fast * quick), 1.0 / (quick * quick)
    return (
        udot + linear * surge,
        vdot + linear * sway,
        rdot + angular * yaw,
        angular * roll,
        angular * memory / quick,
    )


@cache
def _coefficients(reference: Record, terms: Record) -> Record:
    """The record of a grey box's coefficients: the known ship, hers, and those of the terms."""
    fields = [("known", Ship), ("reference", reference), ("terms", terms)]
    return NamedTuple("GreyBoxCoefficients", fields)  # type: ignore[return-value]
