"""Deltas of Signal K in a log, one JSON object a line."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from shipgym.trials.readers.messages import Heard

#: Channels by path, in the SI units of Signal K.
_PATHS = {
    "navigation.headingTrue": "psi",
    "navigation.headingMagnetic": "psi_magnetic",
    "navigation.headingCompass": "psi_magnetic",
    "navigation.magneticVariation": "variation",
    "navigation.rateOfTurn": "r",
    "navigation.speedOverGround": "sog",
    "navigation.courseOverGroundTrue": "cog",
    "navigation.speedThroughWater": "stw",
    "steering.rudderAngle": "delta",
    "steering.rudderAngleTarget": "delta_command",
    "environment.wind.speedApparent": "apparent_wind_speed",
    "environment.wind.angleApparent": "apparent_wind_angle",
    "environment.wind.speedOverGround": "wind_speed",
    "environment.wind.angleTrueGround": "wind_angle",
}


def hear_deltas(lines: Sequence[str], heard: Heard) -> None:
    """Take times and channels of the own ship out of the deltas of a log."""
    deltas = {}
    for number, line in enumerate(lines, start=1):
        if '"updates"' not in line:
            continue
        heard.stamp(number, line[: line.index("{")])
        try:
            deltas[number] = _delta(line)
        except ValueError:
            heard.count += 1
            heard.damaged.append(number)

    own = _own_context(lines, deltas.values())
    others = 0
    for number, delta in deltas.items():
        if delta.get("context", own) != own:
            others += 1
            continue
        for update in delta["updates"]:
            _hear(number, update, heard)
    if others:
        heard.notes.append(f"{others} deltas of other vessels than {own} left out")


def _delta(line: str) -> dict[str, Any]:
    """The object in a line; ValueError for another one than a delta.

    A recorder of OpenCPN writes it as a cell, its quotes doubled.
    """
    begin = line.index("{")
    end = line.rindex("}") + 1
    text = line[begin:end]
    if '""updates""' in text:
        text = text.replace('""', '"')

    delta = json.loads(text)
    updates = delta.get("updates") if isinstance(delta, dict) else None
    if not isinstance(updates, list):
        beginning = text[:40]
        raise ValueError(f"expected a delta, got {beginning!r}")
    return dict(delta)


def _own_context(lines: Sequence[str], deltas: Any) -> str:
    """The vessel that logs: as the server says, or whose data are the most."""
    for line in lines[:10]:
        if '"self"' in line and '"updates"' not in line:
            hello = json.loads(line[line.index("{") :])
            return str(hello["self"])
    counts = Counter[str]()
    for delta in deltas:
        context = delta.get("context", "vessels.self")
        if context == "vessels.self":
            return "vessels.self"
        paths = {value["path"] for value in _values(delta["updates"])}
        own = {"steering.rudderAngle", "navigation.headingTrue"}
        counts[context] += 1 + 1000 * len(paths & own)
    ((most, _),) = counts.most_common(1) or [("vessels.self", 0)]
    return most


def _values(updates: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    for update in updates:
        for value in update.get("values", []):
            if isinstance(value, dict) and "path" in value:
                yield value


def _hear(line: int, update: Mapping[str, Any], heard: Heard) -> None:
    """Add the channels of an update, each path a source of its own."""
    time = _time(update.get("timestamp"))
    sender = _sender(update)
    for value in _values([update]):
        path, content = value["path"], value.get("value")
        if path == "navigation.position" and isinstance(content, dict):
            numbers = {
                "lat": _number(content.get("latitude")),
                "lon": _number(content.get("longitude")),
            }
        elif path in _PATHS:
            numbers = {_PATHS[path]: _number(content)}
        else:
            continue
        if np.isfinite([*numbers.values()]).all():
            heard.hear(line, f"{path} of {sender}", numbers, time)


def _time(text: Any) -> float:
    """Seconds since 1970; nan where there is no time."""
    try:
        moment = datetime.fromisoformat(str(text))
    except ValueError:
        return np.nan
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return moment.timestamp()


def _sender(update: Mapping[str, Any]) -> str:
    if "$source" in update:
        return str(update["$source"])
    source = update.get("source")
    if not isinstance(source, dict):
        return str(source)
    parts = [source.get(key) for key in ("label", "talker", "sentence", "src", "pgn")]
    return ".".join(str(part) for part in parts if part is not None)


def _number(value: Any) -> float:
    """A value as a number; nan for a word or none."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return np.nan
