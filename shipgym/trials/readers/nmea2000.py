"""Messages of NMEA 2000 in a log: as canboat prints them, or as raw frames.

The messages (PGNs) stand in `shipgym/trials/nmea2000.toml`. Raw frames are decoded by
the package `nmea2000`, which has canboat's tables.
"""

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from shipgym.extras import library
from shipgym.files import shipped_toml
from shipgym.trials.readers.line_stamps import read_stamps, stamp_text
from shipgym.trials.readers.messages import Heard, port_source
from shipgym.trials.units import DEGREE, KNOT

_PGNS: dict[str, dict[str, str]] = shipped_toml("shipgym.trials", "nmea2000.toml")
#: A message in a line: canboat's text, JSON and plain form, and frames by candump (with
#: # or a length in brackets), by gateways of Yacht Devices and by Actisense (sender,
#: destination and priority, PGN, data).
_FORMS = [
    re.compile(r"(?P<json>\{.*\"pgn\".*\})"),
    re.compile(
        r"(?P<stamp>\d{4}-\d\d-\d\d\S+)\s+\d\s+(?P<sender>\d+)\s+\d+\s+(?P<pgn>\d{5,6})"
        r" [^:=]*:\s+(?P<fields>.*=.*)"
    ),
    re.compile(
        r"(?P<stamp>\d{4}-\d\d-\d\d[^,\s]+),\d,(?P<pgn>\d{5,6}),(?P<sender>\d+),\d+,\d+,"
        r"(?P<data>[0-9a-fA-F]{2}(?:,[0-9a-fA-F]{2})+)"
    ),
    re.compile(
        r"(?P<stamp>\([\d.]+\))?\s*\w*can\d+\s+(?P<can_id>[0-9A-F]{8})"
        r"(?:#|\s+\[\d\]\s+)(?P<data>[0-9A-F ]+)"
    ),
    re.compile(
        r"(?P<stamp>\d\d:\d\d:\d\d\.\d+) [RT] (?P<can_id>[0-9A-F]{8})"
        r"(?P<data>(?: [0-9A-F]{2})+)"
    ),
    re.compile(
        r"(?P<stamp>A\d+\.\d+) (?P<hex_sender>[0-9A-F]{2})[0-9A-F]{3}"
        r" (?P<hex_pgn>[0-9A-F]{5}) (?P<data>[0-9A-F]+)"
    ),
]


class _Field(NamedTuple):
    """A field of a message as it is written."""

    value: Any
    unit: str  # empty where it is not said


class _Message(NamedTuple):
    """A message of a line: its PGN, the address of its sender, its fields by name."""

    line: int
    pgn: str
    sender: str
    fields: Mapping[str, _Field]  # in lower case, without blanks


_Decode = Callable[[str], Any]  # a line in canboat's plain form


def find_message(line: str) -> re.Match[str] | None:
    """Find a message of NMEA 2000 in a line, in any form; None where there is none."""
    for form in _FORMS:
        match = form.search(line)
        if match is not None:
            return match
    return None


def hear_pgns(lines: Sequence[str], heard: Heard) -> None:
    """Take channels and times out of the messages of a log.

    Raises InputError where raw frames need the package `nmea2000` and it is missing.
    """
    messages: list[_Message] = []
    decode: _Decode | None = None
    for number, line in enumerate(lines, start=1):
        if "$" in line or '"updates"' in line:
            continue
        match = find_message(line)
        if match is None:
            continue
        found = match.groupdict()
        if "data" in found and decode is None:
            decode = _decoder()
        try:
            message, stamp = _parsed(number, found, decode)
        except (ValueError, KeyError):
            heard.count += 1
            heard.damaged.append(number)
            continue
        if message is not None:
            messages.append(message)
            before = line[: match.start()]
            heard.stamp(number, f"{before} {stamp}")
    _hear(messages, heard)


def _decoder() -> _Decode:
    module = library("nmea2000.decoder", "nmea2000", "which decodes raw NMEA 2000")
    decode: _Decode = module.NMEA2000Decoder(units="si").decode
    return decode


def _parsed(
    number: int, found: Mapping[str, str], decode: _Decode | None
) -> tuple[_Message | None, str]:
    """The message that a line holds, and its time; None for one of no use."""
    if "json" in found:
        content = json.loads(found["json"])
        fields = {}
        for name, value in content["fields"].items():
            plain = value["name"] if isinstance(value, dict) else value
            fields[_plain(name)] = _Field(plain, unit="")
        pgn, sender = str(content["pgn"]), str(content.get("src", ""))
        stamp = str(content.get("timestamp", ""))
    elif "fields" in found:
        pgn, sender, stamp = found["pgn"], found["sender"], found["stamp"]
        fields = _fields_of_text(found["fields"])
    else:
        pgn, sender = _address(found)
        stamp = found["stamp"] or ""
        fields = {}
        if pgn in _PGNS and decode is not None:
            fields = _decoded(pgn, sender, found["data"], decode)
    if pgn not in _PGNS or not fields:
        return None, stamp
    return _Message(number, pgn, sender, fields), stamp


def _plain(name: str) -> str:
    return name.replace(" ", "").lower()


def _fields_of_text(text: str) -> dict[str, _Field]:
    """Fields of ``SID = 125; Rate = 0.0934 deg/s``."""
    fields = {}
    for field in text.split(";"):
        name, _, written = field.partition("=")
        words = written.split()
        if not words:
            continue
        if _number(words[0]) is None:
            fields[_plain(name)] = _Field(" ".join(words), unit="")
        else:
            unit = words[1] if len(words) > 1 else ""
            fields[_plain(name)] = _Field(words[0], unit)
    return fields


def _address(found: Mapping[str, str]) -> tuple[str, str]:
    """PGN and sender of a raw frame."""
    if "pgn" in found:
        return found["pgn"], found["sender"]
    if "can_id" in found:
        can_id = int(found["can_id"], 16)
        pgn = can_id >> 8 & 0x3FFFF
        sender = can_id & 0xFF
    else:
        pgn = int(found["hex_pgn"], 16)
        sender = int(found["hex_sender"], 16)
    return str(pgn), str(sender)


def _decoded(pgn: str, sender: str, data: str, decode: _Decode) -> dict[str, _Field]:
    """Fields of a raw frame; empty until all frames of a longer message are there."""
    digits = re.sub("[ ,]", "", data)
    octets = [digits[at : at + 2] for at in range(0, len(digits), 2)]
    count = len(octets)
    bytes_of_data = ",".join(octets)
    line = f"2000-01-01T00:00:00.000Z,2,{pgn},{sender},255,{count},{bytes_of_data}"
    decoded = decode(line)
    if decoded is None:
        return {}
    fields = {}
    for field in decoded.fields:
        unit = field.unit_of_measurement or "SI"
        fields[_plain(field.name)] = _Field(field.value, unit)
    return fields


def _number(text: Any) -> float | None:
    """A field as a number; None for words and what is not available."""
    try:
        number = float(text)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None


def _hear(messages: Sequence[_Message], heard: Heard) -> None:
    """Add the channels of messages, whose angles are degrees where no unit says so."""
    unit = _angle_unit(messages)
    if unit == "rad":
        heard.notes.append(
            "angles of NMEA 2000 are in rad: none of heading and course exceeds 2 pi"
        )
    for message in messages:
        numbers = {}
        for name, channel in _PGNS[message.pgn].items():
            value = _si_value(message.fields.get(name), channel, unit)
            if value is not None:
                numbers[channel] = value
        values = _channel_values(message, numbers)
        source = f"PGN {message.pgn} of {message.sender}"
        instance = message.fields.get("instance")
        is_second = instance is not None and _number(instance.value) == 1.0
        if message.pgn == "127245" and is_second:
            source = port_source(source)
        heard.hear(message.line, source, values, _time(message))


def _angle_unit(messages: Iterable[_Message]) -> str:
    """Unit of angles without one: rad where headings and courses are that small."""
    largest = 0.0
    for message in messages:
        for name in ("heading", "cog"):
            field = message.fields.get(name)
            value = None if field is None or field.unit else _number(field.value)
            largest = max(largest, value or 0.0)
    return "rad" if 0.0 < largest < 6.3 else "deg"


def _si_value(field: _Field | None, channel: str, angle_unit: str) -> float | None:
    """A field in SI units, a position in degrees; None where it has no value."""
    if field is None:
        return None
    value = _number(field.value)
    if value is None or channel in ("lat", "lon"):
        return value
    usual_unit = angle_unit
    if channel in ("sog", "stw", "speed"):
        usual_unit = "m/s"
    factors = {
        "deg": DEGREE,
        "deg/s": DEGREE,
        "kn": KNOT,
        "kts": KNOT,
        "km/h": 1.0 / 3.6,
    }
    unit = field.unit or usual_unit
    return value * factors.get(unit, 1.0)


def _channel_values(message: _Message, numbers: dict[str, float]) -> dict[str, float]:
    """Channels of a message: headings and winds by the reference that it names."""
    values = dict(numbers)
    fields = message.fields
    none = _Field("", unit="")
    reference = fields.get("reference", none).value
    heading = values.pop("heading", None)
    deviation = values.pop("deviation", 0.0)
    if heading is not None and reference == "True":
        values["psi"] = heading
    elif heading is not None:
        values["psi_magnetic"] = heading + deviation

    course_reference = fields.get("cogreference", none).value
    if course_reference == "Magnetic":
        values.pop("cog", None)
        values.pop("sog", None)

    angle = values.pop("angle", None)
    speed = values.pop("speed", None)
    winds = {"Apparent": "apparent_wind", "True (boat referenced)": "wind"}
    wind = winds.get(reference)
    if angle is not None and speed is not None and wind:
        values[f"{wind}_angle"] = angle
        values[f"{wind}_speed"] = speed
    return values


def _time(message: _Message) -> float:
    """Seconds since 1970 of a message with date and time; nan for others."""
    fields = message.fields
    if not {"date", "time"} <= fields.keys():
        return np.nan
    date = str(fields["date"].value).replace(".", "-")
    text = stamp_text(f"{date} {fields['time'].value}")
    if not text.startswith(date):
        return np.nan
    return float(read_stamps([text])[0])
