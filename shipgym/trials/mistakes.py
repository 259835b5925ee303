"""Mistakes that bridge logs are full of, each found by what the channels say of each other, and named.

What cannot be right is an InputError with the line to write; what may be is a remark of the trial.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Source
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import Instruments, heading_offset, straight_parts

if TYPE_CHECKING:
    from pathlib import Path

DEGREE = math.pi / 180.0
#: Faster than any ship, m/s; slower than any manoeuvre over ground, m/s.
FASTEST, SLOWEST = 50.0, 0.3
_SHARE_OF_TWO = 0.1  # of steps faster than any ship: two ships in turn, not outliers
_SAME, _CONTRADICTION, _COMPASS = 0.3 * DEGREE, 25.0 * DEGREE, 2.0 * DEGREE
_TURNED = 20.0 * DEGREE
_HALF_HOUR, _DAY_HALVES = 1800.0, 26


def find_outliers(
    t: Floats, local: npt.NDArray[np.float64], source: Source, rows: npt.NDArray[np.intp]
) -> npt.NDArray[np.intp]:
    """Rows whose positions no ship reaches from those before and after; time in s, `local` in m, (2, n).

    Raises InputError where there are so many that two ships must be in the log.
    """
    if t.size < 3:
        return rows[:0]
    fast = np.hypot(*np.diff(local)) > FASTEST * np.maximum(np.diff(t), 0.1)
    if np.mean(fast) > _SHARE_OF_TWO:
        k = int(np.argmax(fast))
        raise InputError(
            f"{source.at(int(rows[k + 1]), 'lat')}: the position jumps "
            f"{np.hypot(*np.diff(local)[:, k]) / 1000.0:.4g} km "
            f"within {t[k + 1] - t[k]:g} s, as {int(fast.sum())} others of {fast.size} do, expected the "
            "track of one "
            "ship; likely two ships or receivers in one log, keep the rows of one, or a wrong unit of lat "
            "and lon"
        )
    return rows[np.flatnonzero(np.r_[fast, True] & np.r_[True, fast])]


def check_overlap(first: float, last: float, other: Floats, paths: tuple[Path, Path], column: str) -> None:
    """Refuse files of one trial that were not logged at the same time, s; `other`: the second's, on that "
    "clock.
    """
    if other[0] < last and other[-1] > first:
        return
    middle = 0.5 * (other[0] + other[-1]) - 0.5 * (first + last)
    shift = _HALF_HOUR * round(middle / _HALF_HOUR)
    fits = (
        other[0] - shift < last and other[-1] - shift > first and 0 < abs(shift) <= _DAY_HALVES * _HALF_HOUR
    )
    sign, minutes = "+" if shift > 0 else "-", int(abs(shift) // 60)
    zone = f"{sign}{minutes // 60:02d}:{minutes % 60:02d}"
    remedy = (
        f'likely its clock is in another time zone: write t = {{ column = "{column}", zone = "{zone}" }} in '
        "a "
        "file's own columns, or shift its times"
        if fits
        else "name the files of one trial only"
    )
    raise InputError(
        f"{paths[1]}: begins {other[0] - first:.6g} s after {paths[0]} and does not overlap with it, "
        "expected "
        f"files of one time; {remedy}"
    )


def check_log(
    t: Floats, values: Mapping[str, Floats], tools: Instruments, source: Source, gnss: bool
) -> list[str]:
    """Compare heading with course over ground, and look for a ship at berth; remarks on what may be wrong.

    The channels are as logged, in SI units, the heading without jumps; only those of GNSS are looked at: speed
    and course over ground, and, where they are `gnss`, positions.
    """
    path = source.table.path
    notes = []
    if "delta" not in values and gnss:
        notes.append(
            "no rudder angle (RSA) in this log: it can be looked at, but without a rudder no model of "
            "steering can "
            "be identified from it; log the rudder too"
        )
    if "ground_north" in values:
        velocity = values["ground_north"] + 1j * values["ground_east"]
    elif {"x", "y"} <= values.keys() and gnss:
        velocity = time_derivative(t, values["x"]) + 1j * time_derivative(t, values["y"])
    else:
        return notes
    fastest = float(np.quantile(np.abs(velocity), 0.95))
    if fastest < SLOWEST:
        raise InputError(
            f"{path}: the ship moves at most {fastest:.2g} m/s over ground, she lies at berth or at anchor, "
            "expected "
            "a manoeuvre; read another log, or name the stretch under way: cut = [[from, to]] in [[trials]]"
        )
    if "psi" in values:
        notes += _compared(t, values, velocity, tools, source)
    return notes


def _compared(
    t: Floats,
    values: Mapping[str, Floats],
    velocity: npt.NDArray[np.complex128],
    tools: Instruments,
    source: Source,
) -> list[str]:
    """Heading beside course over ground."""
    head = f"{source.table.path}: column '{source.columns['psi'].name}' (heading)"
    moving = np.abs(velocity) > max(SLOWEST, 0.3 * float(np.quantile(np.abs(velocity), 0.95)))
    psi, course = values["psi"][moving], np.angle(velocity[moving])
    apart, mirrored = (np.exp(1j * (course - sign * psi)) for sign in (1.0, -1.0))
    mean = float(np.angle(apart.mean()))
    turned = float(np.ptp(psi))
    if turned > _TURNED and abs(mean) < _SAME and np.sqrt(np.mean(np.angle(apart) ** 2)) < _SAME:
        raise InputError(
            f"{head} is the course over ground, with which it agrees within 0.3 deg in a turn of "
            f"{turned / DEGREE:.0f} deg, where a ship drifts; name the gyro's column: psi = "
            f'{{ column = "..." }}'
        )
    if turned > _TURNED and abs(mirrored.mean()) > 0.95 > abs(apart.mean()) + 0.05:
        raise InputError(
            f"{head} contradicts the course over ground: it turns the other way, expected degrees clockwise "
            "from "
            "north; change its sign in the file"
        )
    if abs(mean) > _CONTRADICTION and abs(apart.mean()) > 0.7 and not tools.heading_offset:
        raise InputError(
            f"{head} contradicts the course over ground by {-mean / DEGREE:.0f} deg, expected the true "
            "heading "
            "clockwise from north; name the right column, or write heading_offset_deg = "
            f"{-mean / DEGREE:.0f} in "
            "[sensors]"
        )
    offset = None
    if not tools.heading_offset and "ground_north" in values:
        offset = heading_offset(values, straight_parts(t, values["psi"], values.get("delta")))
    if offset is not None and abs(offset[0]) > max(_COMPASS, 4.0 * offset[1]):
        degrees = offset[0] / DEGREE
        return [
            f"the heading shows {degrees:.1f} deg too much on every course, as a magnetic compass or a gyro "
            "that is "
            f"not aligned does; to take it out write heading_offset_deg = {degrees:.1f} in [sensors]"
        ]
    if "mag" in source.columns["psi"].name.lower():
        return [
            "the heading's column is called magnetic; write the variation as heading_offset_deg in [sensors]"
        ]
    return []
