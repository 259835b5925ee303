"""Sentences of NMEA 0183 in a log, of any talkers: position, motion, rudder and wind.

The sentences stand in `nmea0183.toml`; those without channel and time (AIS, depth,
satellites) are passed over.
"""

import re
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from math import copysign, isfinite, nan
from typing import NamedTuple

from pynmea2 import NMEASentence

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
_MOST_FIELDS = 20  # that are looked at; those at the end may be missing


class _Number(NamedTuple):
    """Place of a number in a sentence; `nmea0183.toml` explains the words."""

    at: int
    unit: str
    side: int | None
    letters: dict[int, str]  # with which it counts, by place
    required: set[int]  # places that must have one

    def counts(self, fields: Sequence[str]) -> bool:
        """Return whether the letters beside a number say that it counts."""
        return all(
            fields[at] in (*letters,) or not (fields[at] or at in self.required)
            for at, letters in self.letters.items()
        )


def _number_at(text: str) -> _Number:
    at, unit, *words = text.split()
    side = None
    if words and words[0].isdigit():
        side = int(words[0])
        words[0] += ":NSEW"
    letters = {int(at): allowed for at, _, allowed in map(_parted, words)}
    required = {int(at) for at, sign, _ in map(_parted, words) if sign == ":"}
    return _Number(int(at), unit, side, letters, required)


def _parted(word: str) -> list[str]:
    return re.split("([=:])", word)


_TABLE = shipped_toml("shipgym.trials.readers", "nmea0183.toml")
#: Numbers of each kind of sentence by channel.
_NUMBERS: dict[str, dict[str, _Number]] = {
    kind: {
        channel: _number_at(f"{text} {entry.get('status', '')}")
        for channel, text in entry.items()
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
    shapes: dict[str, Counter[tuple[bool, int]]] = {}
    for one in found:
        shapes.setdefault(one.source, Counter())[one.shape] += 1
    usual = {source: shape.most_common(1)[0][0] for source, shape in shapes.items()}
    lacking = 0
    without_status: list[str] = []
    for one in found:
        fields = one.text.split(",")[1:]
        try:
            if not one.checksum and one.shape != usual[one.source]:
                raise ValueError("expected a checksum, or as many fields as usual")
            summed = NMEASentence.checksum(one.text)
            if one.checksum and int(one.checksum[1:], 16) != summed:
                raise ValueError("expected another checksum")
            numbers, lacks_status = _numbers(one.source[2:], fields)
            time = _time(one.source[2:], fields)
        except ValueError:
            heard.count += 1
            heard.damaged.append(one.line)
            continue
        port = numbers.pop("port", None)
        heard.hear(one.line, one.source, numbers, time)
        if port is not None:
            second = heard.channels["delta"][port_source(one.source)]
            second.append(Value(one.line, time, port))
        lacking += not one.checksum
        without_status += [one.source] * lacks_status
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


def _find(
    lines: Sequence[str],
    heard: Heard,
) -> list[_Found]:
    """Sentences of known kinds; the stamps of their lines are heard."""
    found = []
    for number, line in enumerate(lines, start=1):
        if "$" not in line:
            continue
        matches = [*_SENTENCE.finditer(line)]
        for match in matches:
            one = _Found(number, match[1], match[2] or "")
            found.append(one)
        if matches:
            before = line[: matches[0].start()]
            after = line[matches[-1].end() :]
            heard.stamp(number, before or after)
    return found


def _numbers(kind: str, given: Sequence[str]) -> tuple[dict[str, float], bool]:
    """Numbers of a sentence by channel, and whether one of them has an empty status.

    In SI units, positions in degrees. Raises ValueError where one is broken.
    """
    if kind == "XDR":
        return _transducers(given), False
    fields = [field.strip() for field in (*given, *[""] * _MOST_FIELDS)]
    numbers = {}
    lacks_status = False
    for channel, place in _NUMBERS[kind].items():
        if fields[place.at] and place.counts(fields):
            numbers[channel] = _number(fields, place)
            lacks_status |= any(
                not fields[at] and letters.startswith("A")
                for at, letters in place.letters.items()
            )
    # a heading by compass with its deviation, and true if the variation is known
    deviation = numbers.pop("deviation", 0.0)
    if "psi_magnetic" in numbers:
        numbers["psi_magnetic"] += deviation
        if "variation" in numbers:
            magnetic = numbers.pop("psi_magnetic")
            numbers.setdefault("psi", magnetic + numbers["variation"])
    return numbers, lacks_status


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
        if unit.startswith("@"):
            unit = _SPEED_UNITS[fields[int(unit[1:])]]
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


def _time(kind: str, given: Sequence[str]) -> float:
    """Seconds since 1970 with a date, else of the day; nan without a time."""
    places = _TABLE.get(kind, {})
    fields = [*given, *[""] * _MOST_FIELDS]
    match = _TIME.fullmatch(fields[places["time"]]) if "time" in places else None
    if match is None:
        return nan
    hours, minutes, seconds = map(float, match.groups())
    of_day = 3600.0 * hours + 60.0 * minutes + seconds
    date, form = "", "%d%m%y"
    if "date" in places:
        date = fields[places["date"]]
    if "day" in places:
        date = "-".join(fields[places["day"] :][:3]).strip("-")
        form = "%d-%m-%Y"
    if not date:
        return of_day
    return datetime.strptime(date, form).replace(tzinfo=UTC).timestamp() + of_day
