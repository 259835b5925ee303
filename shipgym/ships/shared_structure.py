"""Tables for forces in which a coefficient may stand in several equations, added masses among them.

The vectorial model of captive tests: Xu, Hassani & Guedes Soares 2020, Truncated least
square support vector machine for parameter estimation of a nonlinear manoeuvring model
based on PMM tests, equations 18 to 21 and 39 to 41. Its hydrodynamic forces hold
accelerations, so that the mass to be accelerated follows from the coefficients.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars
from shipgym.ships.term_table import Structure, total_inertia
from shipgym.ships.terms import Term, short_terms

AXES = ("u", "v", "r")
ACCELERATIONS = ("udot", "vdot", "rdot")
VR, RR, UR = (
    Term("vr", (("v", 1), ("r", 1))),
    Term("rr", (("r", 2),)),
    Term("ur", (("u", 1), ("r", 1))),
)


@dataclass(frozen=True)
class Share:
    """A coefficient's share in the force of one equation: sign times coefficient times term."""

    coefficient: str  # its name: `Y_vdot`
    term: Term  # of velocities, or one acceleration (`udot`, `vdot`, `rdot`)
    sign: float = 1.0  # 1 or -1

    def __post_init__(self) -> None:
        where = f"share '{self.coefficient}'"
        if self.acceleration is None:
            self.term.check(where)
        elif repr(self.term.powers) != repr(
            ((self.acceleration, 1),)
        ):  # true is no power
            raise InputError(
                f"{where}: {dict(self.term.powers)} found, expected an acceleration"
                " alone"
            )

    @property
    def acceleration(self) -> str | None:
        """The acceleration it is on, None for velocities."""
        symbol = self.term.powers[0][0] if self.term.powers else ""
        return symbol if symbol in ACCELERATIONS else None

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a model file."""
        term = {"name": self.term.name, "powers": dict(self.term.powers)}
        return {"coefficient": self.coefficient, **term, "sign": self.sign}


@dataclass(frozen=True)
class SharedStructure(Structure):
    """A table for the hydrodynamic forces X, Y, N, prime system, that is identified from captive tests.

    Its `equations` are the terms that a simulation sums up: those of velocities of the
    shares, alike for sway and yaw, and the centripetal ones of the ship's own mass.
    Make one by `shared_structure`.
    """

    # what makes up X (`u`), Y (`v`) and N (`r`)
    shares: Mapping[str, tuple[Share, ...]] = field(default_factory=dict)
    # its added masses are among the unknowns, which only measured forces tell from the
    # mass
    captive: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        where = f"structure '{self.name}'"
        if tuple(self.shares) != AXES:
            raise InputError(
                f"{where}: shares of {tuple(self.shares)} found, expected of 'u',"
                " 'v', 'r'"
            )
        for axis, shares in self.shares.items():
            for share in shares:
                if share.acceleration is not None and (axis == "u") != (
                    share.acceleration == "udot"
                ):
                    raise InputError(
                        f"{where}: '{share.acceleration}' found in the equation of"
                        f" '{axis}', expected 'udot' in that of surge, 'vdot' and"
                        " 'rdot' in those of sway and yaw"
                    )

    @cached_property
    def coefficient_names(self) -> tuple[str, ...]:
        """Each coefficient once, those of X first."""
        return tuple(
            dict.fromkeys(
                share.coefficient for axis in AXES for share in self.shares[axis]
            )
        )

    def names(self, equation: str) -> tuple[str, ...]:
        """Names of the coefficients in one equation."""
        return tuple(
            dict.fromkeys(share.coefficient for share in self.shares[equation])
        )

    def added_mass(self, coefficients: Mapping[str, float]) -> Floats:
        """Derivatives of (X, Y, N) by (udot, vdot, rdot), prime system, shape (3, 3): negative added mass."""
        matrix = np.zeros((3, 3))
        for i, axis in enumerate(AXES):
            for share in self.shares[axis]:
                if share.acceleration is not None:
                    j = ACCELERATIONS.index(share.acceleration)
                    matrix[i, j] += share.sign * coefficients[share.coefficient]
        return matrix

    def inertia(
        self, coefficients: Mapping[str, float], particulars: Particulars
    ) -> Floats:
        """Mass of the ship and identified added mass, prime system, shape (3, 3).

        Raises InputError if it is not positive, or the particulars do not tell the
        mass.
        """
        return total_inertia(
            particulars,
            self.added_mass(coefficients),
            f"structure '{self.name}': the mass of the ship and the added mass of the"
            " coefficients are not positive together; expected derivatives X_udot,"
            " Y_vdot, N_rdot below 0",
        )

    def term_numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients of the SI features: the forces by mass and added mass (see `Structure`)."""
        p = particulars.completed()
        forces = np.concatenate(
            [self._velocity_forces(axis, coefficients, p) for axis in AXES]
        )
        return np.asarray(
            self.term_scales(p)
            * (self._from_forces(self.inertia(coefficients, p)) @ forces)
        )

    def _velocity_forces(
        self, axis: str, coefficients: Mapping[str, float], p: Particulars
    ) -> Floats:
        """Coefficient of each term of an equation in its force, that of the ship's own mass included."""
        terms = self.terms(axis)
        row = {frozenset(term.powers): i for i, term in enumerate(terms)}
        force = np.zeros(len(terms))
        for share in self.shares[axis]:
            if share.acceleration is None:
                force[row[frozenset(share.term.powers)]] += (
                    share.sign * coefficients[share.coefficient]
                )
        m, static = p.mass_prime, p.mass_prime * p.xg_prime
        own = {"u": ((VR, m), (RR, static)), "v": ((UR, -m),), "r": ((UR, -static),)}
        for term, value in own[axis]:
            force[row[frozenset(term.powers)]] += value
        return force

    def acceleration_matrix(
        self, particulars: Particulars, shaft_speed: float = 0.0
    ) -> Floats:
        """InputError: free-running trials cannot tell the unknown added masses from the mass."""
        raise InputError(
            f"structure '{self.name}': free-running trials found, expected captive"
            " tests with the channels X, Y, N: its added masses are among the"
            " unknowns; use identification.identify_forces"
        )

    def to_dict(self) -> dict[str, Any]:
        """The table as it stands in a model file."""
        return {
            "name": self.name,
            "source": self.source,
            "shares": {
                axis: [share.to_dict() for share in shares]
                for axis, shares in self.shares.items()
            },
        }

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> "SharedStructure":
        """The table from a model file."""
        shares = {
            axis: tuple(
                Share(
                    s["coefficient"],
                    Term(s["name"], tuple(s["powers"].items())),
                    s["sign"],
                )
                for s in listed
            )
            for axis, listed in table["shares"].items()
        }
        return shared_structure(table["name"], table["source"], shares)


def shared_structure(
    name: str, source: str, shares: Mapping[str, tuple[Share, ...]]
) -> SharedStructure:
    """A table for forces from the shares of equations `u`, `v`, `r`; InputError if it cannot be computed."""
    velocity = {
        axis: [share.term for share in listed if share.acceleration is None]
        for axis, listed in shares.items()
    }
    across = _distinct([*velocity.get("v", ()), *velocity.get("r", ()), UR])
    equations = {
        "u": _distinct([*velocity.get("u", ()), VR, RR]),
        "v": across,
        "r": across,
    }
    return SharedStructure(name, source, equations, "prime", "force", dict(shares))


def _distinct(terms: list[Term]) -> tuple[Term, ...]:
    """Each product once."""
    return tuple({frozenset(term.powers): term for term in reversed(terms)}.values())[
        ::-1
    ]


def read_shares(text: str) -> tuple[Share, ...]:
    """Shares from short names such as `X_uuu`, `Y_|r|v` or `N_vdot`, separated by spaces.

    After a colon stands the term where it is not that of the coefficient's name, as in
    `Y_vdot:vr`; a leading minus is the sign.
    """
    shares = []
    for word in text.split():
        sign, body = (-1.0, word[1:]) if word[0] == "-" else (1.0, word)
        coefficient, _, name = body.partition(":")
        name = name or coefficient.partition("_")[2]
        (term,) = (
            (Term(name, ((name, 1),)),)
            if name in ACCELERATIONS
            else short_terms(name, surge="u")
        )
        shares.append(Share(coefficient, term, sign))
    return tuple(shares)
