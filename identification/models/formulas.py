"""Linear hydrodynamic derivatives from main dimensions.

For ships of which nothing was measured.

Sources: Clarke, Gedling & Hine 1983, The application of manoeuvring criteria in hull
design using linear theory, Transactions of RINA 125 (hull and rudder); Kijima, Katsuno,
Nakiri & Furukawa 1990, On the manoeuvring performance of a ship with the parameter of
loading condition, J. Soc. Naval Architects of Japan 168 (hull). Both about midship,
even keel, prime system by rho L^2 U^2 / 2 and rho L^3 U^2 / 2.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from shipgym import InputError, Particulars
from shipgym.arrays import Flags, Floats
from shipgym.ships.particulars import prime_inertia
from shipgym.ships.term_table import Structure
from shipgym.ships.terms import Term

#: Powers of speed U and length L in a linear acceleration of sway, rate * U^i L^j:
#: those of a term in v (by v/U), r (by r L/U) and delta. Yaw has one length less.
LINEAR_POWERS = {"v": (1, -1), "r": (1, 0), "delta": (2, -1)}


class MainDimensions(NamedTuple):
    """Main dimensions of a hull, by the symbols of the formulas."""

    L: float  # length between perpendiculars, m
    B: float  # beam, m
    T: float  # draught, m
    C_b: float  # block coefficient


class FormulaCoefficients(NamedTuple):
    """Coefficients of one equation, as far as formulas give them."""

    values: Floats  # SI units, 0 where they give none, shape (n_terms,)
    known: Flags  # those that they give, shape (n_terms,)


def main_dimensions(ship: Particulars) -> MainDimensions:
    """Main dimensions of a ship; InputError where one of them is not known."""
    return MainDimensions(
        L=ship.length,
        B=ship.require("beam"),
        T=ship.require("draught"),
        C_b=ship.require("block_coefficient"),
    )


def clarke_derivatives(particulars: Particulars) -> dict[str, float]:
    """Sway force and yaw moment by sway speed, yaw rate and rudder, Clarke et al. 1983.

    From beam, draught, block coefficient and rudder area: Y_v, Y_r, Y_delta, N_v, N_r,
    N_delta of the hydrodynamic forces alone, without the ship's own inertia; rudder
    positive to starboard.
    """
    L, B, T, C_b = main_dimensions(particulars)
    B_T = B / T
    B_L = B / L
    T_L = T / L
    scale = -math.pi * T_L**2
    hull = {
        "Y_v": scale * (1.0 + 0.40 * C_b * B_T),
        "Y_r": scale * (-0.5 + 2.2 * B_L - 0.080 * B_T),
        "N_v": scale * (0.5 + 2.4 * T_L),
        "N_r": scale * (0.25 + 0.039 * B_T - 0.56 * B_L),
    }
    return hull | _rudder_derivatives(particulars)


def kijima_derivatives(particulars: Particulars) -> dict[str, float]:
    """Sway force and yaw moment by sway speed and yaw rate, Kijima et al. 1990.

    The rudder by Clarke. Arguments and result as in `clarke_derivatives`. Kijima's beta
    is -v/U, and his Y_r comes less the mass and added mass in surge, which is added
    here.
    """
    L, B, T, C_b = main_dimensions(particulars)
    B_L = B / L
    T_L = T / L  # from rho L T U^2 / 2 to rho L^2 U^2 / 2
    k = 2.0 * T_L
    m = particulars.mass_prime
    X_udot = particulars.require("X_udot")
    hull = {
        "Y_v": -T_L * (0.5 * math.pi * k + 1.4 * C_b * B_L),
        "Y_r": -T_L * 1.5 * C_b * B_L + m - X_udot,
        "N_v": -T_L * k,
        "N_r": T_L * (k**2 - 0.54 * k),
    }
    return hull | _rudder_derivatives(particulars)


def _rudder_derivatives(p: Particulars) -> dict[str, float]:
    """Clarke et al. 1983: Y_delta of 3 A / L^2 half a length aft.

    A rudder to starboard moves the stern to port.
    """
    Y_delta = -3.0 * p.require("rudder_area") / p.length**2
    return {"Y_delta": Y_delta, "N_delta": -0.5 * Y_delta}


FORMULAS: dict[str, Callable[[Particulars], dict[str, float]]] = {
    "clarke": clarke_derivatives,
    "kijima": kijima_derivatives,
}


def formula_coefficients(
    formula: str, structure: Structure, particulars: Particulars
) -> dict[str, FormulaCoefficients]:
    """Coefficients of the SI features of a structure by equation, from formulas.

    `formula`: which, one of `clarke`, `kijima`; `structure`: with sway and yaw, and
    terms in v, r and delta alone, or times powers of the speed; `particulars`: mass and
    added mass are estimated where absent. Raises InputError for a structure that the
    formulas do not cover, and for particulars that do not suffice.
    """
    ship = particulars.completed()
    _check_covered(formula, structure)
    derivatives = FORMULAS[formula](ship)
    accelerations = _linear_accelerations(derivatives, ship)

    coefficients = {}
    for q in structure.equations:
        by_symbol = accelerations.get(q, {})
        coefficients[q] = _equation_coefficients(structure, q, by_symbol, ship)
    return coefficients


def _equation_coefficients(
    structure: Structure,
    q: str,
    accelerations: dict[str, float],
    ship: Particulars,
) -> FormulaCoefficients:
    """Coefficients of an equation from its accelerations by v, r and delta."""
    terms = structure.equations[q]
    values = np.zeros(len(terms))
    known = np.zeros(len(terms), dtype=bool)
    for i, term in enumerate(terms):
        symbol = _linear_symbol(term)
        if symbol is None or symbol not in accelerations:
            continue
        scale = _feature_scale(structure, q, term, symbol, ship)
        values[i] = accelerations[symbol] * scale
        known[i] = True
    return FormulaCoefficients(values, known)


def _check_covered(formula: str, structure: Structure) -> None:
    """Refuse a structure whose equations of sway and yaw lack a linear term."""
    covered = True
    for q in "vr":
        symbols = {_linear_symbol(term) for term in structure.equations.get(q, ())}
        covered = covered and symbols.issuperset(LINEAR_POWERS)
    if covered:
        return
    raise InputError(
        f"prior: expected a structure with the terms v, r and delta in sway and yaw,"
        f" for which formula {formula!r} gives coefficients, got"
        f" {structure.name!r}; choose 'abkowitz' or 'steering7', or a reference ship"
        " as prior"
    )


def _linear_accelerations(
    derivatives: dict[str, float], ship: Particulars
) -> dict[str, dict[str, float]]:
    """Sway and yaw acceleration by v, r and delta, prime system."""
    m = ship.mass_prime
    x_G = ship.xg_prime
    sway_and_yaw = slice(1, 3)
    mass = prime_inertia(ship)[sway_and_yaw, sway_and_yaw]

    accelerations: dict[str, dict[str, float]] = {"v": {}, "r": {}}
    for symbol in LINEAR_POWERS:
        force = derivatives[f"Y_{symbol}"]
        moment = derivatives[f"N_{symbol}"]
        if symbol == "r":  # the axes turn with the body
            force -= m
            moment -= m * x_G
        sway, yaw = np.linalg.solve(mass, [force, moment])
        accelerations["v"][symbol] = float(sway)
        accelerations["r"][symbol] = float(yaw)
    return accelerations


def _feature_scale(
    structure: Structure, q: str, term: Term, symbol: str, ship: Particulars
) -> float:
    """Factor from the prime system to a coefficient of the SI feature of a linear term.

    Whatever power of the speed the feature lacks is that of the service speed.
    """
    speeds, lengths = LINEAR_POWERS[symbol]
    if q == "r":
        lengths -= 1

    speeds_in_feature = structure.speed_power(q, term)
    for factor, power in term.powers:
        if factor in ("U", "u"):
            speeds_in_feature += power

    missing = float(speeds - speeds_in_feature)
    speed = ship.require("speed")
    by_speed = speed**missing
    by_length = ship.length ** float(lengths)
    return float(by_speed * by_length)


def _linear_symbol(term: Term) -> str | None:
    """The one of v, r and delta that a term is, times powers of the surge speed.

    None for other terms.
    """
    others = []
    for symbol, power in term.powers:
        if symbol not in ("u", "U"):
            others.append((symbol, power))
    if len(others) != 1:
        return None
    symbol, power = others[0]
    return symbol if symbol in LINEAR_POWERS and power == 1 else None
