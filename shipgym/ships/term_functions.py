"""The accelerations of a table of terms as a plain function, for the engine to compile.

The function is written from the powers of the terms alone: fixed symbols, numbered
coefficients and whole numbers, so that no name or text of a model file becomes part of
a program. A grammar checks that before it is one.
"""

import hashlib
import linecache
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import fabs, sqrt
from typing import Any, NamedTuple

from shipgym.engine.records import Record
from shipgym.ships.terms import CHANNEL, SHAFT_SPEEDS, SPEEDS, SYMBOLS, TURN_RATES, Term

Powers = dict[str, int]
Monomial = tuple[str, Powers]

VELOCITIES = (*SPEEDS, *TURN_RATES, *SHAFT_SPEEDS)
#: Symbols of terms, and how the function makes them from the state, a line each, those
#: it needs first.
VARIABLE = {
    symbol: f"abs_{CHANNEL[symbol]}" if symbol[0] == "|" else symbol
    for symbol in SYMBOLS
}
MADE = {
    **{name: f"motion.{name}" for name in ("u", "v", "r", "p", "phi", "delta", "n")},
    "s": "u * u + v * v",
    "U": "sqrt(s)",
    "per_U": "U * (1.0 / s)",
    "du": "u - ship.speed",
    "dn": "n - ship.shaft",
    **{
        VARIABLE[symbol]: f"fabs({CHANNEL[symbol]})"
        for symbol in SYMBOLS
        if symbol[0] == "|"
    },
}
MADE |= {f"{VARIABLE[symbol]}_": f"{VARIABLE[symbol]} * per_U" for symbol in VELOCITIES}

RATES = ("u", "v", "r", "p", "q")
#: Where a table has no equation: the speed stays, and what drift or turn there is dies
#: out within about a ship length.
WITHOUT = {
    "v": "-motion.v * (ship.speed / ship.length)",
    "r": "-motion.r * (ship.speed / ship.length)",
}

_NAMES = re.findall(
    r"[A-Za-z_]+(?:\.\w+)?", " ".join([*MADE, *MADE.values(), *WITHOUT.values()])
)
_WORD = "|".join(
    re.escape(word)
    for word in sorted({*_NAMES, "motion.q", *(f"{q}dot" for q in RATES)})
)
#: All that a source may be: these words, numbered coefficients and numbers, joined by
#: arithmetic.
GRAMMAR = re.compile(
    r"def accelerations\(motion, c, ship\):\n"
    rf"(?:    (?:{_WORD}) = (?:\b(?:{_WORD}|c\.c\d+|\d\.\d)\b| [-+*/] |-|\(|\))+\n)+"
    r"    return udot, vdot, rdot(?: \+ motion\.q)?, pdot, qdot\n",
    re.ASCII,
)


@dataclass(frozen=True)
class Sum:
    """One equation: its terms, the power of U in the feature of each, and that in the unit of their sum."""

    terms: tuple[Term, ...]
    speed_powers: tuple[int, ...]
    unit: int


def accelerations_source(sums: Mapping[str, Sum], damped: bool = True) -> str:
    """Source of `accelerations(motion, c, ship)`: a factored sum of terms for each equation.

    Coefficients are numbered in the equations' order. `damped`: whether drift and turn
    die out where there is no equation of them; else their rate is 0.
    """
    scaled = any(power < 0 for one in sums.values() for power in one.speed_powers)
    used: set[str] = set()
    rates, row = {}, 0
    for equation, one in sums.items():
        monomials = []
        for term, power in zip(one.terms, one.speed_powers, strict=True):
            factors = _scaled_factors(term) if scaled else _factors(term, power)
            monomials.append((f"c.c{row}", factors))
            used |= factors.keys()
            row += 1
        unit = one.unit if scaled else 0
        used |= {"s"} if unit > 1 else set()
        used |= {"U"} if unit % 2 else set()
        rates[equation] = (
            "s * " * (unit // 2) + "U * " * (unit % 2) + f"({factored(monomials)})"
        )
    without = WITHOUT if damped else {}
    lines = [
        f"    {name} = {MADE[name]}" for name in MADE if name in _with_needed(used)
    ]
    lines += [f"    {q}dot = {rates.get(q) or without.get(q, '0.0')}" for q in RATES]
    yaw = "rdot + motion.q" if "q" in sums else "rdot"
    lines.append(f"    return udot, vdot, {yaw}, pdot, qdot")
    return "def accelerations(motion, c, ship):\n" + "\n".join(lines) + "\n"


@cache
def accelerations_function(source: str) -> Any:
    """The function of a source that `accelerations_source` wrote; ValueError for any other text."""
    if not GRAMMAR.fullmatch(source):
        raise ValueError(
            f"accelerations: {source[:200]!r} found, expected sums of products of known"
            " symbols"
        )
    namespace: dict[str, Any] = {"sqrt": sqrt, "fabs": fabs, "__name__": __name__}
    name = f"<accelerations {hashlib.sha256(source.encode()).hexdigest()[:12]}>"
    exec(compile(source, name, "exec"), namespace)
    linecache.cache[name] = (
        len(source),
        None,
        source.splitlines(keepends=True),
        name,
    )  # for tracebacks
    return namespace["accelerations"]


@cache
def coefficients_record(n: int, name: str = "TermCoefficients") -> Record:
    """Record of the numbered coefficients of n terms."""
    return NamedTuple(name, [(f"c{k}", float) for k in range(n)])  # type: ignore[return-value]


def factored(monomials: Sequence[Monomial]) -> str:
    """Python source of a sum of products with what they share taken out, symbol by symbol (Horner's scheme).

    Half as many operations as a sum of products, and short chains of them: three times
    as fast. A monomial is its coefficient and the powers of its variables.
    """
    shared = Counter(variable for _, powers in monomials for variable in powers)
    variable, count = shared.most_common(1)[0] if shared else ("", 0)
    if count < 2:
        return " + ".join(_product(*monomial) for monomial in monomials)
    inside = [
        (name, _without(powers, variable))
        for name, powers in monomials
        if variable in powers
    ]
    outside = [(name, powers) for name, powers in monomials if variable not in powers]
    product = f"{variable} * ({factored(inside)})"
    return f"{product} + ({factored(outside)})" if outside else product


def _product(coefficient: str, powers: Powers) -> str:
    return " * ".join(
        [coefficient, *(name for name, power in powers.items() for _ in range(power))]
    )


def _without(powers: Powers, variable: str) -> Powers:
    """Powers after one factor is taken out."""
    left = {name: power - (name == variable) for name, power in powers.items()}
    return {name: power for name, power in left.items() if power}


def _scaled_factors(term: Term) -> Powers:
    """Powers of the variables of a term, all velocities divided by U."""
    return {
        f"{VARIABLE[symbol]}_" if symbol in VELOCITIES else VARIABLE[symbol]: power
        for symbol, power in term.powers
    }


def _factors(term: Term, speed_power: int) -> Powers:
    """Powers of the variables of a term, with U as often as it takes."""
    powers = dict(term.powers)
    speed_power += powers.pop("U", 0)
    factors = {VARIABLE[symbol]: power for symbol, power in powers.items()}
    if speed_power:
        factors["U" if speed_power > 0 else "per_U"] = abs(speed_power)
    return factors


def _with_needed(names: set[str]) -> set[str]:
    """Names and what they are made from."""
    more = {
        word
        for name in names
        for word in re.findall(r"\w+", MADE[name])
        if word in MADE
    }
    return names if more <= names else _with_needed(names | more)
