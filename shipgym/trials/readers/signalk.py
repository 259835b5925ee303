"""Deltas of Signal K in a log, one JSON object a line."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
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
        except (ValueError, TypeError, AttributeError, KeyError):
            heard.damage(number)

    own = _own_context(deltas.values())
    others = 0
    for number, delta in deltas.items():
        if delta.get("context", own) == own:
            _hear(number, delta, heard)
        else:
            others += 1
    if others:
        heard.notes.append(f"{others} deltas of other vessels than {own} left out")


def _delta(line: str) -> dict[str, Any]:
    """The object in a line, of which the values can be read."""
    begin, end = line.index("{"), line.rindex("}") + 1
    delta: dict[str, Any] = json.loads(line[begin:end])
    list(_values(delta))
    return delta


def _own_context(deltas: Iterable[Mapping[str, Any]]) -> str:
    """The vessel that logs: "self", or whose rudder is told, or with most data."""
    counts = Counter[str]()
    for delta in deltas:
        has_rudder = any(path == "steering.rudderAngle" for path, *_ in _values(delta))
        counts[delta.get("context", "vessels.self")] += 1 + 1000 * has_rudder
    if not counts or "vessels.self" in counts:
        return "vessels.self"
    return max(counts, key=counts.__getitem__)


def _values(delta: Mapping[str, Any]) -> Iterator[tuple[str, Any, Mapping[str, Any]]]:
    """Path, content and update of each value."""
    for update in delta["updates"]:
        for value in update.get("values", []):
            if "path" in value:
                yield value["path"], value.get("value"), update


def _hear(line: int, delta: Mapping[str, Any], heard: Heard) -> None:
    """Add the channels of a delta, each path a source of its own."""
    for path, content, update in _values(delta):
        numbers: dict[str, Any] = {_PATHS.get(path, ""): content}
        if path == "navigation.position" and isinstance(content, dict):
            numbers = {"lat": content.get("latitude"), "lon": content.get("longitude")}
        is_known = "" not in numbers
        if is_known and all(_is_number(one) for one in numbers.values()):
            source = update.get("$source", update.get("source"))
            if isinstance(source, dict):
                source = f"{source.get('label')}.{source.get('src')}"
            time = _time(update.get("timestamp"))
            heard.hear(line, f"{path} of {source}", numbers, time)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and bool(np.isfinite(value))


def _time(text: Any) -> float:
    """Seconds since 1970; nan where there is no time."""
    try:
        moment = datetime.fromisoformat(str(text))
    except ValueError:
        return np.nan
    return moment.replace(tzinfo=moment.tzinfo or UTC).timestamp()
