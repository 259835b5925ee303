"""Episode file: JSON, versioned, validated field by field on reading.

Format 1:

- `format`: 1
- `kind`: "episode"
- `environment`: {"id": text, "arguments": {name: value}}
- `model`: name of the ship model
- `seed`: integer or null: the last reset with a seed; `number`, an integer, counts the
  episodes since then
- `dt`: control interval, s
- `ship`: {"length": m, "beam": m or null, "rudder_limit": rad}
- `path`: null or {"waypoints": [[north, east], ...] in m, "corridor": half its width in
  m or null}, and "turn_radius" in m where its turns are arcs
- `states`: {name: n + 1 values}, SI units: at the beginning and after each of the n
  steps
- `commands`: {"delta": n values in rad, "n": n values in 1/s}, of each step; what is
  not known is absent
- `actions`: n rows, as the agent gave them
- `rewards`: n values; `reward_parts`: {name: n values}
- `info`: {name: n + 1 values}: what else it reported, at the beginning and after each
  step
- `outcome`: {"terminated": bool, "truncated": bool, "success": bool or null}
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from shipgym.checks import (
    check_array,
    check_format,
    check_keys,
    check_table,
)
from shipgym.errors import InputError

FORMAT = 1
KIND = "episode"

#: Tables of the file, with the name of each of their fields in an episode.
TABLES = {
    "environment": {"id": "environment", "arguments": "arguments"},
    "ship": {name: name for name in ("length", "beam", "rudder_limit")},
    "path": {name: name for name in ("waypoints", "corridor", "turn_radius")},
    "outcome": {name: name for name in ("terminated", "truncated", "success")},
}
SERIES = ("states", "commands", "reward_parts", "info")
#: Fields that are the same in the file as in an episode.
PLAIN = ("model", "seed", "number", "dt", *SERIES, "actions", "rewards")


def to_file(episode: Mapping[str, Any]) -> dict[str, Any]:
    """Content of an episode file, ready for JSON, from an episode's fields by name."""
    values = {name: _listed(value) for name, value in episode.items()}
    content: dict[str, Any] = {"format": FORMAT, "kind": KIND}
    for table, names in TABLES.items():
        content[table] = {key: values[name] for key, name in names.items()}
    if values["waypoints"] is None:
        content["path"] = None
    elif values["turn_radius"] is None:
        del content["path"]["turn_radius"]
    for name in PLAIN:
        content[name] = values[name]
    return content


def from_file(content: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of an episode by name, from the content of an episode file.

    Raises InputError for another kind of file or format, a field that is missing,
    unknown or not of numbers.
    """
    kind = content.get("kind")
    if kind != KIND:
        raise InputError(
            f"kind: expected {KIND!r}, got {kind!r}; choose a file that RecordEpisode"
            " wrote"
        )
    check_format(content, FORMAT, KIND)
    known = ("format", "kind", *TABLES, *PLAIN)
    check_keys(content, known, KIND, required=known)

    values = {name: content[name] for name in PLAIN}
    for table, names in TABLES.items():
        if table == "path" and content[table] is None:
            continue
        required = [key for key in names if key != "turn_radius"]
        found = check_table(content[table], table, names, required)
        for key, value in found.items():
            values[names[key]] = value

    values["rewards"] = check_array(content["rewards"], (None,), "rewards")
    values["actions"] = check_array(content["actions"], (None, None), "actions")
    if "waypoints" in values:
        waypoints = values["waypoints"]
        values["waypoints"] = check_array(waypoints, (None, 2), "path.waypoints")
    for group in SERIES:
        values[group] = {}
        for name, numbers in check_table(content[group], group).items():
            values[group][name] = check_array(numbers, (None,), f"{group}.{name}")
    return values


def _listed(value: Any) -> Any:
    """Arrays as lists, also within a mapping."""
    if isinstance(value, Mapping):
        return {key: _listed(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value
