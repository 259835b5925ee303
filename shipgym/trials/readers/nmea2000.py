"""Messages of NMEA 2000 in a log: as canboat prints them, or as raw frames.

The messages (PGNs) stand in `shipgym/trials/nmea2000.toml`. Raw frames are decoded by
the package `nmea2000`, which has canboat's tables and knows the forms of recorders.
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from shipgym.extras import library
from shipgym.files import shipped_toml
from shipgym.trials.readers.messages import RAW_FRAME, Heard, port_source
from shipgym.trials.units import DEGREE, KNOT

_FACTORS = {"deg": DEGREE, "deg/s": DEGREE, "kn": KNOT, "kts": KNOT, "km/h": 1.0 / 3.6}
_PGNS: dict[str, dict[str, str]] = shipped_toml("shipgym.trials", "nmea2000.toml")
_JSON = re.compile(r"\{.*\"pgn\".*\}")
_TEXT = re.compile(
    r"\d{4}-\d\d-\d\d\S+\s+\d\s+(\d+)\s+\d+\s+(\d{5,6}) [^:=]*:\s+(.*=.*)"
)
_CANDUMP = re.compile(r"can\d+\s+([0-9A-F]{8})(?:#|\s+\[\d\]\s+)([0-9A-F ]+)")


#: Fields of a message by name, each a value and its unit, empty where it is not said;
#: ``pgn`` and ``sender`` are fields too.
_Message = dict[str, tuple[Any, str]]


def hear_pgns(lines: Sequence[str], heard: Heard) -> None:
    """Take channels and times out of the messages of a log.

    Raises InputError where raw frames need the package `nmea2000` and it is missing.
    """
    messages: dict[int, _Message] = {}
    decoder = None
    for number, line in enumerate(lines, start=1):
        if "$" in line or '"updates"' in line:
            continue
        raw = RAW_FRAME.search(line)
        if raw and decoder is None:
            module = library(
                "nmea2000.decoder", "nmea2000", "which decodes raw NMEA 2000"
            )
            known = [int(pgn) for pgn in _PGNS]
            decoder = module.NMEA2000Decoder(units="si", include_pgns=known)
        try:
            frame = line[raw.start() :].strip() if raw else ""
            message = _decoded(decoder, frame) if raw else _printed(line)
        except (ValueError, LookupError, AttributeError):
            heard.damage(number)
            continue
        if message is not None and message["pgn"][0] in _PGNS:
            messages[number] = message
            before, *_ = line.partition('"fields"')
            heard.stamp(number, before[:200])

    unit = _angle_unit(messages.values())
    if unit == "rad":
        heard.notes.append(
            "angles of NMEA 2000 are in rad: none of heading and course exceeds 2 pi"
        )
    for number, message in messages.items():
        pgn, _ = message["pgn"]
        source = f"PGN {pgn} of {message['sender'][0]}"
        if pgn == "127245" and _number(_value(message, "instance")) == 1.0:
            source = port_source(source)
        heard.hear(number, source, _channels(message, unit))


def _decoded(decoder: Any, frame: str) -> _Message | None:
    """The message of a raw frame; None until all frames of a longer one are there."""
    dumped = _CANDUMP.fullmatch(frame)
    if dumped is not None:  # in each of its forms
        frame = f"(0.0) can0 {dumped[1]}#{dumped[2].replace(' ', '')}"
    decoded = decoder.decode(frame)
    if decoded is None:
        return None
    fields = {
        one.name: (one.value, one.unit_of_measurement or "SI") for one in decoded.fields
    }
    return _message(decoded.PGN, decoded.source, fields)


def _printed(line: str) -> _Message | None:
    """The message of a line that canboat printed; None for another line."""
    fields: dict[str, tuple[Any, str]] = {}
    match = _JSON.search(line)
    if match is not None:
        content = json.loads(match[0])
        for name, value in content["fields"].items():
            fields[name] = (value["name"] if isinstance(value, dict) else value, "")
        return _message(content["pgn"], content.get("src", ""), fields)
    match = _TEXT.search(line)
    if match is None:
        return None
    for field in match[3].split(";"):  # such as "Rate = 0.0934 deg/s"
        name, _, written = field.partition("=")
        value, _, unit = written.strip().partition(" ")
        is_number = _number(value) is not None
        fields[name] = (value, unit) if is_number else (written.strip(), "")
    return _message(match[2], match[1], fields)


def _message(pgn: Any, sender: Any, fields: Mapping[str, Any]) -> _Message:
    """A message with names of fields in lower case, without blanks."""
    plain = {name.replace(" ", "").lower(): field for name, field in fields.items()}
    return plain | {"pgn": (str(pgn), ""), "sender": (str(sender), "")}


def _value(message: _Message, name: str) -> Any:
    """A field without its unit; None for none."""
    return message.get(name, (None, ""))[0]


def _number(text: Any) -> float | None:
    """A field as a number; None for words and what is not available."""
    try:
        number = float(text)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None


def _angle_unit(messages: Iterable[_Message]) -> str:
    """Unit of angles without one: rad where headings and courses are that small."""
    largest = 0.0
    for message in messages:
        for name in ("heading", "cog"):
            value, unit = message.get(name, (None, ""))
            angle = _number(value)
            if angle is None or unit:
                continue
            largest = max(largest, angle)
    return "rad" if 0.0 < largest < 6.3 else "deg"


def _channels(message: _Message, angle_unit: str) -> dict[str, float]:
    """Channels of a message, SI units; headings by the reference it names."""
    if _value(message, "cogreference") == "Magnetic":
        return {}
    values = {}
    for name, channel in _PGNS[_value(message, "pgn")].items():
        value, unit = message.get(name, (None, ""))
        number = _number(value)
        if number is not None:
            is_speed = channel in ("sog", "stw")
            unit = unit or ("m/s" if is_speed else angle_unit)
            is_place = channel in ("lat", "lon")
            values[channel] = number * (1.0 if is_place else _FACTORS.get(unit, 1.0))
    reference = _value(message, "reference")
    deviation = values.pop("deviation", 0.0)
    if "heading" in values:
        heading = values.pop("heading")
        values |= (
            {"psi": heading}
            if reference == "True"
            else {"psi_magnetic": heading + deviation}
        )
    return values
