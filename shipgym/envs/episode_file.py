"""The episode file: JSON, versioned, written whole or not at all, validated field by field on reading.

Format 1:

    format       1
    kind         "episode"
    environment  {"id": text, "arguments": {name: value}}
    model        name of the ship model
    seed         whole number or null: the last reset with a seed; "number" counts the episodes since then
    number       whole number
    dt           control interval, s
    ship         {"length": m, "beam": m or null, "rudder_limit": rad}
    path         null or {"waypoints": [[north, east], ...] in m, "corridor": half its width in m or null}
    states       {name: n + 1 values}, SI units: at the beginning and after each of the n steps
    commands     {"delta": n values in rad, "n": n values in 1/s}, of each step; what is not known is absent
    actions      n rows, as the agent gave them
    rewards      n values
    reward_parts {name: n values}
    info         {name: n + 1 values}: what else was told, at the beginning and after each step
    outcome      {"terminated": bool, "truncated": bool, "success": bool or null}
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from shipgym.checks import check_keys, check_table, quoted
from shipgym.envs.episode import Episode
from shipgym.errors import InputError
from shipgym.files import read_json, write_text

FORMAT = 1
KIND = "episode"
REMEDY = "record the episode again or take another copy"
FIELDS = (
    "format", "kind", "environment", "model", "seed", "number", "dt", "ship", "path", "states", "commands",
    "actions", "rewards", "reward_parts", "info", "outcome",
)  # fmt: skip


def save(episode: Episode, path: Path) -> None:
    """Write an episode file: to a temporary name, then renamed."""
    write_text(json.dumps(episode_fields(episode), allow_nan=False) + "\n", path)


def episode_fields(episode: Episode) -> dict[str, Any]:
    """What an episode file holds, ready for JSON."""
    path = None
    if episode.waypoints is not None:
        path = {"waypoints": episode.waypoints.tolist(), "corridor": episode.corridor}
    return {
        "format": FORMAT,
        "kind": KIND,
        "environment": {"id": episode.environment, "arguments": dict(episode.arguments)},
        "model": episode.model,
        "seed": episode.seed,
        "number": episode.number,
        "dt": episode.dt,
        "ship": {
            "length": episode.length,
            "beam": episode.beam,
            "rudder_limit": episode.rudder_limit,
        },
        "path": path,
        "states": _lists(episode.states),
        "commands": _lists(episode.commands),
        "actions": episode.actions.tolist(),
        "rewards": episode.rewards.tolist(),
        "reward_parts": _lists(episode.reward_parts),
        "info": _lists(episode.info),
        "outcome": {
            "terminated": episode.terminated,
            "truncated": episode.truncated,
            "success": episode.success,
        },
    }


def load(path: Path) -> Episode:
    """Read and validate an episode file."""
    content = read_json(path, "episode file", REMEDY)
    try:
        return _episode(content)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _episode(content: Mapping[str, Any]) -> Episode:
    if content.get("kind") != KIND:
        raise InputError(
            f"kind: {content.get('kind')!r} found, expected {KIND!r}: a file that RecordEpisode wrote"
        )
    if content.get("format") != FORMAT:
        raise InputError(
            f"format: {content.get('format')!r} found, this version of shipgym reads format {FORMAT}"
        )
    _exactly(content, FIELDS, "episode file")
    environment = _fields(content, "environment", ("id", "arguments"))
    ship = _fields(content, "ship", ("length", "beam", "rudder_limit"))
    outcome = _fields(content, "outcome", ("terminated", "truncated", "success"))
    path: Mapping[str, Any] = {"waypoints": None, "corridor": None}
    if content["path"] is not None:
        path = _fields(content, "path", ("waypoints", "corridor"))
        _check_numbers(path["waypoints"], "path.waypoints")
    for name in ("actions", "rewards"):
        _check_numbers(content[name], name)
    for group in ("states", "commands", "reward_parts", "info"):
        for name, values in check_table(content[group], group).items():
            _check_numbers(values, f"{group}.{name}")
    return Episode(
        environment=environment["id"],
        arguments=environment["arguments"],
        **{name: content[name] for name in ("model", "seed", "number", "dt", "states", "commands")},
        **{name: content[name] for name in ("actions", "rewards", "reward_parts", "info")},
        **ship,
        **path,
        **outcome,
    )


def _fields(content: Mapping[str, Any], name: str, keys: Collection[str]) -> Mapping[str, Any]:
    """A table within the file that has just these keys."""
    table = check_table(content[name], name)
    _exactly(table, keys, name)
    return table


def _exactly(table: Mapping[str, Any], keys: Collection[str], where: str) -> None:
    check_keys(table, keys, where)
    for key in keys:
        if key not in table:
            raise InputError(f"{where}: '{key}' is missing, expected {quoted(keys)}")


def _check_numbers(value: Any, where: str) -> None:
    """Refuse what NumPy would take for numbers: texts and truth values."""
    if not isinstance(value, list):
        raise InputError(f"{where}: {value!r} found, expected a list")
    for i, entry in enumerate(value):
        if isinstance(entry, list):
            _check_numbers(entry, f"{where}[{i}]")
        elif isinstance(entry, bool) or not isinstance(entry, (int, float)):
            raise InputError(f"{where}[{i}]: {entry!r} found, expected a number")


def _lists(arrays: Mapping[str, Any]) -> dict[str, list[float]]:
    return {name: values.tolist() for name, values in arrays.items()}
