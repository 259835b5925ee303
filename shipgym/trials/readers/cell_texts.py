"""Numbers as instruments write them in cells, and words for "no value"."""

import re

from shipgym.trials.units import spelled_units

#: Words that stand for "no value"; so does a text of dashes or other signs alone.
_MISSING_WORDS = re.compile(
    r"-?nan(\(ind\))?|#?n\.?/?a\.?|\(?null\)?|nil|none|nat|<na>|no ?data|no value"
    r"|invalid|void|undef(ined)?|missing|unknown|not available|err(or)?"
    r"|#(value|num)!|#div/0!|#ref!|#name\?|-?1\.#(qnan|ind)",
    re.IGNORECASE,
)
_STARBOARD = "s|r|stbd|stb|sb|starboard|right|steuerbord|td|tribord|estribor|右"
_PORT = "p|l|port|bb|backbord|babord|bâbord|bd|babor|left|左"
_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)"
_WITH_UNIT = re.compile(rf"([-+]?{_NUMBER}(?:[eE][-+]?\d+)?) ?([^\d\s.].*)")
_WITH_SIDE = [
    (sign, re.compile(rf"(?:(?:{words})\.?\s*)?({_NUMBER})\s*°?(?:\s*(?:{words})\.?)?"))
    for sign, words in ((1.0, _STARBOARD), (-1.0, _PORT))
]


def is_missing(
    text: str,
) -> bool:
    """Return whether a cell stands for "no value": blank, signs alone, or a word."""
    bare = text.strip()
    if bare[-1:].isdigit():
        return False
    has_letters = any(letter.isalnum() for letter in bare)
    return not has_letters or _MISSING_WORDS.fullmatch(bare) is not None


def is_number(text: str) -> bool:
    """Return whether a text is a number as Python reads it, without underscores."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def cell_number(text: str) -> float | None:
    """A number, with a side or a unit or neither; None for other text."""
    text = text.replace("\u2212", "-")  # a minus as typographers write it
    match = _WITH_UNIT.fullmatch(text)
    if match and units_in_cell(text):
        text = match[1]
    return float(text) if is_number(text) else number_with_side(text)


def units_in_cell(text: str) -> list[str]:
    """Units that may stand behind a number such as "13.6 kn" or "5kn"; else none."""
    match = _WITH_UNIT.fullmatch(text)
    if match is None:
        return []
    unit = match[2]
    return spelled_units("deg" if unit == "T" else unit.lower())  # T: from true north


def number_with_side(text: str) -> float | None:
    """Number of a text such as "S10.0", "10 PORT" or "P 5"; None for others.

    To starboard positive.
    """
    bare = text.lower()
    matches = ((sign, pattern.fullmatch(bare)) for sign, pattern in _WITH_SIDE)
    for sign, match in matches:
        if match and any(map(str.isalpha, bare)):
            return sign * float(match[1])
    return None
