"""Sentences of NMEA 0183 in a log, of any talkers: position, motion and rudder.

The sentences stand in `nmea0183.toml`; those without channel and time (AIS, depth,
satellites) are passed over.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from math import copysign, isfinite, nan
from typing import NamedTuple

from pynmea2 import NMEASentence

from shipgym.files import shipped_toml
from shipgym.trials.readers.messages import Heard
from shipgym.trials.units import DEGREE, UNITS

_FACTORS = {**UNITS["angle"], **UNITS["angular rate"], **UNITS["speed"]}
_FACTORS |= UNITS["shaft speed"]
_SIGNS = {"N": 1.0, "S": -1.0, "E": 1.0, "W": -1.0}
_TIME = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d*)?)")
#: Names of transducers that show a rudder, and that of the port one.
_RUDDER = re.compile(r"RUD|RSA|HELM", re.IGNORECASE)
_PORT_RUDDER = re.compile(r"PORT|[_ ]P$|[_ ]BB$", re.IGNORECASE)
_MOST_FIELDS = 20  # that are looked at; those at the end may be missing


class _Number(NamedTuple):
    """Place of a number in a sentence; `nmea0183.toml` explains the words."""

    at: int
    unit: str
    side: int | None = None
    when: Mapping[str, str] = {}

    def counts(self, fields: Sequence[str]) -> bool:
        """Return whether the letters beside a number say that it counts."""
        has_side = self.side is None or fields[self.side] in _SIGNS
        return has_side and all(
            fields[int(at)] in letters for at, letters in self.when.items()
        )


_TABLE = shipped_toml("shipgym.trials.readers", "nmea0183.toml")
#: Numbers of each kind of sentence by channel.
_NUMBERS: dict[str, dict[str, _Number]] = {
    kind: {
        channel: _Number(
            **place | {"when": place.get("when", {}) | entry.get("status", {})}
        )
        for channel, place in entry.items()
        if channel not in ("status", "time", "date", "day")
    }
    for kind, entry in _TABLE.items()
}
_SENTENCE = re.compile(
    rf"\$([A-Za-z0-9]{{2}}(?:{'|'.join(_TABLE)}|XDR),[^$!\\\"\r\n*]*)"
    r"(\*[^,;\s\"$!\\]{0,2})?"
)


class _Found(NamedTuple):
    """A sentence as it stands in a log."""

    line: int
    text: str
    checksum: str  # behind a star; empty without one

    @property
    def source(self) -> str:
        """Talker and kind."""
        return self.text[:5]

    @property
    def shape(self) -> tuple[bool, int]:
        """Whether it has a checksum, and its number of commas."""
        return bool(self.checksum), self.text.count(",")


def hear_sentences(lines: Sequence[str], heard: Heard) -> None:
    """Take times and channels out of the sentences of a log.

    A sentence without a checksum is damaged where most of its source have one, or
    another number of fields.
    """
    found = _find(lines, heard)
    shapes: dict[str, Counter[tuple[bool, int]]] = defaultdict(Counter)
    for one in found:
        shapes[one.source][one.shape] += 1
    usual = {source: shape.most_common(1)[0][0] for source, shape in shapes.items()}
    lacking = 0
    without_status: list[str] = []
    for one in found:
        kind = one.source[2:]
        given = [field.strip() for field in one.text.split(",")[1:]]
        fields = given + [""] * _MOST_FIELDS
        try:
            if not one.checksum and one.shape != usual[one.source]:
                raise ValueError("expected a checksum, or as many fields as usual")
            summed = NMEASentence.checksum(one.text)
            if one.checksum and int(one.checksum[1:], 16) != summed:
                raise ValueError("expected another checksum")
            numbers = _transducers(fields) if kind == "XDR" else _numbers(kind, fields)
            time = _time(kind, fields)
        except ValueError:
            heard.damage(one.line)
            continue
        lacking += not one.checksum
        if numbers and _lacks_status(kind, fields):
            without_status.append(one.source)
        heard.hear(one.line, one.source, numbers, time)
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
        matches = [*_SENTENCE.finditer(line)] if "$" in line else []
        found += [_Found(number, match[1], match[2] or "") for match in matches]
        if matches:
            before, after = line[: matches[0].start()], line[matches[-1].end() :]
            heard.stamp(number, before or after)
    return found


def _lacks_status(kind: str, fields: Sequence[str]) -> bool:
    """Return whether a number counts whose status is empty."""
    return any(
        not fields[int(at)] and letters.startswith("A")
        for place in _NUMBERS.get(kind, {}).values()
        if fields[place.at]
        for at, letters in place.when.items()
    )


def _numbers(kind: str, fields: Sequence[str]) -> dict[str, float]:
    """Numbers of a sentence by channel, in SI units, positions in degrees.

    Raises ValueError where one is broken.
    """
    numbers = {}
    for channel, place in _NUMBERS[kind].items():
        is_there = fields[place.at] != ""
        if is_there and place.counts(fields):
            numbers[channel] = _number(fields, place)
    return numbers


def _number(fields: Sequence[str], place: _Number) -> float:
    text, unit = fields[place.at], place.unit
    value = float(text)
    if not isfinite(value):
        raise ValueError(f"expected a finite number, got {text}")
    if unit == "ddmm.mm":  # 5430.5 is 54 degrees and 30.5 minutes
        degrees, minutes = divmod(value, 100.0)
        if not minutes < 60.0 or value < 0.0:
            raise ValueError(f"expected degrees and minutes below 60, got {text}")
        value = degrees + minutes / 60.0
    else:
        value *= _FACTORS[unit]
    return value if place.side is None else copysign(value, _SIGNS[fields[place.side]])


def _transducers(fields: Sequence[str]) -> dict[str, float]:
    """Rudder angles among the transducers of a sentence, rad.

    Each has four fields: type (A: an angle), value, unit (D: degrees) and name.
    """
    values = {}
    for at in range(0, len(fields) - 3, 4):
        kind, value, unit, name = fields[at : at + 4]
        if kind == "A" and unit in ("D", "") and value and _RUDDER.search(name):
            channel = "port" if _PORT_RUDDER.search(name) else "delta"
            values[channel] = DEGREE * float(value)
    return values


def _time(kind: str, fields: Sequence[str]) -> float:
    """Seconds since 1970 with a date, else of the day; nan without a time."""
    places = _TABLE.get(kind, {})
    match = _TIME.fullmatch(fields[places["time"]]) if "time" in places else None
    if match is None:
        return nan
    hours, minutes, seconds = map(float, match.groups())
    of_day = 3600.0 * hours + 60.0 * minutes + seconds
    date = fields[places["date"]] if "date" in places else ""
    if "day" in places:
        day, month, year = fields[places["day"] :][:3]
        date = f"{day}{month}{year[2:]}"
    if not date:
        return of_day
    moment = datetime.strptime(date, "%d%m%y").replace(tzinfo=UTC)
    return moment.timestamp() + of_day
