"""Headings of quaternions, and angles that count from east as those of ROS."""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.readers.log_table import LogTable

#: Last letters or numbers of the four columns: w, x, y and z of each spelling.
_SPELLINGS = (("w", "x", "y", "z"), ("0", "1", "2", "3"), ("1", "2", "3", "4"))
#: Names of messages of ROS, whose world is east, north, up, and whose bodies are
#: forward, port, up (REP 103).
_ROS = re.compile(
    r"(^|[._/])(orientation|pose|twist|angular_?velocity)[._/]", re.IGNORECASE
)


class Quaternion(NamedTuple):
    """Columns of an attitude."""

    w: str
    others: tuple[str, str, str]  # x, y and z


def quaternion(table: LogTable, free: Sequence[str]) -> Quaternion | None:
    """Columns of a quaternion: four of one name whose squares sum to 1; or None."""
    by_stem: dict[str, dict[str, str]] = {}
    for column in free:
        match = re.fullmatch(r"(.*?)[\[_.]*([wxyz0-4])\]?", column.lower())
        if match:
            stem, ending = match.groups()
            by_stem.setdefault(stem, {})[ending] = column
    for endings in by_stem.values():
        for spelling in _SPELLINGS:
            if not endings.keys() >= set(spelling):
                continue
            w, *others = (endings[one] for one in spelling)
            parts = [table.likely_numbers(name) for name in (w, *others)]
            if _are_unit([one for one in parts if one is not None]):
                x, y, z = others
                return Quaternion(w, (x, y, z))
    return None


def _are_unit(parts: Sequence[Floats]) -> bool:
    """Return whether four columns are turns: of length one, and not at rest."""
    if len(parts) != 4:
        return False
    values = np.array(parts)
    values = values[:, np.isfinite(values).all(axis=0)]
    lengths = np.sum(values**2, axis=0)
    is_unit = np.abs(lengths - 1.0) < 0.02
    moves = np.ptp(values, axis=1).max(initial=0.0) > 1e-6
    return bool(values.shape[1] >= 3 and is_unit.mean() > 0.99 and moves)


def frame_by_names(columns: Mapping[str, str]) -> str | None:
    """Why angles count from east by the names of their columns, by channel; or None."""
    for channel in ("psi", "r"):
        name = columns.get(channel, "")
        if _ROS.search(name):
            return (
                f"'{name}' is named as messages of ROS, whose angles count from east"
                " and to port; check it with a turn whose side is known"
            )
    return None
