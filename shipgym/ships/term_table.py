"""A structure: for each equation of motion a table of terms, linear in the coefficients.

The same table serves identification (stacked over samples), simulation (compiled, one
state at a time) and the model file.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_text, quoted
from shipgym.engine.compiled_ship import CompiledShip, compiled_ship
from shipgym.errors import InputError
from shipgym.ships import term_functions
from shipgym.ships.particulars import ADDED_MASSES, Particulars
from shipgym.ships.terms import (
    CHANNEL,
    MOST_TERMS,
    ROLL,
    SHAFT_SPEEDS,
    SPEEDS,
    SYMBOLS,
    TURN_RATES,
    Term,
)

FORCE_OF_EQUATION = {"u": "X", "v": "Y", "r": "N"}
#: As Zhu 2018 names the coefficients of surge, sway and yaw; roll, and the memory of
#: yaw, go on from there.
ACCELERATION_OF_EQUATION = {"u": "a", "v": "b", "r": "c", "p": "d", "q": "e"}
EQUATION_NAMES = tuple(ACCELERATION_OF_EQUATION)
ANGULAR = ("r", "p", "q")  # of these the unit holds 1 / length once more
NORMALISATIONS = ("prime", "service", "si")
QUANTITIES = ("force", "acceleration")
MEASURED = ("u", "v", "r", "p", "phi", "delta", "n")  # channels of a trial
ALWAYS_MEASURED = frozenset(("u", "v", "r", "delta"))


@dataclass(frozen=True)
class Structure:
    """A table of terms for surge, sway, yaw and roll, or some of them.

    Without an equation of surge the ship keeps the speed it has; without one of sway or
    of yaw it does not drift or turn, and what drift or turn it is given dies out within
    about a ship length; without one of roll it stays upright.

    Yaw may have a memory q: part of its acceleration that builds up, rdot = (terms of
    `r`) + q and qdot = (terms of `q`). It is the state that makes yaw of second order
    without sway.

    Raises InputError for a table that cannot be computed, naming equation and term.
    """

    name: str  # name by which `identify` and model files know it
    source: str  # where it was published
    # terms of surge (`u`), sway (`v`), yaw (`r`), roll (`p`) and of the memory of yaw
    # (`q`), in this order; roll and memory of accelerations only, and not both
    equations: Mapping[str, tuple[Term, ...]]
    # {"prime", "service", "si"}; units of the terms and of what they make up. "prime":
    # divided by the instantaneous speed U and the length (u/U, rL/U, nL/U; force by rho
    # L^2 U^2 / 2, acceleration by U^2 / L). "service": the same with the service speed
    # U0 in place of U, shaft speed divided by that of service. "si": as they are
    normalisation: str = "prime"
    # {"force", "acceleration"}; what the terms make up (those of `q` accelerations per
    # time). Accelerations follow from forces by the inertia of the particulars (mass
    # and added mass, sway and yaw coupled)
    quantity: str = "force"
    scales: ClassVar[bool] = True  # whether the dimensions are those of the particulars
    captive: ClassVar[bool] = (
        False  # whether it is identified from the forces of captive tests
    )
    shallow_water: ClassVar[bool] = False  # whether it knows the depth of the water

    def __post_init__(self) -> None:
        where = f"structure '{self.name}'"
        check_text(self.name, "structure: name")
        check_text(self.source, f"{where}: source")
        check_choice(self.normalisation, NORMALISATIONS, f"{where}: normalisation")
        check_choice(self.quantity, QUANTITIES, f"{where}: quantity")
        known = [equation for equation in EQUATION_NAMES if equation in self.equations]
        if not known or list(self.equations) != known:
            raise InputError(
                f"{where}: equations {quoted(self.equations)} found, expected some of "
                f"{quoted(EQUATION_NAMES)}, in this order"
            )
        for equation, terms in self.equations.items():
            _check_terms(terms, self.normalisation, f"{where}: equations.{equation}")
        self._check_roll_and_memory(where)
        self._check_inertia(where)

    def _check_roll_and_memory(self, where: str) -> None:
        rolling = [symbol for symbol in self.symbols if symbol in ROLL]
        if rolling and "p" not in self.equations:
            raise InputError(
                f"{where}: symbol '{rolling[0]}' found, expected an equation of roll"
                " 'p' beside it; give its terms, or leave roll out"
            )
        if "q" in self.equations and (
            "r" not in self.equations or "p" in self.equations
        ):
            raise InputError(
                f"{where}: equations {quoted(self.equations)} found, expected the"
                " memory 'q' of yaw beside an equation 'r' and without one of roll 'p'"
            )
        if {"p", "q"} & self.equations.keys() and self.quantity != "acceleration":
            raise InputError(
                f"{where}: forces found, expected accelerations in a table with roll"
                " 'p' or memory 'q'"
            )

    def _check_inertia(self, where: str) -> None:
        if self.quantity != "force":
            return
        if self.normalisation == "si":
            raise InputError(
                f"{where}: forces in 'si' found, expected the 'prime' or 'service'"
                " normalisation"
            )
        sway, yaw = (self.equations.get(equation) for equation in ("v", "r"))
        if (
            sway
            and yaw
            and [term.powers for term in sway] != [term.powers for term in yaw]
        ):
            raise InputError(
                f"{where}: 'v' and 'r' differ, expected the same terms in the same"
                " order, because inertia couples the two forces; make them the same,"
                " or write accelerations"
            )

    def names(self, equation: str) -> tuple[str, ...]:
        """Names of the coefficients of one equation: X, Y or N of forces, a to e of accelerations, first."""
        letters = (
            FORCE_OF_EQUATION if self.quantity == "force" else ACCELERATION_OF_EQUATION
        )
        return tuple(
            f"{letters[equation]}_{term.name}" for term in self.terms(equation)
        )

    @cached_property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names in the order of the equations: `X_u`, ..., `Y_v`, ..., `N_r`."""
        return tuple(
            name for equation in self.equations for name in self.names(equation)
        )

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Symbols that stand in its terms."""
        used = {
            symbol
            for terms in self.equations.values()
            for term in terms
            for symbol, _ in term.powers
        }
        return tuple(symbol for symbol in SYMBOLS if symbol in used)

    @cached_property
    def channels(self) -> frozenset[str]:
        """Channels that stand in its terms, the speed `U` included."""
        return frozenset(CHANNEL[symbol] for symbol in self.symbols)

    @cached_property
    def required_channels(self) -> tuple[str, ...]:
        """Channels a trial needs so that the model can be identified and its envelope be known."""
        needed = self.channels | ALWAYS_MEASURED | ({"p"} & self.equations.keys())
        return tuple(name for name in MEASURED if name in needed)

    @property
    def has_rudder(self) -> bool:
        """Whether the rudder stands in a term."""
        return "delta" in self.channels

    @property
    def rolls(self) -> bool:
        """Whether it has a rolling motion."""
        return "p" in self.equations

    @property
    def remembers(self) -> bool:
        """Whether it has a memory of yaw."""
        return "q" in self.equations

    @property
    def command_names(self) -> tuple[str, ...]:
        """Rudder, and shaft speed where it stands in a term."""
        return ("delta", "n") if "n" in self.required_channels else ("delta",)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state."""
        roll = ("p", "phi") if self.rolls else ()
        memory = ("q",) if self.remembers else ()
        return ("x", "y", "psi", "u", "v", "r", *roll, *memory, "delta")

    @property
    def regressed(self) -> tuple[str, ...]:
        """Equations that have a regression of their own; the memory's terms belong to that of yaw."""
        return tuple(equation for equation in self.equations if equation != "q")

    def regression_names(self, equation: str) -> tuple[str, ...]:
        """Names of the coefficients in the regression of one equation."""
        memory = self.names("q") if equation == "r" and "q" in self.equations else ()
        return self.names(equation) + memory

    @cached_property
    def regression_rows(self) -> dict[str, slice]:
        """Where the coefficients of each regression stand among all of them."""
        ends = np.cumsum(
            [0, *(len(self.regression_names(q)) for q in self.regressed)]
        ).tolist()
        return dict(zip(self.regressed, map(slice, ends[:-1], ends[1:]), strict=True))

    @property
    def astern(self) -> bool:
        """Whether the shaft may turn astern: a table is taken at its word."""
        return True

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """What is compiled of a ship with this table; the coefficients are read at run time."""
        accelerations = term_functions.accelerations_function(self._source)
        functions = (("accelerations", accelerations),)
        record = term_functions.coefficients_record(len(self._terms))
        return compiled_ship(
            "a ship with a table of terms", self.state_names, record, functions, lag
        )

    @cached_property
    def _source(self) -> str:
        """Written once, however many models share the table."""
        return term_functions.accelerations_source(self._sums)

    @property
    def _sums(self) -> dict[str, term_functions.Sum]:
        return {
            q: term_functions.Sum(
                terms, tuple(self.speed_power(q, t) for t in terms), self.unit_speeds(q)
            )
            for q, terms in self.equations.items()
        }

    @property
    def _terms(self) -> tuple[Term, ...]:
        """Those of all equations, one after the other."""
        return tuple(term for terms in self.equations.values() for term in terms)

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the coefficients: those of the terms."""
        return self.term_numbers(coefficients, particulars, shaft_speed)

    def term_numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients of the SI features of the accelerations, in order; shape (n_terms,)."""
        matrix = self.acceleration_matrix(particulars, shaft_speed)
        return np.asarray(matrix @ np.array(list(coefficients.values())))

    def terms(self, equation: str) -> tuple[Term, ...]:
        """Terms of one equation."""
        return self.equations[equation]

    def speed_power(self, equation: str, term: Term) -> int:
        """Power of U in the feature: in the prime system 2 (memory: 3) less one per velocity, else none."""
        if self.normalisation != "prime":
            return 0
        return self.unit_speeds(equation) - term.power(
            *SPEEDS, *TURN_RATES, *SHAFT_SPEEDS
        )

    @staticmethod
    def unit_speeds(equation: str) -> int:
        """Power of the speed in the unit of what an equation makes up."""
        return 3 if equation == "q" else 2

    def feature_scale(
        self, equation: str, term: Term, length: float, speed: float, shaft: float
    ) -> float:
        """Coefficient of the SI feature that makes a term an acceleration for a coefficient of 1.

        Length of the ship in m, service speed in m/s and shaft speed at service speed
        in 1/s.
        """
        if self.normalisation == "si":
            return 1.0
        lengths = (
            term.power(*TURN_RATES)
            + 1
            - self.unit_speeds(equation)
            - (equation in ANGULAR)
        )
        turns = term.power(*SHAFT_SPEEDS)
        if self.normalisation == "prime":
            return float(length ** float(lengths + turns))
        speeds = self.unit_speeds(equation) - term.power(*SPEEDS, *TURN_RATES)
        return float(
            length ** float(lengths)
            * speed ** float(speeds)
            / (shaft**turns if turns else 1.0)
        )

    def term_scales(self, particulars: Particulars, shaft_speed: float = 0.0) -> Floats:
        """`feature_scale` of all terms, one equation after the other, for a ship; shape (n_coefficients,)."""
        ship = particulars["length"], particulars["speed"], shaft_speed
        scaled = [
            self.feature_scale(q, term, *ship)
            for q, terms in self.equations.items()
            for term in terms
        ]
        return np.array(scaled)

    def features(
        self,
        equation: str,
        channels: Mapping[str, Any],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Terms of one equation on samples, in SI units: what the acceleration is a linear combination of.

        Channels, each of shape (n_samples,), are at least those of its terms and u, v,
        in SI units; the service speed is in the particulars, the shaft speed that at
        service speed, 1/s. Returns shape (n_samples, n_terms).
        """
        u, v = (np.asarray(channels[name], dtype=float) for name in ("u", "v"))
        offsets = {"du": particulars["speed"], "dn": shaft_speed}
        values = {"U": np.hypot(u, v)}
        for symbol in self.symbols:
            if symbol != "U":
                channel = np.asarray(channels[CHANNEL[symbol]], dtype=float)
                shifted = channel - offsets[symbol] if symbol in offsets else channel
                values[symbol] = np.abs(shifted) if symbol[0] == "|" else shifted
        columns = []
        for term in self.terms(equation):
            column = values["U"] ** float(self.speed_power(equation, term))
            for symbol, power in term.powers:
                column = column * values[symbol] ** float(power)
            columns.append(column)
        return np.stack(columns, axis=-1)

    def acceleration_matrix(
        self, particulars: Particulars, shaft_speed: float = 0.0
    ) -> Floats:
        """Square, invertible matrix from the coefficients to those of the SI features of the accelerations.

        Forces are divided by inertia: surge by m' - X_udot', sway and yaw, which must
        have the same terms, by their 2x2 inertia [[m' - Y_vdot', m'xG' - Y_rdot'],
        [m'xG' - N_vdot', Iz' - N_rdot']] (Chislett & Strom-Tejsen 1965), either alone
        by its own entry of that. Particulars of forces have mass, inertia and added
        mass (`Particulars.completed`). Raises InputError if the inertia is not
        positive, or the shaft speed at service speed, 1/s, is needed and not known.
        """
        if self.needs_shaft_speed and not shaft_speed > 0.0:
            raise InputError(
                f"service_shaft_speed: {shaft_speed:g} found, expected the shaft speed"
                f" at service speed in 1/s: the terms of structure '{self.name}' refer"
                " to it"
            )
        if self.quantity == "acceleration":
            return np.diag(self.term_scales(particulars, shaft_speed))
        return self.term_scales(particulars, shaft_speed)[:, None] * self._from_forces(
            inertia(particulars)
        )

    @property
    def needs_shaft_speed(self) -> bool:
        """Whether the terms refer to the shaft speed at service speed."""
        scaled = self.normalisation == "service" and "n" in self.command_names
        return scaled or "dn" in self.symbols

    def _from_forces(self, mass: Floats) -> Floats:
        """From the coefficients of forces to those of accelerations, by mass and added mass, shape (3, 3)."""
        axes = [list(FORCE_OF_EQUATION).index(equation) for equation in self.equations]
        mobility = np.linalg.inv(mass[np.ix_(axes, axes)])
        counts = [len(terms) for terms in self.equations.values()]
        # only equations of the same terms are coupled
        return np.block(
            [
                [mobility[i, j] * np.eye(n, m) for j, m in enumerate(counts)]
                for i, n in enumerate(counts)
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """The table as it stands in a model file."""
        table: dict[str, Any] = {"name": self.name, "source": self.source}
        if self.normalisation != "prime":
            table["normalisation"] = self.normalisation
        if self.quantity != "force":
            table["quantity"] = self.quantity
        table["equations"] = {
            equation: [
                {"name": term.name, "powers": dict(term.powers)} for term in terms
            ]
            for equation, terms in self.equations.items()
        }
        return table

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> "Structure":
        """The table from a model file (validated by `shipgym.ships.model_file`)."""
        equations = {
            equation: tuple(
                Term(term["name"], tuple(term["powers"].items())) for term in terms
            )
            for equation, terms in table["equations"].items()
        }
        given = {
            key: table[key] for key in ("normalisation", "quantity") if key in table
        }
        return cls(table["name"], table["source"], equations, **given)


def inertia(particulars: Particulars) -> Floats:
    """Mass, yaw inertia and added mass of surge, sway and yaw, prime system, shape (3, 3).

    Raises InputError if it is not positive.
    """
    added = np.zeros((3, 3))
    added[[0, 1, 1, 2, 2], [0, 1, 2, 1, 2]] = [
        particulars.require(name) for name in ADDED_MASSES
    ]
    return total_inertia(
        particulars,
        added,
        "The inertia of the ship is not positive: mass, xg, yaw_gyradius and added"
        " masses do not belong together. Added masses are in the prime system and"
        " negative (X_udot, Y_vdot, N_rdot).",
    )


def total_inertia(
    particulars: Particulars, derivatives: Floats, problem: str
) -> Floats:
    """Inertia of the ship herself less the derivatives of (X, Y, N) by (udot, vdot, rdot); all (3, 3), prime.

    Raises InputError with the `problem` if it is not positive.
    """
    m = particulars.mass_prime
    static = m * particulars.xg_prime
    rigid = np.array(
        [[m, 0.0, 0.0], [0.0, m, static], [0.0, static, particulars.inertia_prime]]
    )
    total: Floats = rigid - derivatives
    if total[0, 0] <= 0.0 or np.linalg.det(total[1:, 1:]) <= 0.0:
        raise InputError(problem)
    return total


def _check_terms(terms: tuple[Term, ...], normalisation: str, where: str) -> None:
    if not 1 <= len(terms) <= MOST_TERMS:
        raise InputError(
            f"{where}: {len(terms) or 'no'} terms found, expected 1 to {MOST_TERMS}"
        )
    for term in terms:
        term.check(where)
        if normalisation == "prime" and term.power("U"):
            raise InputError(
                f"{where}: term '{term.name}': 'U' found, which is 1 in the prime"
                " system; leave it out, or choose the 'service' or 'si' normalisation"
            )
    names = [term.name for term in terms]
    products = [term.product for term in terms]
    for i, (name, product) in enumerate(zip(names, products, strict=True)):
        if name in names[:i] or product in products[:i]:
            raise InputError(f"{where}: a term appears twice in one equation: '{name}'")
