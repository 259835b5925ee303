"""Sentences of NMEA 0183, for logs and for the helm.

The table `nmea.toml` says which numbers stand where. A sentence is ``$`` or nothing,
two letters of the talker, three of the kind, fields after commas, and ``*`` with the
checksum: the exclusive or of all characters between.
"""

import re
from collections import ChainMap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from math import copysign, isfinite
from operator import xor
from typing import Any, NamedTuple

from shipgym.files import shipped_toml
from shipgym.trials.units import UNITS

_SENTENCE = re.compile(
    r"\s*\$?"
    r"(?P<text>(?P<talker>P|\w{1,2})(?P<kind>\w*),(?P<fields>[^*]*))"
    r"(\*(?P<checksum>[0-9A-Fa-f]{2}))?\s*"
)
_QUANTITIES_IN_SI = ("length", "angle", "angular rate", "speed", "shaft speed")
_SPEED_UNITS = {"N": "knots", "K": "km/h", "M": "m/s"}

#: Sign of a number by the letter of its side; L and R are the sides to steer to.
_SIGNS = {"N": 1.0, "S": -1.0, "E": 1.0, "W": -1.0, "L": 1.0, "R": -1.0}
Letters = Mapping[int, frozenset[str]]  # letters allowed in a field, by its place


class Sentence(NamedTuple):
    """One sentence, cut into its parts."""

    talker: str  # who sent it, such as HE: a gyro
    kind: str  # such as HDT
    fields: list[str]


@dataclass(frozen=True)
class NumberField:
    """Position of a number in a sentence; `nmea.toml` explains the names."""

    at: int
    unit: str = ""
    unit_at: int | None = None
    side: int | None = None
    letters: Letters = field(default_factory=dict)
    only_if: Letters = field(default_factory=dict)
    valid: Letters = field(default_factory=dict)
    optional: bool = False


@dataclass(frozen=True)
class SentenceKind:
    """Contents of a kind of sentence; `nmea.toml` explains the names."""

    fields: Mapping[str, NumberField]  # by quantity
    log_fields: Mapping[str, NumberField]  # the same, with the statuses of logs
    valid: Letters = field(default_factory=dict)
    mode: Letters = field(default_factory=dict)
    degraded: Letters = field(default_factory=dict)
    time: int | None = None
    date: int | None = None
    day: int | None = None
    log_only: bool = False


@dataclass(frozen=True)
class NmeaQuantity:
    """Quantity that a number in a sentence measures, in SI units and radians."""

    largest: float
    tolerance: float | None  # between two instruments; None: not compared
    channel: str | None  # of a log


def _with_letters(entry: Mapping[str, Any]) -> dict[str, Any]:
    """An entry of the table whose tables of letters are by place."""
    fields = dict(entry)
    for name in ("valid", "mode", "degraded", "letters", "only_if"):
        if name not in entry:
            continue
        by_place = {}
        for at, letters in entry[name].items():
            by_place[int(at)] = frozenset(letters)
        fields[name] = by_place
    return fields


def _sentence_kind(entry: Mapping[str, Any]) -> SentenceKind:
    kind = _with_letters(entry)
    fields = _number_fields(entry.get("fields", {}))
    valid = kind.get("valid", {})
    degraded = kind.get("degraded", {})

    log_fields = {}
    for quantity, place in fields.items():
        statuses = dict(place.valid or valid)
        for at, letters in degraded.items():
            statuses[at] |= letters
        log_fields[quantity] = replace(place, valid=statuses)
    kind["fields"] = fields
    kind["log_fields"] = log_fields
    return SentenceKind(**kind)


def _number_fields(entries: Mapping[str, Any]) -> dict[str, NumberField]:
    """Numbers of a sentence by quantity."""
    numbers = {}
    for quantity, entry in entries.items():
        place = _with_letters(entry)
        number = NumberField(**place)
        numbers[quantity] = number
    return numbers


def _quantity(entry: Mapping[str, Any]) -> NmeaQuantity:
    largest = _si(*entry["largest"])
    tolerance = _si(*entry["tolerance"]) if "tolerance" in entry else None
    return NmeaQuantity(largest, tolerance, entry.get("channel"))


def _si(number: float, unit: str) -> float:
    return float(number * _TO_SI[unit])


_TO_SI = dict(ChainMap(*(UNITS[quantity] for quantity in _QUANTITIES_IN_SI)))
_TABLE = shipped_toml("shipgym.trials", "nmea.toml")

#: What each kind of sentence says, by its three letters.
NMEA_SENTENCES = {
    kind: _sentence_kind(entry) for kind, entry in _TABLE["sentences"].items()
}

#: What the numbers measure, by the name of the quantity.
NMEA_QUANTITIES = {
    name: _quantity(entry) for name, entry in _TABLE["quantities"].items()
}


def checksum(text: str) -> str:
    """Two hexadecimal digits, of what stands between ``$`` and ``*``."""
    return f"{reduce(xor, map(ord, text), 0):02X}"


def parse_sentence(line: str, *, needs_checksum: bool = True) -> Sentence:
    """Cut a line into talker, kind and fields.

    A proprietary sentence has the talker P. Raises ValueError where the line is no
    sentence, or its checksum is wrong or, if it is needed, missing.
    """
    match = _SENTENCE.fullmatch(line)
    if match is None:
        raise ValueError(f"expected a sentence with a checksum, got {line!r}")
    found = match["checksum"]
    if found is None and needs_checksum:
        raise ValueError(f"expected a sentence with a checksum, got {line!r}")
    expected = checksum(match["text"])
    if found is not None and expected != found.upper():
        raise ValueError(f"expected the checksum {expected}, got {found}")

    fields = match["fields"]
    return Sentence(
        talker=match["talker"],
        kind=match["kind"],
        fields=fields.split(","),
    )


def steering_numbers(sentence: Sentence) -> dict[str, float]:
    """Numbers that an autopilot may steer by, in SI units and radians, by quantity.

    Nothing for a kind that is not known, a status or mode that is not valid, an empty
    field, or a number beyond any sensor's range. Raises ValueError, KeyError or
    IndexError where fields are broken or missing.
    """
    kind = NMEA_SENTENCES.get(sentence.kind)
    if kind is None or kind.log_only or not _has_mode(kind, sentence.fields):
        return {}
    numbers = {}
    for name, place in kind.fields.items():
        needed = {**(place.valid or kind.valid), **place.letters, **place.only_if}
        fields = sentence.fields
        if place.optional:
            fields = _padded(sentence)
            needed |= _sides(place)
        value = _number(place, fields, needed)
        if value is None:
            continue
        size = abs(value)
        quantity = NMEA_QUANTITIES[name]
        if size <= quantity.largest:
            numbers[name] = value
    return numbers


def _sides(place: NumberField) -> Letters:
    """Letters that a number needs for its direction, by place."""
    return {} if place.side is None else {place.side: frozenset(_SIGNS)}


def _has_mode(kind: SentenceKind, fields: Sequence[str]) -> bool:
    """False where a mode indicator is there and says that it is not to be used."""
    for at, letters in kind.mode.items():
        letter = fields[at].strip() if at < len(fields) else ""
        if letter and letter not in letters:
            return False
    return True


def logged_numbers(sentence: Sentence) -> dict[str, float]:
    """Numbers of a sentence in a log, in SI units and radians, by quantity.

    More lenient than :func:`steering_numbers`: estimated and simulated values count,
    letters that the standard puts next to a number may be missing, a status may be
    empty, and no number is too large. Raises ValueError where one is broken.
    """
    kind = NMEA_SENTENCES[sentence.kind]
    fields = _padded(sentence)
    numbers = {}
    for quantity, place in kind.log_fields.items():
        needed = dict(place.only_if)
        optional = {**place.valid, **place.letters}
        for at, letters in optional.items():
            if fields[at]:
                needed[at] = letters
        needed |= _sides(place)
        value = _number(place, fields, needed)
        if value is None:
            continue
        if not isfinite(value):
            raise ValueError(f"expected a finite number, got {value}")
        numbers[quantity] = value
    return numbers


def lacks_status(sentence: Sentence, quantity: str) -> bool:
    """Return whether the status of a number in a log is empty or not there."""
    place = NMEA_SENTENCES[sentence.kind].log_fields[quantity]
    fields = _padded(sentence)
    return any(not fields[at] for at in place.valid)


def _padded(sentence: Sentence) -> list[str]:
    """Fields of a sentence; those at the end may be missing."""
    absent = [""] * 20
    return [*sentence.fields, *absent]


def _number(place: NumberField, fields: Sequence[str], needed: Letters) -> float | None:
    """One number in SI units.

    None where its field is empty or the letters needed are not there.
    """
    for at, letters in needed.items():
        if fields[at] not in letters:
            return None
    text = fields[place.at]
    if not text:
        return None
    if "_" in text:
        raise ValueError(f"expected a number, got {text!r}")

    value = float(text)
    unit = place.unit
    if place.unit_at is not None:
        letter = fields[place.unit_at]
        unit = _SPEED_UNITS[letter]
    if unit == "ddmm.mm":  # 5430.5 is 54 degrees and 30.5 minutes
        degrees, minutes = divmod(value, 100.0)
        if not minutes < 60.0 or value < 0.0:
            raise ValueError(f"expected degrees and minutes below 60, got {text}")
        value = degrees + minutes / 60.0
        unit = "deg"
    value *= _TO_SI[unit]

    if place.side is None:
        return value
    side = fields[place.side]
    sign = _SIGNS[side]
    return copysign(value, sign)
