"""Sentences of NMEA 0183 in a log, of any talkers: position, motion, rudder and wind.

The sentences stand in `nmea0183.toml`; those without channel and time (AIS, depth,
satellites) are passed over.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import copysign, isfinite, nan
from typing import Any, NamedTuple

import pynmea2

from shipgym.files import shipped_toml
from shipgym.trials.readers.messages import Heard, Value, port_source
from shipgym.trials.units import DEGREE, UNITS

_FACTORS = {**UNITS["angle"], **UNITS["angular rate"], **UNITS["speed"]}
_FACTORS |= UNITS["shaft speed"]
_SPEED_UNITS = {"N": "knots", "K": "km/h", "M": "m/s"}
_SIGNS = {"N": 1.0, "S": -1.0, "E": 1.0, "W": -1.0}
_TIME = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d*)?)")
#: Names of transducers that show a rudder, and that of the port one.
_RUDDER = re.compile(r"RUD|RSA|HELM", re.IGNORECASE)
_PORT_RUDDER = re.compile(r"PORT|[_ ]P$|[_ ]BB$", re.IGNORECASE)

Letters = Mapping[str, str]  # letters of a field, by its place


class THS(pynmea2.TalkerSentence):  # type: ignore[misc]
    """True heading and status, which pynmea2 does not have; it registers itself."""

    fields = (("Heading", "heading"), ("Mode indicator", "mode"))


@dataclass(frozen=True)
class _Number:
    """Place of a number in a sentence; `nmea0183.toml` explains the names."""

    at: int
    unit: str = ""
    unit_at: int | None = None
    side: int | None = None
    letters: Letters = field(default_factory=dict)
    only_if: Letters = field(default_factory=dict)
    status: Letters = field(default_factory=dict)


@dataclass(frozen=True)
class _Kind:
    """Contents of a kind of sentence."""

    numbers: Mapping[str, _Number]  # by channel
    time: int | None = None
    date: int | None = None
    day: int | None = None


def _kind(entry: dict[str, Any]) -> _Kind:
    status = entry.pop("status", {})
    places = {name: entry.pop(name, None) for name in ("time", "date", "day")}
    numbers = {}
    for channel, number in entry.items():
        numbers[channel] = _Number(**{"status": status, **number})
    return _Kind(numbers, **places)


_TABLE = shipped_toml("shipgym.trials.readers", "nmea0183.toml")
_KINDS = {name: _kind(entry) for name, entry in _TABLE.items()}
_SENTENCE = re.compile(
    rf"\$[A-Za-z0-9]{{2}}(?:{'|'.join(_KINDS)}|XDR),[^$!\\\"\r\n*]*"
    r"(?:\*[^,;\s\"$!\\]{0,2})?"
)


class _Found(NamedTuple):
    """A sentence as it stands in a log."""

    line: int
    source: str  # talker and kind
    text: str


def hear_sentences(lines: Sequence[str], heard: Heard) -> None:
    """Take times and channels out of the sentences of a log.

    A sentence without a checksum is damaged where most of its source have one, or
    another number of fields.
    """
    found = _find(lines, heard)
    with_checksum = _usual(found, "*")
    commas = _usual(found, ",")
    lacking = 0
    without_status: list[str] = []
    for line, source, text in found:
        may_lack = with_checksum[source] == 0
        lacks = "*" not in text
        try:
            if lacks and not (may_lack and text.count(",") == commas[source]):
                raise ValueError("expected a checksum, or as many fields as usual")
            sentence = pynmea2.parse(text)
            numbers, lacks_status = _numbers(sentence)
            time = _time(sentence)
        except ValueError:
            heard.count += 1
            heard.damaged.append(line)
            continue
        port = numbers.pop("port", None)
        heard.hear(line, source, _channel_values(numbers), time)
        if port is not None:
            second = heard.channels["delta"][port_source(source)]
            second.append(Value(line, time, port))
        lacking += lacks
        if lacks_status:
            without_status.append(source)
    if lacking:
        heard.notes.append(
            f"{lacking} of {len(found)} sentences have no checksum: nothing protects"
            " them from damage on the way"
        )
    if without_status:
        sources = ", ".join(sorted(set(without_status)))
        heard.notes.append(
            f"the status in {len(without_status)} sentences of {sources} is empty;"
            " their values are taken"
        )


def _find(lines: Sequence[str], heard: Heard) -> list[_Found]:
    """Sentences of known kinds; the stamps of their lines are heard."""
    found = []
    for number, line in enumerate(lines, start=1):
        if "$" not in line:
            continue
        matches = list(_SENTENCE.finditer(line))
        for match in matches:
            text = match[0].rstrip()
            found.append(_Found(number, text[1:6], text))
        if matches:
            before, after = line[: matches[0].start()], line[matches[-1].end() :]
            heard.stamp(number, before or after)
    return found


def _usual(found: Sequence[_Found], sign: str) -> dict[str, int]:
    """How often most sentences of a source have a sign, by source."""
    counts: dict[str, Counter[int]] = {}
    for _, source, text in found:
        counts.setdefault(source, Counter())[text.count(sign)] += 1
    return {source: count.most_common(1)[0][0] for source, count in counts.items()}


def _numbers(sentence: Any) -> tuple[dict[str, float], bool]:
    """Numbers of a sentence by channel, and whether one of them has an empty status.

    In SI units, positions in degrees. Raises ValueError where one is broken.
    """
    if sentence.sentence_type == "XDR":
        return _transducer_values(sentence.data), False
    fields = [*sentence.data, *[""] * 20]  # those at the end may be missing
    numbers = {}
    lacks_status = False
    for channel, place in _KINDS[sentence.sentence_type].numbers.items():
        text = fields[place.at]
        if not text or not _counts(place, fields):
            continue
        numbers[channel] = _number(text, place, fields)
        lacks_status |= any(not fields[int(at)] for at in place.status)
    return numbers, lacks_status


def _counts(place: _Number, fields: Sequence[str]) -> bool:
    """Return whether the letters beside a number say that it counts."""
    sides = {} if place.side is None else {str(place.side): "NSEW"}
    for at, letters in {**place.only_if, **sides}.items():
        if len(fields[int(at)]) != 1 or fields[int(at)] not in letters:
            return False
    return all(
        fields[int(at)] in ("", *letters)
        for at, letters in (*place.status.items(), *place.letters.items())
    )


def _number(text: str, place: _Number, fields: Sequence[str]) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"expected a finite number, got {text}")
    if place.unit == "ddmm.mm":  # 5430.5 is 54 degrees and 30.5 minutes
        degrees, minutes = divmod(value, 100.0)
        if not minutes < 60.0 or value < 0.0:
            raise ValueError(f"expected degrees and minutes below 60, got {text}")
        value = degrees + minutes / 60.0
    else:
        unit = place.unit
        if place.unit_at is not None:
            unit = _SPEED_UNITS[fields[place.unit_at]]
        value *= _FACTORS[unit]
    if place.side is None:
        return value
    side = fields[place.side]
    return copysign(value, _SIGNS[side])


def _transducer_values(fields: Sequence[str]) -> dict[str, float]:
    """Rudder angles among the transducers of a sentence, rad.

    Each has four fields: type (A: an angle), value, unit (D: degrees) and name.
    """
    values = {}
    for at in range(0, len(fields) - 3, 4):
        kind, value, unit, name = fields[at : at + 4]
        is_angle = kind == "A" and unit in ("D", "")
        if is_angle and value and _RUDDER.search(name):
            channel = "port" if _PORT_RUDDER.search(name) else "delta"
            values[channel] = DEGREE * float(value)
    return values


def _time(sentence: Any) -> float:
    """Seconds since 1970 with a date, else of the day; nan without a time."""
    kind = _KINDS.get(sentence.sentence_type)
    if kind is None or kind.time is None:
        return nan
    fields = [*sentence.data, *[""] * 20]
    match = _TIME.fullmatch(fields[kind.time])
    if match is None:
        return nan
    hours, minutes, seconds = map(float, match.groups())
    of_day = 3600.0 * hours + 60.0 * minutes + seconds

    date, form = "", "%d%m%y"
    if kind.date is not None:
        date = fields[kind.date]
    if kind.day is not None:
        date = "-".join(fields[kind.day : kind.day + 3]).strip("-")
        form = "%d-%m-%Y"
    if not date:
        return of_day
    midnight = datetime.strptime(date, form).replace(tzinfo=UTC)
    return midnight.timestamp() + of_day


def _channel_values(numbers: dict[str, float]) -> dict[str, float]:
    """Values by channel: a heading by compass with its deviation, and true if known."""
    values = dict(numbers)
    deviation = values.pop("deviation", 0.0)
    if "psi_magnetic" in values:
        values["psi_magnetic"] += deviation
    if {"psi_magnetic", "variation"} <= values.keys():
        magnetic = values.pop("psi_magnetic")
        values.setdefault("psi", magnetic + values["variation"])
    return values
