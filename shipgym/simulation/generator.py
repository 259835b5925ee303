"""The accelerations of an identified structure as a source file for the compiler."""

from __future__ import annotations

import re

from shipgym.models.structures import EQUATION_NAMES, Structure, Term
from shipgym.models.terms import CHANNEL

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

PARTIAL_SUM = 4

#: Where a structure has no equation: the speed stays, and what drift or turn there is dies out within about
#: a ship length.
WITHOUT = {
    "u": "    udot = 0.0\n",
    "v": "    vdot = -v * (ship[SERVICE_SPEED + lane] / ship[LENGTH + lane])\n",
    "r": "    rdot = -r * (ship[SERVICE_SPEED + lane] / ship[LENGTH + lane])\n",
}
MEMORY = "p"  # row of the kernels that keeps the memory of yaw, free in a ship without roll


def accelerations_source(structure: Structure) -> str:
    """Source of `accelerations.py` for a structure: each distinct term once, then a sum per equation."""
    variables: dict[str, str] = {}
    sums = []
    row = 0
    for equation in EQUATION_NAMES:
        if equation not in structure.equations:
            sums.append(WITHOUT.get(equation, ""))
            continue
        products = []
        for term in structure.terms(equation):
            expression = product(term, structure.speed_power(equation, term))
            variable = variables.setdefault(expression, f"t{len(variables)}")
            products.append(f"ship[COEFFICIENTS + {row} * LANES + lane] * {variable}")
            row += 1
        joined = "\n        + ".join(balanced(products))
        sums.append(f"    {equation}dot = (\n        {joined}\n    )\n")
    assignments = "".join(f"    {name} = {expression}\n" for expression, name in variables.items())
    fourth = "pdot" if "p" in structure.equations else "qdot" if "q" in structure.equations else "0.0"
    yaw = f"rdot + {MEMORY}" if "q" in structure.equations else "rdot"
    body = assignments + "".join(sums) + f"    return udot, vdot, {yaw}, {fourth}\n"
    return _header(structure, body) + body


def balanced(products: list[str]) -> list[str]:
    """Sums of at most four products each, in brackets.

    One long sum is a chain in which each addition waits for the one before; partial sums run side by side.
    """
    groups = (products[i : i + PARTIAL_SUM] for i in range(0, len(products), PARTIAL_SUM))
    return [f"({' + '.join(group)})" for group in groups]


def product(term: Term, speed_power: int) -> str:
    """A term as a product of its symbols, with the power of U that makes it dimensional."""
    powers = dict(term.powers)
    speed_power += powers.pop("U", 0)
    factors = [symbol_variable(symbol) for symbol, power in powers.items() for _ in range(power)]
    factors += ["U" if speed_power > 0 else "per_U"] * abs(speed_power)
    return " * ".join(factors) or "1.0"


def symbol_variable(symbol: str) -> str:
    """Name of a symbol in the source."""
    return f"abs_{CHANNEL[symbol]}" if symbol[0] == "|" else symbol


def _header(structure: Structure, body: str) -> str:
    """Everything above the products: imports of what they use, and the symbols that are no arguments."""
    words = set(re.findall(r"\w+", body))
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
    header = HEADER.format(
        name=structure.name, library=library, rows=", ".join(rows), roll="p" in structure.equations,
        memory="q" in structure.equations,
    )  # fmt: skip
    return header + "".join(line for line, used in lines.items() if used)
