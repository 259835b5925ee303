"""Structure: a table of terms for each equation, linear in the coefficients.

The same table serves identification (stacked over samples), simulation (compiled, one
state at a time) and the model file.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_table, check_text, quoted
from shipgym.engine.compiled_ship import CompiledShip, compiled_ship
from shipgym.errors import InputError
from shipgym.ships import term_functions
from shipgym.ships.particulars import Particulars, prime_inertia
from shipgym.ships.terms import (
    CHANNEL,
    MOST_TERMS,
    ROLL,
    SHAFT_SPEEDS,
    SPEEDS,
    SYMBOLS,
    TURN_RATES,
    Term,
    read_term_list,
    symbols_in,
)

#: Equations in their order, with the first letter of the names of accelerations'
#: coefficients: as Zhu 2018 has them for surge, sway and yaw; roll, and the memory of
#: yaw, go on from there.
ACCELERATION_OF_EQUATION = {"u": "a", "v": "b", "r": "c", "p": "d", "q": "e"}
EQUATION_NAMES = tuple(ACCELERATION_OF_EQUATION)
FORCE_OF_EQUATION = {"u": "X", "v": "Y", "r": "N"}
ANGULAR = ("r", "p", "q")  # of these the unit holds 1 / length once more
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
    # whether it is identified from the forces of captive tests
    captive: ClassVar[bool] = False
    shallow_water: ClassVar[bool] = False  # whether it knows the depth of the water

    def __post_init__(self) -> None:
        _check_structure(self)

    # ---- contents of the table -------------------------------------------------------

    def names(self, equation: str) -> tuple[str, ...]:
        """Names of an equation's coefficients, such as X_u (force) or a_u."""
        if self.quantity == "force":
            letter = FORCE_OF_EQUATION[equation]
        else:
            letter = ACCELERATION_OF_EQUATION[equation]
        return tuple(f"{letter}_{term.name}" for term in self.equations[equation])

    @cached_property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names in the order of the equations: `X_u`, ..., `Y_v`, ..., `N_r`."""
        names: tuple[str, ...] = ()
        for equation in self.equations:
            names += self.names(equation)
        return names

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Symbols that occur in its terms."""
        used = symbols_in(self.equations.values())
        return tuple(symbol for symbol in SYMBOLS if symbol in used)

    @cached_property
    def channels(self) -> frozenset[str]:
        """Channels that occur in its terms, the speed `U` included."""
        return frozenset(CHANNEL[symbol] for symbol in self.symbols)

    @cached_property
    def required_channels(self) -> tuple[str, ...]:
        """Channels a trial needs to identify the model and its envelope."""
        needed = self.channels | ALWAYS_MEASURED | ({"p"} & self.equations.keys())
        return tuple(name for name in MEASURED if name in needed)

    @property
    def has_rudder(self) -> bool:
        """True where the rudder occurs in a term."""
        return "delta" in self.channels

    @property
    def rolls(self) -> bool:
        """True where it has a rolling motion."""
        return "p" in self.equations

    @property
    def remembers(self) -> bool:
        """True where it has a memory of yaw."""
        return "q" in self.equations

    @property
    def command_names(self) -> tuple[str, ...]:
        """Rudder, and shaft speed where it occurs in a term."""
        return ("delta", "n") if "n" in self.required_channels else ("delta",)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the state."""
        roll = ("p", "phi") if self.rolls else ()
        memory = ("q",) if self.remembers else ()
        return ("x", "y", "psi", "u", "v", "r", *roll, *memory, "delta")

    @property
    def astern(self) -> bool:
        """True where the shaft may turn astern: a table is taken at its word."""
        return True

    @property
    def needs_shaft_speed(self) -> bool:
        """True where the terms refer to the shaft speed at service speed."""
        if self.normalisation == "service":
            return "n" in self.command_names
        return "dn" in self.symbols

    # ---- identification: linear regressions ------------------------------------------

    @property
    def regressed(self) -> tuple[str, ...]:
        """Equations with a regression of their own; the memory belongs to yaw."""
        return tuple(equation for equation in self.equations if equation != "q")

    def regression_names(self, equation: str) -> tuple[str, ...]:
        """Names of the coefficients in the regression of one equation."""
        names = self.names(equation)
        if equation == "r" and "q" in self.equations:
            names += self.names("q")
        return names

    @cached_property
    def regression_rows(self) -> dict[str, slice]:
        """Slice of all coefficients that each regression has."""
        rows = {}
        first = 0
        for equation in self.regressed:
            last = first + len(self.regression_names(equation))
            rows[equation] = slice(first, last)
            first = last
        return rows

    def features(
        self,
        equation: str,
        channels: Mapping[str, Any],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Terms of one equation on samples, SI; the acceleration is linear in them.

        Channels, each of shape (n_samples,), are at least those of its terms and u, v,
        in SI units; the service speed is in the particulars, the shaft speed that at
        service speed, 1/s. Returns shape (n_samples, n_terms).
        """
        values = self._symbol_values(channels, particulars, shaft_speed)
        columns = []
        for term in self.equations[equation]:
            speed_power = self.speed_power(equation, term)
            column = values["U"] ** float(speed_power)
            for symbol, power in term.powers:
                column = column * values[symbol] ** float(power)
            columns.append(column)
        return np.stack(columns, axis=-1)

    def _symbol_values(
        self,
        channels: Mapping[str, Any],
        particulars: Particulars,
        shaft_speed: float,
    ) -> dict[str, Floats]:
        """Values of the speed `U` and of the terms' symbols at samples."""
        values = {"U": np.hypot(channels["u"], channels["v"])}
        offsets = {"du": particulars["speed"], "dn": shaft_speed}
        for symbol in self.symbols:
            if symbol == "U":
                continue
            channel = channels[CHANNEL[symbol]]
            value = channel - offsets.get(symbol, 0.0)
            if symbol.startswith("|"):
                value = np.abs(value)
            values[symbol] = value
        return values

    def speed_power(self, equation: str, term: Term) -> int:
        """Power of U in the feature, prime: 2 (memory: 3), less one a velocity."""
        if self.normalisation != "prime":
            return 0
        return term_functions.speed_power(equation, term)

    # ---- from coefficients to accelerations ------------------------------------------

    def feature_scale(
        self, equation: str, term: Term, length: float, speed: float, shaft: float
    ) -> float:
        """Coefficient of the SI feature for a coefficient of 1 in the structure.

        Length of the ship in m, service speed in m/s and shaft speed at service speed
        in 1/s. The unit of linear accelerations is U^2 / L, that of angular ones U^2 /
        L^2, both by U / L once more for the memory; that of turn rates is U / L.
        """
        if self.normalisation == "si":
            return 1.0
        unit = term_functions.unit_speeds(equation)
        turn_rates = term.power(*TURN_RATES)
        shaft_speeds = term.power(*SHAFT_SPEEDS)
        lengths = 1 - unit + turn_rates
        if equation in ANGULAR:
            lengths -= 1
        if self.normalisation == "prime":
            lengths += shaft_speeds
            return float(length ** float(lengths))

        speeds = unit - turn_rates - term.power(*SPEEDS)
        scale = length ** float(lengths)
        scale *= speed ** float(speeds)
        if shaft_speeds:
            scale /= shaft**shaft_speeds
        return float(scale)

    def term_scales(self, particulars: Particulars, shaft_speed: float = 0.0) -> Floats:
        """`feature_scale` of all terms, by equation; shape (n_coefficients,)."""
        scales = [
            self.feature_scale(
                equation,
                term,
                length=particulars["length"],
                speed=particulars["speed"],
                shaft=shaft_speed,
            )
            for equation, terms in self.equations.items()
            for term in terms
        ]
        return np.array(scales)

    def acceleration_matrix(
        self, particulars: Particulars, shaft_speed: float = 0.0
    ) -> Floats:
        """Matrix from coefficients to those of the SI features of the accelerations.

        Forces are divided by inertia: surge by m' - X_udot', sway and yaw, which must
        have the same terms, by their 2x2 inertia [[m' - Y_vdot', m'xG' - Y_rdot'],
        [m'xG' - N_vdot', Iz' - N_rdot']] (Chislett & Strom-Tejsen 1965), either alone
        by its own entry of that. Particulars of forces have mass, inertia and added
        mass (`Particulars.completed`). Raises InputError if the inertia is not
        positive, or the shaft speed at service speed, 1/s, is needed and not known.
        """
        if self.needs_shaft_speed and not shaft_speed > 0.0:
            raise InputError(
                "service_shaft_speed: expected the shaft speed at service speed in 1/s,"
                f" which the terms of structure '{self.name}' refer to, got"
                f" {shaft_speed:g}"
            )
        scales = self.term_scales(particulars, shaft_speed)
        if self.quantity == "acceleration":
            return np.diag(scales)
        return scales[:, None] * self._from_forces(prime_inertia(particulars))

    def prime_inertia(
        self, coefficients: Mapping[str, float], particulars: Particulars
    ) -> Floats:
        """Mass and added mass by the particulars, prime system, shape (3, 3)."""
        return prime_inertia(particulars)

    def _from_forces(self, inertia: Floats) -> Floats:
        """Matrix from force coefficients to accelerations, by an inertia (3, 3)."""
        order = list(FORCE_OF_EQUATION)
        axes = [order.index(equation) for equation in self.equations]
        own_inertia = inertia[np.ix_(axes, axes)]
        mobility = np.linalg.inv(own_inertia)

        # only equations of the same terms are coupled
        counts = [len(terms) for terms in self.equations.values()]
        blocks = []
        for row, n_rows in zip(mobility, counts, strict=True):
            pairs = zip(row, counts, strict=True)
            blocks.append([entry * np.eye(n_rows, n) for entry, n in pairs])
        return np.block(blocks)

    def term_numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Coefficients of the SI features of the accelerations; shape (n_terms,)."""
        matrix = self.acceleration_matrix(particulars, shaft_speed)
        return np.asarray(matrix @ np.array(list(coefficients.values())))

    # ---- simulation: the function that is compiled -----------------------------------

    def compiled(self, coefficients: Mapping[str, float], lag: bool) -> CompiledShip:
        """Make the functions to be compiled; coefficients are read at run time."""
        accelerations = term_functions.accelerations_function(self._source)
        return compiled_ship(
            "a ship with a table of terms",
            self.state_names,
            term_functions.coefficients_record(self._n_terms),
            (("accelerations", accelerations),),
            lag,
        )

    @cached_property
    def _source(self) -> tuple[str, ...]:
        """Written once, however many models share the table."""
        prime = self.normalisation == "prime"
        return term_functions.accelerations_source(self.equations, prime)

    @property
    def _n_terms(self) -> int:
        return sum(len(terms) for terms in self.equations.values())

    def numbers(
        self,
        coefficients: Mapping[str, float],
        particulars: Particulars,
        shaft_speed: float = 0.0,
    ) -> Floats:
        """Numbers of the compiled function's coefficients: those of the terms."""
        return self.term_numbers(coefficients, particulars, shaft_speed)

    # ---- model file ------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Table as written in a model file."""
        table: dict[str, Any] = {
            "name": self.name,
            "source": self.source,
        }
        if self.normalisation != "prime":
            table["normalisation"] = self.normalisation
        if self.quantity != "force":
            table["quantity"] = self.quantity
        table["equations"] = {
            equation: [term.to_dict() for term in terms]
            for equation, terms in self.equations.items()
        }
        return table

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], where: str = "structure") -> Self:
        """Read what `to_dict` wrote; errors begin with `where`."""
        return cls(**structure_fields(table, where))


def structure_fields(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Fields of a `Structure` from a model file."""
    place = f"{where}.equations"
    given = table.get("equations")
    lists = check_table(given, place, EQUATION_NAMES)
    fields = {
        "name": table.get("name"),
        "source": table.get("source"),
        "equations": {
            equation: read_term_list(terms, f"{place}.{equation}")
            for equation, terms in lists.items()
        },
    }
    for key in ("normalisation", "quantity"):
        if key in table:
            fields[key] = table[key]
    return fields


# ---- what a table can compute ------------------------------


def _check_structure(table: Structure) -> None:
    """Refuse names, units, equations or terms that cannot be computed."""
    equations = table.equations
    where = f"structure '{table.name}'"
    check_text(table.name, "structure: name")
    check_text(table.source, f"{where}: source")
    normalisations = (
        "prime",
        "service",
        "si",
    )
    check_choice(table.normalisation, normalisations, f"{where}: normalisation")
    quantities = ("force", "acceleration")
    check_choice(table.quantity, quantities, f"{where}: quantity")
    known = [equation for equation in EQUATION_NAMES if equation in equations]
    if not known or list(equations) != known:
        raise InputError(
            f"{where}: expected equations, some of {quoted(EQUATION_NAMES)} in this"
            f" order, got {quoted(equations)}"
        )
    for equation, terms in equations.items():
        _check_terms(terms, table.normalisation, f"{where}: equations.{equation}")
    has_roll = not symbols_in(equations.values()).isdisjoint(ROLL)
    if has_roll and "p" not in equations:
        raise InputError(
            f"{where}: expected an equation of roll 'p' where terms have roll, got"
            " none; give its terms, or leave roll out"
        )
    if "q" in equations and ("r" not in equations or "p" in equations):
        raise InputError(
            f"{where}: expected the memory 'q' of yaw with an equation 'r' and without"
            f" one of roll 'p', got equations {quoted(equations)}"
        )
    if table.quantity == "force":
        _check_forces(table, where)


def _check_terms(terms: tuple[Term, ...], normalisation: str, where: str) -> None:
    if not 1 <= len(terms) <= MOST_TERMS:
        raise InputError(
            f"{where}: expected 1 to {MOST_TERMS} terms, got {len(terms) or 'none'}"
        )
    seen = set()
    for term in terms:
        term.check(where)
        if normalisation == "prime" and term.power("U"):
            raise InputError(
                f"{where}: term '{term.name}': expected no 'U', which is 1 in the prime"
                " system; leave it out, or choose the 'service' or 'si'"
                " normalisation"
            )
        if term.name in seen or term.product in seen:
            raise InputError(
                f"{where}: expected each term once, got '{term.name}' twice"
            )
        seen |= {term.name, term.product}


def _check_forces(table: Structure, where: str) -> None:
    equations = table.equations
    if "p" in equations or "q" in equations:
        raise InputError(
            f"{where}: expected accelerations in a table with roll 'p' or memory 'q',"
            " got forces"
        )
    if table.normalisation == "si":
        raise InputError(
            f"{where}: expected forces in the 'prime' or 'service' normalisation, got"
            " 'si'"
        )
    if "v" not in equations or "r" not in equations:
        return
    sway = [term.powers for term in equations["v"]]
    yaw = [term.powers for term in equations["r"]]
    if sway != yaw:
        raise InputError(
            f"{where}: expected the same terms in the same order in 'v' and 'r',"
            " because inertia couples the two forces, got others; make them the same,"
            " or write accelerations"
        )
