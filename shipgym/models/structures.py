"""Identified structures: for each equation a table of terms, linear in the coefficients.

A term is a product of integer powers of the velocities, the rudder angle and their kin. The same
table serves identification (stacked over samples), simulation (compiled, one state at a time) and the
model file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.checks import check_choice
from shipgym.errors import InputError
from shipgym.particulars import Particulars

Floats = NDArray[np.float64]

# du is the surge speed above service speed, U the speed through the water; all in SI units
SYMBOLS = ("u", "du", "v", "r", "delta", "n", "U")
VELOCITIES = ("u", "du", "v")  # divided by U in the prime system; r by U / L
FORCE_OF_EQUATION = {"u": "X", "v": "Y", "r": "N"}


@dataclass(frozen=True)
class Term:
    """A product of integer powers of symbols, in the units of the structure.

    Attributes
    ----------
    name : str
        As the field writes it: `vvr`, `0u`, `dd`.
    powers : tuple of (str, int)
        Symbols and their powers.
    """

    name: str
    powers: tuple[tuple[str, int], ...]

    def power(self, *symbols: str) -> int:
        """Sum of the powers of the given symbols."""
        return sum(power for symbol, power in self.powers if symbol in symbols)


@dataclass(frozen=True)
class Structure:
    """A table of terms for each acceleration, in the prime system, over a given inertia.

    The forces are those of the prime system with the instantaneous speed U, and the accelerations
    follow from them by the inertia of the particulars (mass and added mass, sway and yaw coupled).

    Attributes
    ----------
    name : str
        Name by which `identify` and model files know it.
    source : str
        Where it was published.
    equations : dict of str to tuple of Term
        Terms of the force along surge (`u`), sway (`v`) and yaw (`r`).
    """

    name: str
    source: str
    equations: Mapping[str, tuple[Term, ...]]

    @cached_property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names in the order of the equations: `X_u`, ..., `Y_v`, ..., `N_r`."""
        return tuple(
            f"{FORCE_OF_EQUATION[equation]}_{term.name}"
            for equation, terms in self.equations.items()
            for term in terms
        )

    @cached_property
    def required_channels(self) -> tuple[str, ...]:
        """Channels a trial needs so that every term can be evaluated."""
        symbols = {symbol for terms in self.equations.values() for term in terms for symbol, _ in term.powers}
        channels = symbols - {"du", "U"} | {"u", "v", "r"}
        return tuple(name for name in SYMBOLS if name in channels)

    @property
    def command_names(self) -> tuple[str, ...]:
        """Rudder, and shaft speed where it stands in a term."""
        return ("delta", "n") if "n" in self.required_channels else ("delta",)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state."""
        return ("x", "y", "psi", "u", "v", "r", "delta")

    @property
    def shallow_water(self) -> bool:
        """Whether the depth of the water is known to it."""
        return False

    def accelerations_source(self, coefficients: Mapping[str, float]) -> str:
        """Source of the compiled accelerations; the coefficients are read at run time."""
        from shipgym.simulation.generator import accelerations_source

        return accelerations_source(self)

    def kernel_coefficients(self, coefficients: Mapping[str, float], particulars: Particulars) -> Floats:
        """Coefficients of the SI features, in the order of the kernel's rows."""
        values: Floats = self.acceleration_matrix(particulars) @ np.array(list(coefficients.values()))
        return values

    def terms(self, equation: str) -> tuple[Term, ...]:
        """Terms of the equation of surge `u`, sway `v` or yaw `r`."""
        return self.equations[equation]

    def speed_power(self, equation: str, term: Term) -> int:
        """Power of U that makes the term of the prime system dimensional: U^2 less one per velocity."""
        return 2 - term.power(*VELOCITIES, "r")

    def length_power(self, equation: str, term: Term) -> int:
        """Power of L that makes the term of the prime system a dimensional acceleration."""
        return term.power("r") - (2 if equation == "r" else 1)

    def features(self, equation: str, channels: Mapping[str, Any], particulars: Particulars) -> Floats:
        """Terms of one equation on samples, in SI units.

        Parameters
        ----------
        equation : str
            `u`, `v` or `r`.
        channels : mapping of str to array of shape (n_samples,)
            At least `required_channels`, SI units.
        particulars : Particulars
            Gives the service speed.

        Returns
        -------
        array of shape (n_samples, n_terms)
            Features of which the acceleration is a linear combination.
        """
        symbols = {name: np.asarray(channels[name], dtype=float) for name in self.required_channels}
        symbols["U"] = np.hypot(symbols["u"], symbols["v"])
        symbols["du"] = symbols["u"] - particulars["speed"]
        columns = []
        for term in self.terms(equation):
            column = symbols["U"] ** float(self.speed_power(equation, term))
            for symbol, power in term.powers:
                column = column * symbols[symbol] ** power
            columns.append(column)
        return np.stack(columns, axis=-1)

    def acceleration_matrix(self, particulars: Particulars) -> Floats:
        """Matrix from the coefficients (prime system) to those of the SI features of the accelerations.

        Surge is divided by m' - X_udot'. Sway and yaw, which must have the same terms, are solved with
        their 2x2 inertia [[m' - Y_vdot', m'xG' - Y_rdot'], [m'xG' - N_vdot', Iz' - N_rdot']]
        (Chislett & Strom-Tejsen 1965).

        Parameters
        ----------
        particulars : Particulars
            With mass, inertia and added mass (`Particulars.completed`).

        Returns
        -------
        array of shape (n_coefficients, n_coefficients)
            Invertible, so that identified features give coefficients.
        """
        p = particulars
        m, xg = p.mass_prime, p.xg_prime
        surge_mass = m - p["X_udot"]
        inertia = np.array(
            [[m - p["Y_vdot"], m * xg - p["Y_rdot"]], [m * xg - p["N_vdot"], p.inertia_prime - p["N_rdot"]]]
        )
        if surge_mass <= 0 or np.linalg.det(inertia) <= 0:
            raise InputError(
                "The inertia of the ship is not positive: mass, xg, yaw_gyradius and added masses do not "
                "belong together. Added masses are in the prime system and negative (X_udot, Y_vdot, N_rdot)."
            )
        n_surge, n_sway = len(self.terms("u")), len(self.terms("v"))
        coupling = np.kron(np.linalg.inv(inertia), np.eye(n_sway))
        matrix = np.zeros((n_surge + 2 * n_sway,) * 2)
        matrix[:n_surge, :n_surge] = np.eye(n_surge) / surge_mass
        matrix[n_surge:, n_surge:] = coupling
        lengths = [
            p["length"] ** float(self.length_power(equation, term))
            for equation, terms in self.equations.items()
            for term in terms
        ]
        return np.array(lengths)[:, None] * matrix

    def to_dict(self) -> dict[str, Any]:
        """The table as it stands in a model file."""
        return {
            "name": self.name,
            "source": self.source,
            "equations": {
                equation: [{"name": term.name, "powers": dict(term.powers)} for term in terms]
                for equation, terms in self.equations.items()
            },
        }

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Structure:
        """The table from a model file (validated by `shipgym.models.model_file`)."""
        equations = {
            equation: tuple(Term(term["name"], tuple(term["powers"].items())) for term in terms)
            for equation, terms in table["equations"].items()
        }
        return cls(table["name"], table["source"], equations)


def prime_terms(words: str) -> tuple[Term, ...]:
    """Terms from the field's short names: letters u v r d (delta), 0 for the constant.

    `u` is the perturbation from service speed, so `0u` is the constant's change with it.
    """
    symbol_of = {"u": "du", "v": "v", "r": "r", "d": "delta"}
    terms = []
    for word in words.split():
        letters = word.lstrip("0")
        powers = {symbol_of[letter]: letters.count(letter) for letter in letters}
        terms.append(Term(word, tuple(powers.items())))
    return tuple(terms)


SWAY_AND_YAW = prime_terms("0 0u 0uu v r d vvv ddd vvr vvd vdd ud uv ur uud")

ABKOWITZ = Structure(
    name="abkowitz",
    source="Chislett & Strom-Tejsen 1965, Planar motion mechanism tests and full-scale steering and "
    "manoeuvring predictions for a Mariner class vessel; Cao 2015, equations 13 to 17",
    equations={
        "u": prime_terms("u uu uuu vv rr dd udd vr vd uvd"),
        "v": SWAY_AND_YAW,
        "r": SWAY_AND_YAW,
    },
)

STRUCTURES = {structure.name: structure for structure in (ABKOWITZ,)}


def get_structure(name: str) -> Structure:
    """An identified structure by name.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    return STRUCTURES[check_choice(name, STRUCTURES, "structure")]
