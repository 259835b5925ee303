"""Messages of NMEA 2000 in a log: as canboat prints them in JSON, or as raw frames.

The messages (PGNs) stand in `shipgym/trials/nmea2000.toml`. Raw frames are decoded by
the package `nmea2000`, which has canboat's tables and knows the forms of recorders.
"""

import json
import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from shipgym.extras import library
from shipgym.files import shipped_toml
from shipgym.trials.readers.messages import RAW_FRAME, Heard
from shipgym.trials.units import DEGREE

_PGNS: dict[str, dict[str, str]] = shipped_toml("shipgym.trials", "nmea2000.toml")
_JSON = re.compile(r"\{.*\"pgn\".*\}")
_CANDUMP = re.compile(r"can\d+\s+([0-9A-F]{8})(?:#|\s+\[\d\]\s+)([0-9A-F ]+)")
_NO_ANGLES = ("lat", "lon", "sog", "stw")  # their units are always the same


class _Message(NamedTuple):
    """A message, its fields by names in lower case without blanks."""

    pgn: str
    sender: str
    fields: dict[str, Any]
    is_si: bool  # so that angles are in rad


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
        if message is not None and message.pgn in _PGNS:
            messages[number] = message
            before, *_ = line.partition('"fields"')
            heard.stamp(number, before[:200])

    factor = _angle_factor(messages.values())
    if factor == 1.0:
        heard.notes.append(
            "angles of NMEA 2000 are in rad: none of heading and course exceeds 2 pi"
        )
    for number, message in messages.items():
        source = f"PGN {message.pgn} of {message.sender}"
        own_factor = 1.0 if message.is_si else factor
        heard.hear(number, source, _channels(message, own_factor))


def _decoded(decoder: Any, frame: str) -> _Message | None:
    """The message of a raw frame; None until all frames of a longer one are there."""
    dumped = _CANDUMP.fullmatch(frame)
    if dumped is not None:  # in each of its forms
        frame = f"(0.0) can0 {dumped[1]}#{dumped[2].replace(' ', '')}"
    decoded = decoder.decode(frame)
    if decoded is None:
        return None
    fields = {_plain(one.name): one.value for one in decoded.fields}
    return _Message(str(decoded.PGN), str(decoded.source), fields, is_si=True)


def _printed(line: str) -> _Message | None:
    """The message of a line that canboat printed; None for another line."""
    match = _JSON.search(line)
    if match is None:
        return None
    content = json.loads(match[0])
    fields = {}
    for name, value in content["fields"].items():
        is_lookup = isinstance(value, dict)
        fields[_plain(name)] = value["name"] if is_lookup else value
    sender = str(content.get("src", ""))
    return _Message(str(content["pgn"]), sender, fields, is_si=False)


def _plain(name: str) -> str:
    return name.replace(" ", "").lower()


def _number(text: Any) -> float | None:
    """A field as a number; None for words and what is not available."""
    try:
        number = float(text)
    except (TypeError, ValueError):
        return None
    return number if np.isfinite(number) else None


def _angle_factor(messages: Iterable[_Message]) -> float:
    """Factor of printed angles to rad: 1 where headings and courses are that small."""
    largest = 0.0
    for message in messages:
        for name in ("heading", "cog"):
            angle = _number(message.fields.get(name))
            if angle is None or message.is_si:
                continue
            largest = max(largest, angle)
    return 1.0 if 0.0 < largest < 6.3 else DEGREE


def _channels(message: _Message, factor: float) -> dict[str, float]:
    """Channels of a message, SI units; headings by the reference it names."""
    fields = message.fields
    if fields.get("cogreference") == "Magnetic":
        return {}
    values = {}
    for name, channel in _PGNS[message.pgn].items():
        number = _number(fields.get(name))
        if number is not None:
            values[channel] = number * (1.0 if channel in _NO_ANGLES else factor)
    if "delta" in values and _number(fields.get("instance")) == 1.0:
        values["port"] = values.pop("delta")
    if "heading" in values:
        is_true = fields.get("reference") == "True"
        values["psi" if is_true else "psi_magnetic"] = values.pop("heading")
    return values
