"""The accelerations of an identified structure as a source file for the compiler."""

from __future__ import annotations

from shipgym.models.structures import Structure, Term

HEADER = '''"""Accelerations of the structure `{name}`, written from its table of terms."""

from math import sqrt

from .compiling import inlined
from .layout import COEFFICIENTS, LANES, SERVICE_SPEED

ROLL = False
SHAFT = False


@inlined
def shaft_acceleration(n, command, ship, lane):
    return 0.0


@inlined
def accelerations(u, v, r, p, phi, delta, n, depth, ship, lane):
    U = sqrt(u * u + v * v)
    per_U = 1.0 / U
    du = u - ship[SERVICE_SPEED + lane]
'''


def accelerations_source(structure: Structure) -> str:
    """Source of `accelerations.py` for a structure: each distinct term once, then a sum per equation."""
    variables: dict[str, str] = {}
    sums = []
    row = 0
    for equation, terms in structure.equations.items():
        products = []
        for term in terms:
            expression = product(term, structure.speed_power(equation, term))
            variable = variables.setdefault(expression, f"t{len(variables)}")
            products.append(f"ship[COEFFICIENTS + {row} * LANES + lane] * {variable}")
            row += 1
        joined = "\n        + ".join(products)
        sums.append(f"    {equation}dot = (\n        {joined}\n    )\n")
    assignments = "".join(f"    {name} = {expression}\n" for expression, name in variables.items())
    results = ", ".join(f"{equation}dot" for equation in structure.equations)
    return HEADER.format(name=structure.name) + assignments + "".join(sums) + f"    return {results}, 0.0\n"


def product(term: Term, speed_power: int) -> str:
    """A term as a product of its symbols, with the power of U that makes it dimensional."""
    factors = [symbol for symbol, power in term.powers for _ in range(power)]
    factors += ["U" if speed_power > 0 else "per_U"] * abs(speed_power)
    return " * ".join(factors) or "1.0"
