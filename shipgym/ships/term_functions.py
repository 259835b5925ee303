"""The accelerations of a table of terms as a plain function, for the engine to compile.

The function is written from the powers of the terms alone: each symbol is looked up
among those below, coefficients are numbered, powers are repeated factors. So no name or
text of a model file becomes part of a program.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from math import fabs, sqrt
from operator import itemgetter
from typing import Any, NamedTuple

from shipgym.engine.record_code import written
from shipgym.engine.records import Record
from shipgym.ships.terms import CHANNEL, SYMBOLS, VELOCITIES, Term

Equations = Mapping[str, tuple[Term, ...]]
Powers = dict[str, int]  # of variables
Monomial = tuple[str, Powers]  # with its coefficient

MOTION_RATES = ("u", "v", "r", "p", "q")

#: Variable of each symbol.
VARIABLE = {
    symbol: f"abs_{CHANNEL[symbol]}" if symbol[0] == "|" else symbol
    for symbol in SYMBOLS
}
#: Variables and their factors, those that others need first; velocities over U
#: end in an underscore.
MADE_OF = {
    "u": "motion.u",
    "v": "motion.v",
    "r": "motion.r",
    "p": "motion.p",
    "phi": "motion.phi",
    "delta": "motion.delta",
    "n": "motion.n",
    "s": "u * u + v * v",
    "U": "sqrt(s)",
    "per_U": "U * (1.0 / s)",
    "du": "u - ship.speed",
    "dn": "n - ship.shaft",
    "abs_u": "fabs(u)",
    "abs_v": "fabs(v)",
    "abs_r": "fabs(r)",
    "abs_p": "fabs(p)",
    "abs_phi": "fabs(phi)",
    "abs_delta": "fabs(delta)",
    "abs_n": "fabs(n)",
}
MADE_OF |= {
    f"{VARIABLE[symbol]}_": f"{VARIABLE[symbol]} * per_U" for symbol in VELOCITIES
}


#: Rates where a table has no equation: the speed stays, and what drift or turn there is
#: dies out within about a ship length.
DAMPED = {
    "v": "-motion.v * (ship.speed / ship.length)",
    "r": "-motion.r * (ship.speed / ship.length)",
}


def unit_speeds(equation: str) -> int:
    """Power of the speed in the unit of what an equation makes up."""
    return 3 if equation == "q" else 2


def speed_power(equation: str, term: Term) -> int:
    """Power of U of a term in SI units: that of the sum less one per velocity."""
    return unit_speeds(equation) - term.power(*VELOCITIES)


def accelerations_source(
    equations: Equations, prime: bool, damped: bool = True
) -> tuple[str, ...]:
    """Write the lines of `accelerations(motion, c, ship)`: factored sums of terms.

    Coefficients are numbered in the equations' order. `prime`: whether terms are in the
    prime system. Where one of those has more velocities than the sum, all velocities
    are divided by U, and the sum is multiplied by its power. `damped`: whether drift
    and turn die out where there is no equation of them; else their rate is 0.
    """
    # where a term has more velocities than the sum that contains it
    divided = prime and any(
        speed_power(equation, term) < 0
        for equation, terms in equations.items()
        for term in terms
    )
    rates = dict(DAMPED) if damped else {}
    needed = set()
    first = 0
    for equation, terms in equations.items():
        monomials = []
        for number, term in enumerate(terms, first):
            power = 0
            if prime and not divided:
                power = speed_power(equation, term)
            factors = _factors(term, power, divided)
            monomials.append((f"c.c{number}", factors))
        first += len(terms)
        rate = f"({factored(monomials)})"
        if divided:
            unit = "s * U" if unit_speeds(equation) == 3 else "s"
            rate = f"{unit} * {rate}"
        rates[equation] = rate
        needed |= _variables_in(rate)

    return _lines(rates, _with_their_makings(needed), memory="q" in equations)


def _lines(
    rates: Mapping[str, str], variables: set[str], memory: bool
) -> tuple[str, ...]:
    """Lines of the function, by the expressions of the rates."""
    makings = [f"{name} = {MADE_OF[name]}" for name in MADE_OF if name in variables]
    sums = [f"{name}dot = {rates.get(name, '0.0')}" for name in MOTION_RATES]
    yaw = "rdot + motion.q" if memory else "rdot"
    return (*makings, *sums, f"return udot, vdot, {yaw}, pdot, qdot")


@cache
def accelerations_function(lines: tuple[str, ...]) -> Any:
    """Function of the lines by `accelerations_source`."""
    names = {"sqrt": sqrt, "fabs": fabs}
    return written("accelerations", "motion, c, ship", lines, names)


@cache
def coefficients_record(n: int, name: str = "TermCoefficients") -> Record:
    """Record of the numbered coefficients of n terms."""
    return NamedTuple(name, [(f"c{k}", float) for k in range(n)])  # type: ignore[return-value]


def factored(monomials: Sequence[Monomial]) -> str:
    """Write a sum of products, common symbols factored out (Horner's scheme).

    Half as many operations as a sum of products, and short chains of them: three times
    as fast. A monomial is its coefficient and the powers of its variables.
    """
    shared: Counter[str] = Counter()
    for _, powers in monomials:
        shared.update(powers.keys())
    variable, count = max(
        shared.items(),
        key=itemgetter(1),
        default=("", 0),
    )
    if count < 2:
        return " + ".join(_product(*monomial) for monomial in monomials)

    inside = []
    outside = []
    for coefficient, powers in monomials:
        if variable not in powers:
            outside.append((coefficient, powers))
            continue
        left = dict(powers)
        left[variable] -= 1
        if not left[variable]:
            del left[variable]
        inside.append((coefficient, left))

    product = f"{variable} * ({factored(inside)})"
    if outside:
        product += f" + ({factored(outside)})"
    return product


def letter_sum(axis: str, terms: Sequence[str]) -> Callable[..., float]:
    """Write `sum(at, c)`: coefficients such as `c.Y_vvr` by products of `at`'s fields.

    Each letter of a term is a field: `letter_sum("Y", ["v", "vvr"])` is `lambda at, c:
    at.v * (c.Y_v + at.v * at.r * c.Y_vvr)`.
    """
    monomials = []
    for term in terms:
        powers = {f"at.{letter}": power for letter, power in Counter(term).items()}
        monomials.append((f"c.{axis}_{term}", powers))
    return written(f"sum_{axis}", "at, c", [f"return {factored(monomials)}"], {})


def _product(coefficient: str, powers: Powers) -> str:
    factors = [coefficient]
    for variable, power in powers.items():
        factors += [variable] * power
    return " * ".join(factors)


def _factors(term: Term, speed_power: int, divided: bool) -> Powers:
    """Powers of the variables of a term, with those of U or velocities divided by U."""
    powers = {}
    for symbol, power in term.powers:
        if symbol == "U":
            speed_power += power
        elif divided and symbol in VELOCITIES:
            powers[f"{VARIABLE[symbol]}_"] = power
        else:
            powers[VARIABLE[symbol]] = power
    if speed_power:
        powers["U" if speed_power > 0 else "per_U"] = abs(speed_power)
    return powers


def _with_their_makings(names: set[str]) -> set[str]:
    """Names of variables, and of those of which they are products in turn."""
    makings = set(names)
    for name in names:
        makings |= _variables_in(MADE_OF[name])
    if makings == names:
        return makings
    return _with_their_makings(makings)


def _variables_in(expression: str) -> set[str]:
    """Variables that occur in an expression."""
    return MADE_OF.keys() & re.findall(r"\w+", expression)
