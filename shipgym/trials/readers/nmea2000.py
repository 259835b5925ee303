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

_FACTORS = {"deg": DEGREE, "deg/s": DEGREE, "kn": KNOT, "kts": KNOT, "km/h": 1.0 / 3.6}
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


class _Message(NamedTuple):
    """A message of a line: its PGN, the address of its sender, its fields by name.

    The names are in lower case, without blanks; a field is a value and its unit, empty
    where it is not said.
    """

    line: int
    pgn: str
    sender: str
    fields: Mapping[str, tuple[Any, str]]

    def value(self, name: str) -> Any:
        """A field without its unit; None for none."""
        return self.fields.get(name, (None, ""))[0]


_Decode = Callable[[str], Any]  # a line in canboat's plain form


def hear_pgns(lines: Sequence[str], heard: Heard) -> None:
    """Take channels and times out of the messages of a log.

    Raises InputError where raw frames need the package `nmea2000` and it is missing.
    """
    messages: list[_Message] = []
    decode: _Decode | None = None
    for number, line in enumerate(lines, start=1):
        if "$" in line or '"updates"' in line:
            continue
        match = next(filter(None, (form.search(line) for form in _FORMS)), None)
        if match is None:
            continue
        found = match.groupdict()
        if "data" in found and decode is None:
            module = library(
                "nmea2000.decoder", "nmea2000", "which decodes raw NMEA 2000"
            )
            decode = module.NMEA2000Decoder(units="si").decode
        try:
            message, stamp = _parsed(number, found, decode)
        except (ValueError, KeyError):
            heard.count += 1
            heard.damaged.append(number)
            continue
        if message.pgn in _PGNS and message.fields:
            messages.append(message)
            heard.stamp(number, f"{line[: match.start()]} {stamp}")

    unit = _angle_unit(messages)
    if unit == "rad":
        heard.notes.append(
            "angles of NMEA 2000 are in rad: none of heading and course exceeds 2 pi"
        )
    for message in messages:
        source = f"PGN {message.pgn} of {message.sender}"
        if message.pgn == "127245" and _number(message.value("instance")) == 1.0:
            source = port_source(source)
        heard.hear(message.line, source, _channels(message, unit), _time(message))


def _parsed(
    number: int, found: Mapping[str, str], decode: _Decode | None
) -> tuple[_Message, str]:
    """The message that a line holds, and its time."""
    fields: dict[str, tuple[Any, str]] = {}
    if "json" in found:
        content = json.loads(found["json"])
        for name, value in content["fields"].items():
            plain_value = value["name"] if isinstance(value, dict) else value
            fields[name] = (plain_value, "")
        pgn = str(content["pgn"])
        sender = str(content.get("src", ""))
        stamp = str(content.get("timestamp", ""))
    else:
        pgn, sender = _address(found)
        stamp = found["stamp"] or ""
        if "fields" in found:
            fields = _fields_of_text(found["fields"])
        elif pgn in _PGNS and decode is not None:
            fields = _decoded(pgn, sender, found["data"], decode)
    plain = {name.replace(" ", "").lower(): field for name, field in fields.items()}
    return _Message(number, pgn, sender, plain), stamp


def _fields_of_text(text: str) -> dict[str, tuple[Any, str]]:
    """Fields of ``SID = 125; Rate = 0.0934 deg/s``."""
    fields: dict[str, tuple[Any, str]] = {}
    for field in text.split(";"):
        name, _, written = field.partition("=")
        bare = written.strip()
        value, _, unit = bare.partition(" ")
        if _number(value) is None:
            value = bare
            unit = ""
        fields[name] = (value, unit)
    return fields


def _address(found: Mapping[str, str]) -> tuple[str, str]:
    """PGN and sender of a message that is no JSON."""
    if "pgn" in found:
        return found["pgn"], found["sender"]
    if "can_id" in found:
        can_id = int(found["can_id"], 16)
        return str(can_id >> 8 & 0x3FFFF), str(can_id & 0xFF)
    return str(int(found["hex_pgn"], 16)), str(int(found["hex_sender"], 16))


def _decoded(
    pgn: str, sender: str, data: str, decode: _Decode
) -> dict[str, tuple[Any, str]]:
    """Fields of a raw frame; empty until all frames of a longer message are there."""
    octets = re.findall("..", re.sub("[ ,]", "", data))
    head = f"2000-01-01T00:00:00.000Z,2,{pgn},{sender},255,{len(octets)}"
    decoded = decode(",".join([head, *octets]))
    fields = [] if decoded is None else decoded.fields
    return {one.name: (one.value, one.unit_of_measurement or "SI") for one in fields}


def _number(text: Any) -> float | None:
    """A field as a number; None for words and what is not available."""
    try:
        number = float(text)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None


def _angle_unit(
    messages: Iterable[_Message],
) -> str:
    """Unit of angles without one: rad where headings and courses are that small."""
    without_unit = [
        _number(value) or 0.0
        for message in messages
        for name, (value, unit) in message.fields.items()
        if name in ("heading", "cog") and not unit
    ]
    return "rad" if 0.0 < max(without_unit, default=0.0) < 6.3 else "deg"


def _channels(message: _Message, angle_unit: str) -> dict[str, float]:
    """Channels of a message, SI units; headings and winds by the reference it names."""
    values = {}
    for name, channel in _PGNS[message.pgn].items():
        value, unit = message.fields.get(name, (None, ""))
        number = _number(value)
        if number is not None:
            is_angle = channel not in ("sog", "stw", "speed", "lat", "lon")
            unit = unit or (angle_unit if is_angle else "m/s")
            is_si = channel in ("lat", "lon")
            values[channel] = number * (1.0 if is_si else _FACTORS.get(unit, 1.0))
    reference = message.value("reference")
    heading = values.pop("heading", None)
    deviation = values.pop("deviation", 0.0)
    if heading is not None and reference == "True":
        values["psi"] = heading
    elif heading is not None:
        values["psi_magnetic"] = heading + deviation

    angle, speed = values.pop("angle", None), values.pop("speed", None)
    winds = {"Apparent": "apparent_wind", "True (boat referenced)": "wind"}
    if angle is not None and speed is not None and reference in winds:
        wind = winds[reference]
        values |= {f"{wind}_angle": angle, f"{wind}_speed": speed}
    if message.value("cogreference") == "Magnetic":
        return {}
    return values


def _time(message: _Message) -> float:
    """Seconds since 1970 of a message with date and time; nan for others."""
    date = str(message.value("date")).replace(".", "-")
    text = stamp_text(f"{date} {message.value('time')}")
    return float(read_stamps([text])[0]) if text.startswith(date) else np.nan
