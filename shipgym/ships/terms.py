"""Terms of a manoeuvring model: products of powers of velocities and rudder angle."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

from shipgym.checks import (
    check_table,
    check_text,
    check_whole,
    did_you_mean,
    quoted,
    unexpected,
)
from shipgym.errors import InputError

# du is the surge speed above service speed, dn the shaft speed above that of service, U
# the speed through the water, p the roll rate and phi the heel; bars stand for absolute
# values; all in SI units
CHANNEL = {
    "u": "u",
    "du": "u",
    "|u|": "u",
    "v": "v",
    "|v|": "v",
    "r": "r",
    "|r|": "r",
    "p": "p",
    "|p|": "p",
    "phi": "phi",
    "|phi|": "phi",
    "delta": "delta",
    "|delta|": "delta",
    "n": "n",
    "dn": "n",
    "|n|": "n",
    "U": "U",
}
SYMBOLS = tuple(CHANNEL)
SPEEDS = ("u", "du", "|u|", "v", "|v|", "U")
TURN_RATES = ("r", "|r|", "p", "|p|")
ROLL = ("p", "|p|", "phi", "|phi|")
SHAFT_SPEEDS = ("n", "dn", "|n|")
VELOCITIES = (*SPEEDS, *TURN_RATES, *SHAFT_SPEEDS)

#: A factor of a formula, such as `v`, `|r|`, `n^2` or `/U`.
FACTOR = re.compile(
    r"(?P<stroke>/?)(?P<symbol>\|?[A-Za-z]+\|?|1)(?:\^(?P<exponent>[1-9]))?"
)

MOST_TERMS = 200


@dataclass(frozen=True)
class Term:
    """A product of integer powers of symbols, in the units of the structure."""

    name: str  # as the field writes it: `vvr`, `0u`, `dd`, `|v|r`
    # symbols (`SYMBOLS`) and their powers, 1 to 9; that of the speed U may be negative
    powers: tuple[tuple[str, int], ...]

    @property
    def product(self) -> object:
        """Identity of the term, whatever its name."""
        return frozenset(self.powers)

    @property
    def symbols(self) -> frozenset[str]:
        """Symbols that occur in the term."""
        return frozenset(dict(self.powers))

    def power(self, *symbols: str) -> int:
        """Sum of the powers of the given symbols."""
        return sum(power for symbol, power in self.powers if symbol in symbols)

    def check(self, where: str) -> None:
        """Refuse symbols and powers that cannot be computed, naming the term."""
        place = f"{where}: term '{self.name}'"
        # largest power that a file may ask for
        largest_power = 9
        for symbol, power in self.powers:
            if symbol not in SYMBOLS:
                raise InputError(
                    f"{place}: expected symbols of {quoted(SYMBOLS)}, got"
                    f" '{symbol}'.{did_you_mean(symbol, SYMBOLS)}"
                )
            at = f"{place}: power of '{symbol}'"
            whole = check_whole(
                power,
                at,
                at_least=-largest_power if symbol == "U" else 1,
                at_most=largest_power,
            )
            if whole == 0:
                raise unexpected(at, "an integer other than 0", power)

    def to_dict(self) -> dict[str, Any]:
        """Name and powers, as written in a model file."""
        return {"name": self.name, "powers": dict(self.powers)}

    @classmethod
    def from_dict(cls, content: Any, where: str) -> Self:
        """Read what `to_dict` wrote; InputError, after `where`, for anything else."""
        fields = ("name", "powers")
        table = check_table(
            content,
            where,
            allowed=fields,
            required=fields,
        )
        powers = check_table(table["powers"], f"{where}.powers")
        return cls(
            name=check_text(table["name"], f"{where}.name"),
            powers=tuple(powers.items()),
        )


def symbols_in(tables: Iterable[tuple[Term, ...]]) -> set[str]:
    """Symbols that occur in any term of some equations."""
    return {symbol for terms in tables for term in terms for symbol in term.symbols}


def read_terms(text: str) -> tuple[Term, ...]:
    """Read terms from formulas separated by commas.

    Each formula is a product of symbols (`SYMBOLS`), written side by side with spaces
    between, with powers after `^` and the speed U also below a stroke: `"v, |v| r,
    v^3/U, n^2 delta"`. `1` is the constant. The name of a term is its formula without
    spaces and carets, `d` for `delta`: `v3/U`, `n2d`.
    """
    return tuple(_read_term(formula.strip()) for formula in text.split(","))


def _read_term(formula: str) -> Term:
    powers: dict[str, int] = {}
    name = ""
    spaced = re.sub(r"\s*/\s*", " /", formula)
    short_names = {"delta": "d", "|delta|": "|d|", "phi": "f", "|phi|": "|f|"}
    for factor in spaced.split():
        parts = FACTOR.fullmatch(factor)
        if parts is None or parts["symbol"] not in ("1", *SYMBOLS):
            raise InputError(
                f"terms: expected products of {quoted(SYMBOLS)} with spaces between,"
                f" such as '|v| r' or 'v^3/U', got '{factor}' in"
                f" '{formula}'.{did_you_mean(factor, SYMBOLS)}"
            )
        stroke = parts["stroke"]
        symbol = parts["symbol"]
        exponent = parts["exponent"] or ""
        name += stroke + short_names.get(symbol, symbol) + exponent
        if symbol == "1":
            continue
        power = int(exponent or 1)
        if stroke:
            power = -power
        powers[symbol] = powers.get(symbol, 0) + power

    if not name:
        raise InputError(
            "terms: expected a formula such as '|v| r' between two commas, got nothing"
        )
    return Term("0" if name == "1" else name, tuple(powers.items()))


def short_terms(words: str, surge: str = "du") -> tuple[Term, ...]:
    """Read short names separated by spaces: letters u v r d (delta), bars, 0 for one.

    `u` is Abkowitz's perturbation from service speed, so that `0u` is the constant's
    change with it, or the symbol that `surge` says.
    """
    symbols = {"u": surge, "d": "delta"}
    terms = []
    for word in words.split():
        letters = re.findall(r"\|.\||.", word.lstrip("0"))
        powers = Counter([symbols.get(letter, letter) for letter in letters])
        terms.append(Term(word, tuple(powers.items())))
    return tuple(terms)


def read_term_list(content: Any, where: str) -> tuple[Term, ...]:
    """Read the terms of one equation from a model file."""
    if not isinstance(content, list):
        raise unexpected(where, "a list of terms", content)
    return tuple(
        Term.from_dict(entry, f"{where}[{i}]") for i, entry in enumerate(content)
    )
