"""Terms of a manoeuvring model: products of powers of the velocities, the rudder angle and their kin."""

import re
from dataclasses import dataclass

from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError

# du is the surge speed above service speed, dn the shaft speed above that of service, U
# the speed through the water, p the roll rate and phi the heel; bars stand for absolute
# values; all in SI units
SYMBOLS = (
    "u",
    "du",
    "|u|",
    "v",
    "|v|",
    "r",
    "|r|",
    "p",
    "|p|",
    "phi",
    "|phi|",
    "delta",
    "|delta|",
    "n",
    "dn",
    "|n|",
    "U",
)
SPEEDS = ("u", "du", "|u|", "v", "|v|", "U")
TURN_RATES = ("r", "|r|", "p", "|p|")
ROLL = ("p", "|p|", "phi", "|phi|")
SHAFT_SPEEDS = ("n", "dn", "|n|")
SHORT = {"delta": "d", "|delta|": "|d|", "phi": "f", "|phi|": "|f|"}  # in names

CHANNEL = {symbol: symbol.strip("|") for symbol in SYMBOLS} | {"du": "u", "dn": "n"}
#: Limits of what a file may ask for: power of a symbol, factors of a term, terms of an
#: equation.
LARGEST_POWER, MOST_FACTORS, MOST_TERMS = 9, 20, 200


@dataclass(frozen=True)
class Term:
    """A product of integer powers of symbols, in the units of the structure."""

    name: str  # as the field writes it: `vvr`, `0u`, `dd`, `|v|r`
    # symbols (`SYMBOLS`) and their powers, 1 to 9; that of the speed U may be negative
    powers: tuple[tuple[str, int], ...]

    @property
    def product(self) -> object:
        """What it is, whatever its name."""
        return frozenset(self.powers)

    def power(self, *symbols: str) -> int:
        """Sum of the powers of the given symbols."""
        return sum(power for symbol, power in self.powers if symbol in symbols)

    def check(self, where: str) -> None:
        """InputError, naming the term, for symbols and powers that cannot be computed."""
        for symbol, power in self.powers:
            if symbol not in SYMBOLS:
                raise InputError(
                    f"{where}: term '{self.name}': symbol '{symbol}' found, expected"
                    f" one of {quoted(SYMBOLS)}.{did_you_mean(symbol, SYMBOLS)}"
                )
            least = -LARGEST_POWER if symbol == "U" else 1
            whole = isinstance(power, int) and not isinstance(power, bool)
            if not whole or power == 0 or not least <= power <= LARGEST_POWER:
                below = " (or negative)" if symbol == "U" else ""
                raise InputError(
                    f"{where}: term '{self.name}': power {power!r} of '{symbol}' found,"
                    f" expected a whole number from 1 to {LARGEST_POWER}{below}"
                )
        factors = sum(abs(power) for _, power in self.powers)
        if factors > MOST_FACTORS:
            raise InputError(
                f"{where}: term '{self.name}': {factors} factors found, expected at"
                f" most {MOST_FACTORS}"
            )


def read_terms(text: str) -> tuple[Term, ...]:
    """Terms from formulas separated by commas; InputError names one that cannot be read.

    Each formula is a product of symbols (`SYMBOLS`), written side by side with spaces
    between, with powers after `^` and the speed U also below a stroke: `"v, |v| r,
    v^3/U, n^2 delta"`. `1` is the constant. The name of a term is its formula without
    spaces and carets, `d` for `delta`: `v3/U`, `n2d`.
    """
    return tuple(_read_term(formula.strip()) for formula in text.split(","))


def _read_term(formula: str) -> Term:
    powers: dict[str, int] = {}
    name = ""
    for factor in re.sub(r"\s*/\s*", " /", formula).split():
        found = re.fullmatch(r"(/?)(\|?[A-Za-z]+\|?|1)(?:\^([1-9]))?", factor)
        if found is None or (found[2] != "1" and found[2] not in SYMBOLS):
            raise InputError(
                f"terms: '{factor}' found in '{formula}', expected a product of"
                f" {quoted(SYMBOLS)} with spaces between, such as '|v| r' or"
                f" 'v^3/U'.{did_you_mean(factor, SYMBOLS)}"
            )
        below, symbol, power = found[1], found[2], found[3] or ""
        name += below + SHORT.get(symbol, symbol) + power
        if symbol != "1":
            powers[symbol] = powers.get(symbol, 0) + int(power or 1) * (
                -1 if below else 1
            )
    if not name:
        raise InputError(
            "terms: nothing found between two commas, expected a formula such as"
            " '|v| r'"
        )
    return Term("0" if name == "1" else name, tuple(powers.items()))


def short_terms(words: str, surge: str = "du") -> tuple[Term, ...]:
    """Terms from short names separated by spaces: letters u v r d (delta), or such between bars, 0 for one.

    `u` is Abkowitz's perturbation from service speed, so that `0u` is the constant's
    change with it, or the symbol that `surge` says.
    """
    symbols, terms = {"u": surge, "d": "delta"}, []
    for word in words.split():
        factors = re.findall(r"\|.\||.", word.lstrip("0"))
        powers = {
            symbols.get(factor, factor): factors.count(factor) for factor in factors
        }
        terms.append(Term(word, tuple(powers.items())))
    return tuple(terms)
