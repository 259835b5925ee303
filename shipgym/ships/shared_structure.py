"""Tables for forces whose coefficients and added masses may stand in several equations.

The vectorial model of captive tests: Xu, Hassani & Guedes Soares 2020, Truncated least
square support vector machine for parameter estimation of a nonlinear manoeuvring model
based on PMM tests, equations 18 to 21 and 39 to 41. Its hydrodynamic forces hold
accelerations, so that the mass to be accelerated follows from the coefficients.

How the damaged print is read: equation 19 prints Y_vdot vdot + Y_rdot rdot in X;
equations 25 and 26 have v r and r r in their place, as the matrix of equation 16 has,
so here, with the sign that is printed. Kirchhoff's equations have the other one; X_rvu
and X_urr take up the difference. Two terms of equations 20 and 21 are printed as Y_rvv
and Y_vvr; Table 1's units make the first v r r. Equations 40 and 41 print Y_uvv and
Y_urr on u u v and u u r: Y_uuv and Y_uur (equations 28 and 30); so N's. In N of
equation 41 and Table 11 the value -1.69e-2 is printed on v |v|, -1.00e-3 on r |v|;
equation 38, the matrix of equation 42 and Table 2 have v |r|, and equation 41 r |r|.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_table, check_text, placed, unexpected
from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars, total_inertia
from shipgym.ships.term_table import Structure
from shipgym.ships.terms import Term, short_terms

AXES = ("u", "v", "r")
ACCELERATIONS = ("udot", "vdot", "rdot")
# terms of the ship's own mass
VR = Term("vr", (("v", 1), ("r", 1)))
RR = Term("rr", (("r", 2),))
UR = Term("ur", (("u", 1), ("r", 1)))


class Share(NamedTuple):
    """Share of a coefficient in a force: sign times coefficient times term."""

    coefficient: str  # its name: `Y_vdot`
    term: Term  # of velocities, or one acceleration (`udot`, `vdot`, `rdot`)
    sign: float  # 1 or -1

    @property
    def acceleration(self) -> str | None:
        """The acceleration it is on, None for velocities."""
        return self.term.name if self.term.name in ACCELERATIONS else None


@dataclass(frozen=True)
class SharedStructure(Structure):
    """Table for forces X, Y, N, prime system, identified from captive tests.

    Its `equations` are the terms that a simulation sums up: those of velocities of the
    shares, the same for sway and yaw, and the centripetal ones of the ship's own mass.
    Make one by `SharedStructure.of`.
    """

    # what makes up X (`u`), Y (`v`) and N (`r`), as `read_shares` reads it
    texts: Mapping[str, str] = field(default_factory=dict)
    # its added masses are among the unknowns, which only measured forces tell from the
    # mass
    captive = True

    @cached_property
    def shares(self) -> dict[str, tuple[Share, ...]]:
        """Shares of X (`u`), Y (`v`) and N (`r`)."""
        return {axis: read_shares(text) for axis, text in self.texts.items()}

    @cached_property
    def coefficient_names(self) -> tuple[str, ...]:
        """Each coefficient once, those of X first."""
        names = [*self.names("u"), *self.names("v"), *self.names("r")]
        return tuple(dict.fromkeys(names))

    def names(self, equation: str) -> tuple[str, ...]:
        """Names of the coefficients in one equation."""
        shares = self.shares[equation]
        return tuple(dict.fromkeys(share.coefficient for share in shares))

    def added_mass(self, coefficients: Mapping[str, float]) -> Floats:
        """Derivatives of (X, Y, N) by (udot, vdot, rdot), prime system, (3, 3)."""
        matrix = np.zeros((3, 3))
        for row, axis in zip(
            matrix,
            AXES,
            strict=True,
        ):
            for share in self.shares[axis]:
                if share.acceleration is None:
                    continue
                column = ACCELERATIONS.index(share.acceleration)
                value = coefficients[share.coefficient]
                row[column] += share.sign * value
        return matrix

    def prime_inertia(
        self, coefficients: Mapping[str, float], particulars: Particulars
    ) -> Floats:
        """Mass of the ship and identified added mass, prime system, shape (3, 3).

        Raises InputError if it is not positive, or the particulars do not tell the
        mass.
        """
        return total_inertia(
            particulars,
            self.added_mass(coefficients),
            f"structure '{self.name}': expected a positive inertia, got mass of the"
            " ship and added mass of the coefficients that are not positive together;"
            " X_udot, Y_vdot and N_rdot are derivatives below 0",
        )

    def term_numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients of the SI features: forces by mass and added mass."""
        p = particulars.completed()
        inertia = self.prime_inertia(coefficients, p)
        forces = [self._velocity_forces(axis, coefficients, p) for axis in AXES]
        accelerations = self._from_forces(inertia) @ np.concatenate(forces)
        return self.term_scales(p) * accelerations

    def _velocity_forces(
        self, axis: str, coefficients: Mapping[str, float], p: Particulars
    ) -> Floats:
        """Coefficient of each term of a force, that of the ship's mass included."""
        force = {term.product: 0.0 for term in self.equations[axis]}
        for share in self.shares[axis]:
            if share.acceleration is None:
                value = coefficients[share.coefficient]
                force[share.term.product] += share.sign * value
        m = p.mass_prime
        m_xG = m * p.xg_prime
        if axis == "u":
            force[VR.product] += m
            force[RR.product] += m_xG
        else:
            force[UR.product] -= m if axis == "v" else m_xG
        return np.array(list(force.values()))

    def acceleration_matrix(
        self, particulars: Particulars, shaft_speed: float = 0.0
    ) -> Floats:
        """Refuse: free-running trials cannot tell unknown added masses from mass."""
        raise InputError(
            f"structure '{self.name}': expected captive tests with the channels X, Y,"
            " N, got free-running trials: its added masses are among the unknowns;"
            " choose another, such as 'abkowitz'"
        )

    def to_dict(self) -> dict[str, Any]:
        """Table as written in a model file."""
        return {
            "name": self.name,
            "source": self.source,
            "shares": dict(self.texts),
        }

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], where: str = "structure") -> Self:
        """Read what `to_dict` wrote; errors begin with `where`."""
        place = f"{where}.shares"
        given = check_table(table["shares"], place, allowed=AXES, required=AXES)
        texts = {axis: check_text(given[axis], f"{place}.{axis}") for axis in AXES}
        with placed(place):
            return cls.of(table.get("name"), table.get("source"), texts)

    @classmethod
    def of(cls, name: Any, source: Any, texts: Mapping[str, str]) -> Self:
        """Make a table for forces from the shares of equations `u`, `v` and `r`."""
        ahead, sway, yaw = (
            [share.term for share in read_shares(texts[axis]) if not share.acceleration]
            for axis in AXES
        )
        surge = _distinct([*ahead, VR, RR])
        across = _distinct([*sway, *yaw, UR])
        return cls(
            name=name,
            source=source,
            equations={"u": surge, "v": across, "r": across},
            normalisation="prime",
            quantity="force",
            texts=dict(texts),
        )


def _distinct(terms: Iterable[Term]) -> tuple[Term, ...]:
    """Each product once, where it stands last, by its first name."""
    found: dict[object, Term] = {}
    for term in terms:
        product = term.product
        first = found.pop(product, term)
        found[product] = first
    return tuple(found.values())


def read_shares(text: str) -> tuple[Share, ...]:
    """Read shares from short names such as `X_uuu`, `Y_|r|v` or `N_vdot`.

    After a colon stands the term where it is not that of the coefficient's name, as in
    `Y_vdot:vr`; a leading minus is the sign.
    """
    shares = []
    for word in text.split():
        sign = -1.0 if word.startswith("-") else 1.0
        coefficient, _, name = word.removeprefix("-").partition(":")
        name = name or coefficient.partition("_")[2]
        if not name:
            raise unexpected("shares", "words such as 'Y_vdot:vr'", word)
        term = Term(name, ((name, 1),))
        if name not in ACCELERATIONS:
            (term,) = short_terms(name, surge="u")
            term.check("shares")
        share = Share(coefficient, term, sign)
        shares.append(share)
    return tuple(shares)
