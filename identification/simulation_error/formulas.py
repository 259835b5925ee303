"""Linear hydrodynamic derivatives from main dimensions, for ships of which nothing was measured.

Sources: Clarke, Gedling & Hine 1983, The application of manoeuvring criteria in hull
design using linear theory, Transactions of RINA 125 (hull and rudder); Kijima, Katsuno,
Nakiri & Furukawa 1990, On the manoeuvring performance of a ship with the parameter of
loading condition, J. Soc. Naval Architects of Japan 168 (hull). Both about midship,
even keel, prime system by rho L^2 U^2 / 2 and rho L^3 U^2 / 2.
"""

import math
from collections.abc import Callable

import numpy as np

from shipgym import InputError, Particulars
from shipgym.arrays import Flags, Floats
from shipgym.ships.prime_inertia import prime_inertia
from shipgym.ships.term_table import Structure
from shipgym.ships.terms import Term

LINEAR_SYMBOLS = ("v", "r", "delta")


def clarke_derivatives(particulars: Particulars) -> dict[str, float]:
    """Sway force and yaw moment by sway speed, yaw rate and rudder, Clarke et al. 1983.

    From beam, draught, block coefficient and rudder area: Y_v, Y_r, Y_delta, N_v, N_r,
    N_delta of the hydrodynamic forces alone, without the ship's own inertia; rudder
    positive to starboard.
    """
    L, B, T, full = main_dimensions(particulars)
    slender, flat, shallow = B / L, B / T, T / L
    scale = -math.pi * shallow**2
    return {
        "Y_v": scale * (1.0 + 0.40 * full * flat),
        "Y_r": scale * (-0.5 + 2.2 * slender - 0.080 * flat),
        "N_v": scale * (0.5 + 2.4 * shallow),
        "N_r": scale * (0.25 + 0.039 * flat - 0.56 * slender),
        **_rudder(particulars),
    }


def kijima_derivatives(particulars: Particulars) -> dict[str, float]:
    """Sway force and yaw moment by sway speed and yaw rate, Kijima et al. 1990; the rudder by Clarke.

    Arguments and result as in `clarke_derivatives`. Kijima's beta is -v/U, and his Y_r
    comes less the mass and added mass in surge, which is added here.
    """
    p = particulars
    L, B, T, full = main_dimensions(p)
    slender, by_length = (
        B / L,
        T / L,
    )  # the latter from rho L T U^2 / 2 to rho L^2 U^2 / 2
    k = 2.0 * by_length
    return {
        "Y_v": -by_length * (0.5 * math.pi * k + 1.4 * full * slender),
        "Y_r": -by_length * 1.5 * full * slender + p.mass_prime - p.require("X_udot"),
        "N_v": -by_length * k,
        "N_r": by_length * (k**2 - 0.54 * k),
        **_rudder(p),
    }


def main_dimensions(ship: Particulars) -> tuple[float, float, float, float]:
    """Length, beam and draught, m, and block coefficient."""
    return (
        ship.length,
        ship.require("beam"),
        ship.require("draught"),
        ship.require("block_coefficient"),
    )


def _rudder(p: Particulars) -> dict[str, float]:
    """Clarke et al. 1983: Y_delta of 3 A / L^2 half a length aft; starboard moves the stern to port."""
    Y = -3.0 * p.require("rudder_area") / p.length**2
    return {"Y_delta": Y, "N_delta": -0.5 * Y}


FORMULAS: dict[str, Callable[[Particulars], dict[str, float]]] = {
    "clarke": clarke_derivatives,
    "kijima": kijima_derivatives,
}


def formula_coefficients(
    formula: str, structure: Structure, particulars: Particulars
) -> dict[str, tuple[Floats, Flags]]:
    """Coefficients of the SI features of a structure, as far as formulas give them.

    `formula`: which, one of `clarke`, `kijima`; `structure`: with sway and yaw, and
    terms in v, r and delta alone, or times powers of the speed; `particulars`: mass and
    added mass are estimated where absent. Returns for each equation the coefficients,
    and which of them the formulas give; the others are zero, shape (n_terms,). Raises
    InputError for a structure that the formulas do not cover, and for particulars that
    do not suffice.
    """
    ship = particulars.completed()
    found = {
        q: [_linear_symbol(term) for term in terms]
        for q, terms in structure.equations.items()
    }
    if not all(set(LINEAR_SYMBOLS) <= set(found.get(q, ())) for q in "vr"):
        raise InputError(
            f"prior: {formula!r} found with structure {structure.name!r}, for which the"
            " formulas give no coefficients: they are those of the terms v, r and"
            " delta in sway and yaw; choose another structure, such as 'abkowitz' or"
            " 'steering7', or a reference ship as prior"
        )
    rates = dict(
        zip(
            LINEAR_SYMBOLS, _accelerations(FORMULAS[formula](ship), ship).T, strict=True
        )
    )
    speed, length = ship.require("speed"), ship.length
    coefficients = {}
    for q, terms in structure.equations.items():
        values, known = np.zeros(len(terms)), np.zeros(len(terms), dtype=bool)
        for i, (term, symbol) in enumerate(zip(terms, found[q], strict=True)):
            if q == "u" or symbol is None:
                continue
            # acceleration = rate * (v/U, r L/U or delta) * U^2/L, yaw by another L;
            # whatever power of U the feature lacks is that of service speed
            speeds = {"v": 1, "r": 1, "delta": 2}[symbol]
            lengths = {"v": -1, "r": 0, "delta": -1}[symbol] - (1 if q == "r" else 0)
            carried = structure.speed_power(q, term) + sum(
                p for s, p in term.powers if s in ("U", "u")
            )
            rate = rates[symbol][0 if q == "v" else 1]
            values[i] = (
                rate * speed ** float(speeds - carried) * length ** float(lengths)
            )
            known[i] = True
        coefficients[q] = (values, known)
    return coefficients


def _accelerations(derivatives: dict[str, float], ship: Particulars) -> Floats:
    """Sway and yaw acceleration by v, r and delta, prime system, shape (2, 3)."""
    forces = np.array(
        [[derivatives[f"{force}_{s}"] for s in LINEAR_SYMBOLS] for force in "YN"]
    )
    forces[:, 1] -= [
        ship.mass_prime,
        ship.mass_prime * ship.xg_prime,
    ]  # turning with the body's axes
    return np.linalg.solve(prime_inertia(ship)[1:, 1:], forces)


def _linear_symbol(term: Term) -> str | None:
    """The one of v, r and delta that a term is, times powers of the surge speed; None for other terms."""
    others = [
        (symbol, power) for symbol, power in term.powers if symbol not in ("u", "U")
    ]
    return next((symbol for symbol in LINEAR_SYMBOLS if others == [(symbol, 1)]), None)
