"""Numbers as instruments write them in cells, and words for "no value"."""

import re
from typing import NamedTuple

from shipgym.trials.unit_spellings import spelled_units

#: Words that stand for "no value"; so does a text of dashes or other signs alone.
_MISSING_WORDS = re.compile(
    r"-?nan(\(ind\))?|#?n\.?/?a\.?|\(?null\)?|nil|none|nat|<na>|no ?data|no value"
    r"|invalid|void|undef(ined)?|missing|unknown|not available|err(or)?"
    r"|#(value|num)!|#div/0!|#ref!|#name\?|-?1\.#(qnan|ind)",
    re.IGNORECASE,
)
_SIDES = {
    1.0: "s|r|stbd|stb|sb|starboard|right|steuerbord|td|tribord|estribor|右",
    -1.0: "p|l|port|bb|backbord|babord|bâbord|bd|babor|left|左",
}
_NUMBER = r"\d+(?:\.\d*)?|\.\d+"
_UNIT_AFTER = re.compile(
    rf"(?P<number>[-+]?(?:{_NUMBER})(?:e[-+]?\d+)?)\s*(?P<unit>[^\W\d_][\w/.]*|°\w?|%)",
    re.IGNORECASE,
)
_SIDED = [
    (
        sign,
        re.compile(
            rf"(?:(?:{words})\.?\s*(?P<a>{_NUMBER})\s*°?"
            rf"|(?P<b>{_NUMBER})\s*°?\s*(?:{words})\.?)",
            re.IGNORECASE,
        ),
    )
    for sign, words in _SIDES.items()
]


def is_missing(text: str) -> bool:
    """Return whether a cell stands for "no value": blank, signs alone, or a word."""
    bare = text.strip()
    has_letters = any(letter.isalnum() for letter in bare)
    if not has_letters:
        return True
    match = _MISSING_WORDS.fullmatch(bare)
    return match is not None


def number_with_side(text: str) -> float | None:
    """Number of a text such as "S10.0", "10 PORT" or "P 5"; None for others.

    To starboard positive.
    """
    for sign, pattern in _SIDED:
        match = pattern.fullmatch(text)
        if match:
            number = match["a"] or match["b"]
            return sign * float(number)
    return None


class Measured(NamedTuple):
    """A number with its unit."""

    number: float
    unit: str


def number_with_unit(text: str) -> Measured | None:
    """Number and unit of a text such as "13.6 kn"; None for others."""
    match = _UNIT_AFTER.fullmatch(text)
    if match is None:
        return None
    unit = match["unit"]
    known = spelled_units(unit.lower())
    if not known:
        return None
    number = float(match["number"])
    return Measured(number, unit)
