"""The accelerations of an identified structure as a source file for the compiler."""

from __future__ import annotations

import re
from collections import Counter

from shipgym.ships.structures import EQUATION_NAMES, Structure, Term
from shipgym.ships.terms import CHANNEL, SHAFT_SPEEDS, SPEEDS, TURN_RATES

HEADER = '''"""Accelerations of the structure `{name}`, written from its table of terms."""

{library}from .compiling import inlined
from .layout import {rows}

ROLL = {roll}
SHAFT = False
MEMORY = {memory}


@inlined
def shaft_acceleration(n, command, ship, lane):
    return 0.0


@inlined
def accelerations(u, v, r, p, phi, delta, n, depth, ship, lane):
'''

Powers = dict[str, int]
Monomial = tuple[str, Powers]
VELOCITIES = (*SPEEDS, *TURN_RATES, *SHAFT_SPEEDS)

#: Where a structure has no equation: the speed stays, and what drift or turn there is dies out within about
#: a ship length.
WITHOUT = {
    "u": "    udot = 0.0\n",
    "v": "    vdot = -v * (ship[SERVICE_SPEED + lane] / ship[LENGTH + lane])\n",
    "r": "    rdot = -r * (ship[SERVICE_SPEED + lane] / ship[LENGTH + lane])\n",
}
MEMORY = "p"  # row of the kernels that keeps the memory of yaw, free in a ship without roll


def accelerations_source(structure: Structure) -> str:
    """Source of `accelerations.py` for a structure: a factored sum of its terms for each equation."""
    scaled = _is_scaled(structure)
    sums = []
    row = 0
    for equation in EQUATION_NAMES:
        if equation not in structure.equations:
            sums.append(WITHOUT.get(equation, ""))
            continue
        monomials = []
        for term in structure.terms(equation):
            factors = _factors(term, None if scaled else structure.speed_power(equation, term))
            monomials.append((f"ship[COEFFICIENTS + {row} * LANES + lane]", factors))
            row += 1
        unit = "U * " * structure.unit_speeds(equation) if scaled else ""
        sums.append(f"    {equation}dot = {unit}({factored(monomials)})\n")
    fourth = "pdot" if "p" in structure.equations else "qdot" if "q" in structure.equations else "0.0"
    yaw = f"rdot + {MEMORY}" if "q" in structure.equations else "rdot"
    body = "".join(sums) + f"    return udot, vdot, {yaw}, {fourth}\n"
    return _header(structure, body) + body


def factored(monomials: list[Monomial]) -> str:
    """A sum of products with what they share taken out, symbol by symbol (Horner's scheme).

    Half as many operations as a sum of products, and short chains of them: three times as fast.

    Parameters
    ----------
    monomials : list of tuple of str and dict of str to int
        Coefficient, and powers of the variables, of each term.

    Returns
    -------
    str
        Of Python source.
    """
    shared = Counter(variable for _, powers in monomials for variable in powers)
    variable, count = shared.most_common(1)[0] if shared else ("", 0)
    if count < 2:
        return " + ".join(_product(*monomial) for monomial in monomials)
    inside = [(name, _without(powers, variable)) for name, powers in monomials if variable in powers]
    outside = [(name, powers) for name, powers in monomials if variable not in powers]
    product = f"{variable} * ({factored(inside)})"
    return f"{product} + ({factored(outside)})" if outside else product


def _product(coefficient: str, powers: Powers) -> str:
    return " * ".join([coefficient, *(name for name, power in powers.items() for _ in range(power))])


def _without(powers: Powers, variable: str) -> Powers:
    """Powers after one factor is taken out."""
    left = {name: power - (name == variable) for name, power in powers.items()}
    return {name: power for name, power in left.items() if power}


def _is_scaled(structure: Structure) -> bool:
    """Whether velocities are divided by U first: where the prime system asks for that in some term."""
    return any(structure.speed_power(q, term) < 0 for q in structure.equations for term in structure.terms(q))


def _factors(term: Term, speed_power: int | None) -> Powers:
    """Powers of the variables of a term, with U as often as it takes, or all velocities divided by U."""
    powers = dict(term.powers)
    if speed_power is None:
        return {
            f"{symbol_variable(q)}_" if q in VELOCITIES else symbol_variable(q): k for q, k in powers.items()
        }
    speed_power += powers.pop("U", 0)
    factors = {symbol_variable(symbol): power for symbol, power in powers.items()}
    if speed_power:
        factors["U" if speed_power > 0 else "per_U"] = abs(speed_power)
    return factors


def symbol_variable(symbol: str) -> str:
    """Name of a symbol in the source."""
    return f"abs_{CHANNEL[symbol]}" if symbol[0] == "|" else symbol


def _header(structure: Structure, body: str) -> str:
    """Everything above the products: imports of what they use, and the symbols that are no arguments."""
    words = set(re.findall(r"\w+", body))
    divided = [f"{symbol_variable(q)}_" for q in structure.symbols if f"{symbol_variable(q)}_" in words]
    words |= {name[:-1] for name in divided} | ({"per_U"} if divided else set())
    absolute = [symbol for symbol in structure.symbols if symbol[0] == "|"]
    functions = ["fabs"] * bool(absolute) + ["sqrt"] * bool(words & {"U", "per_U"})
    rows = ["COEFFICIENTS", "LANES"]
    rows += ["LENGTH"] * ("LENGTH" in words) + ["SERVICE_SHAFT"] * ("dn" in words)
    rows += ["SERVICE_SPEED"] * bool(words & {"du", "SERVICE_SPEED"})
    library = f"from math import {', '.join(functions)}\n\n" if functions else ""
    lines = {
        "    U = sqrt(u * u + v * v)\n": words & {"U", "per_U"},
        "    per_U = 1.0 / U\n": "per_U" in words,
        "    du = u - ship[SERVICE_SPEED + lane]\n": "du" in words,
        "    dn = n - ship[SERVICE_SHAFT + lane]\n": "dn" in words,
    } | {f"    {symbol_variable(symbol)} = fabs({CHANNEL[symbol]})\n": True for symbol in absolute}
    lines |= {f"    {name} = {name[:-1]} * per_U\n": True for name in divided}
    header = HEADER.format(
        name=structure.name, library=library, rows=", ".join(rows), roll="p" in structure.equations,
        memory="q" in structure.equations,
    )  # fmt: skip
    return header + "".join(line for line, used in lines.items() if used)
