"""Sentences of NMEA 0183 in a log, of any talkers: position, motion, rudder and wind.

The sentences stand in `shipgym/trials/nmea.toml`; those without channel and time (AIS,
depth, satellites) are passed over.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from shipgym.trials.nmea import (
    NMEA_QUANTITIES,
    NMEA_SENTENCES,
    Sentence,
    lacks_status,
    logged_numbers,
    parse_sentence,
)
from shipgym.trials.readers.messages import WINDS, Heard, Value, port_source
from shipgym.trials.units import DEGREE

#: Kinds of sentences that hold a time or a channel; XDR holds what its names say.
_KINDS = ["XDR"]
for _kind, _sentence in NMEA_SENTENCES.items():
    _quantities = [NMEA_QUANTITIES[quantity] for quantity in _sentence.log_fields]
    _has_channel = any(quantity.channel for quantity in _quantities)
    if _has_channel or _sentence.time is not None:
        _KINDS.append(_kind)
_SENTENCE = re.compile(
    rf"\$[A-Z][A-Z0-9](?:{'|'.join(_KINDS)}),[^$!\\\"\r\n*]*"
    r"(?:\*[^,;\s\"$!\\]{0,2})?"
)
_TIME = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d*)?)")
#: Names of transducers that show a rudder, and that of the port one.
_RUDDER = re.compile(r"RUD|RSA|HELM", re.IGNORECASE)
_PORT_RUDDER = re.compile(r"PORT|[_ ]P$|[_ ]BB$", re.IGNORECASE)


class _Found(NamedTuple):
    """A sentence as it stands in a log."""

    line: int
    source: str  # talker and kind
    text: str


class _Usual(NamedTuple):
    """What most sentences of a source have."""

    has_checksum: bool
    commas: int


class _Said(NamedTuple):
    """Contents of a sentence."""

    time: float  # nan without one
    values: dict[str, float]  # by channel, of a port rudder by "port"
    lacks_status: bool


def hear_sentences(lines: Sequence[str], heard: Heard, *, strict: bool) -> None:
    """Take times and channels out of the sentences of a log.

    A sentence without a checksum is damaged where most of its source have one, or
    another number of fields; with `strict` in any case.
    """
    found = _find(lines, heard)
    usual = _usual(found)
    without_checksum: list[str] = []
    without_status: list[str] = []
    for one in found:
        expected = usual[one.source]
        may_lack = not strict and not expected.has_checksum
        lacks = "*" not in one.text
        is_whole = one.text.count(",") == expected.commas
        try:
            if lacks and not (may_lack and is_whole):
                raise ValueError("expected a checksum, or as many fields as usual")
            said = _said(parse_sentence(one.text, needs_checksum=not may_lack))
        except ValueError:
            heard.count += 1
            heard.damaged.append(one.line)
            continue

        port = said.values.pop("port", None)
        heard.hear(one.line, one.source, said.values, said.time)
        if port is not None:
            heard.channels["delta"][port_source(one.source)].append(
                Value(one.line, said.time, port)
            )
        if lacks:
            without_checksum.append(one.source)
        if said.lacks_status:
            without_status.append(one.source)
    _note_lacks(heard, len(found), without_checksum, without_status)


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


def _usual(found: Sequence[_Found]) -> dict[str, _Usual]:
    """What most sentences have, by source."""
    texts = defaultdict(list)
    for one in found:
        texts[one.source].append(one.text)
    usual = {}
    for source, of_source in texts.items():
        with_checksum = sum("*" in text for text in of_source)
        commas = Counter(text.count(",") for text in of_source)
        ((most, _),) = commas.most_common(1)
        usual[source] = _Usual(
            has_checksum=with_checksum > 0.5 * len(of_source),
            commas=most,
        )
    return usual


def _note_lacks(
    heard: Heard, count: int, checksums: list[str], statuses: list[str]
) -> None:
    if checksums:
        heard.notes.append(
            f"{len(checksums)} of {count} sentences have no checksum: nothing protects"
            ' them from damage on the way (checksums = "required" in [sensors] refuses'
            " them)"
        )
    if statuses:
        sources = ", ".join(sorted(set(statuses)))
        heard.notes.append(
            f"the status in {len(statuses)} sentences of {sources} is empty; their"
            " values are taken"
        )


def _said(sentence: Sentence) -> _Said:
    """Times and channels of a sentence.

    Raises ValueError where a number is broken.
    """
    if sentence.kind == "XDR":
        values = _transducer_values(sentence.fields)
        return _Said(time=np.nan, values=values, lacks_status=False)
    numbers = logged_numbers(sentence)
    lacks = any(lacks_status(sentence, quantity) for quantity in numbers)
    return _Said(
        time=_time(sentence),
        values=_channel_values(numbers),
        lacks_status=lacks,
    )


def _transducer_values(fields: Sequence[str]) -> dict[str, float]:
    """Rudder angles among the transducers of a sentence, rad.

    Each has four fields: type (A: an angle), value, unit (D: degrees) and name.
    """
    values = {}
    last = len(fields) - 3
    for at in range(0, last, 4):
        kind, value, unit, name = fields[at : at + 4]
        is_angle = kind == "A" and unit in ("D", "")
        if not is_angle or not value or not _RUDDER.search(name):
            continue
        channel = "delta"
        if _PORT_RUDDER.search(name):
            channel = "port"
        values[channel] = DEGREE * float(value)
    return values


def _time(sentence: Sentence) -> float:
    """Seconds since 1970 with a date, else of the day; nan without a time."""
    kind = NMEA_SENTENCES[sentence.kind]
    match = _TIME.fullmatch(_field(sentence, kind.time))
    if match is None:
        return np.nan
    hours, minutes, seconds = map(float, match.groups())
    of_day = 3600.0 * hours + 60.0 * minutes + seconds

    date, form = _field(sentence, kind.date), "%d%m%y"
    if kind.day is not None:
        day_month_year = sentence.fields[kind.day : kind.day + 3]
        date, form = "-".join(day_month_year).strip("-"), "%d-%m-%Y"
    if not date:
        return of_day
    midnight = datetime.strptime(date, form)
    midnight = midnight.replace(tzinfo=UTC)
    return midnight.timestamp() + of_day


def _field(sentence: Sentence, at: int | None) -> str:
    """The field at a place; empty where a sentence is shorter or has no such field."""
    if at is None or at >= len(sentence.fields):
        return ""
    return sentence.fields[at]


def _channel_values(numbers: dict[str, float]) -> dict[str, float]:
    """Values by channel, positions in degrees; winds from the bow by quantity."""
    values = {}
    for quantity, number in numbers.items():
        channel = NMEA_QUANTITIES[quantity].channel
        if quantity in WINDS or quantity == "variation":
            values[quantity] = number
        elif quantity == "port_rudder":
            values["port"] = number
        elif quantity == "compass_heading":
            by_compass = number + numbers.get("deviation", 0.0)
            if "variation" in numbers:
                values.setdefault("psi", by_compass + numbers["variation"])
            else:
                values["psi_magnetic"] = by_compass
        elif channel in ("lat", "lon"):
            values[channel] = float(np.degrees(number))
        elif channel is not None:
            values[channel] = number
    return values
