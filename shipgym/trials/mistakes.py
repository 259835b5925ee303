"""Mistakes that bridge logs are full of, each found by what the channels say of each other, and named.

What cannot be right is an InputError with the line to write; what may be right is a remark.
"""

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Source
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import Instruments, heading_offset, straight_parts
from shipgym.trials.resampling import Log, Series

DEGREE = math.pi / 180.0
#: Faster than any ship, and slower than any manoeuvre, over ground, m/s.
FASTEST, SLOWEST = 50.0, 0.3
_MOST_OUTLIERS = 0.1  # share of the steps; more are two ships in turn
_SAME, _COMPASS, _CONTRADICTION, _TURNED = 0.3 * DEGREE, 2.0 * DEGREE, 25.0 * DEGREE, 20.0 * DEGREE
_HALF_HOUR, _LONGEST_ZONE = 1800.0, 14.0 * 3600.0
NO_RUDDER = (
    "no rudder angle in this log: without rudder nothing can be identified from it, it can only be looked "
    "at; log the rudder too (in NMEA 0183 the sentence RSA)"
)


def find_outliers(
    t: Floats, local: Floats, source: Source, rows: npt.NDArray[np.intp]
) -> npt.NDArray[np.intp]:
    """Rows whose positions no ship reaches from those beside; time in s, `local` in m, shape (2, n_rows).

    Raises InputError where there are so many that two ships must be in the log.
    """
    if t.size < 3:
        return rows[:0]
    steps = np.hypot(*np.diff(local))
    fast = steps > FASTEST * np.maximum(np.diff(t), 0.1)
    if np.mean(fast) > _MOST_OUTLIERS:
        k = int(np.argmax(fast))
        raise InputError(
            f"{source.at(int(rows[k + 1]), 'lat')}: the position jumps {steps[k] / 1000.0:.4g} km within "
            f"{t[k + 1] - t[k]:g} s, as in {int(fast.sum())} of {fast.size} steps, expected the track of one "
            "ship; likely two ships are in one log: keep the rows of one, or declare the unit of lat and lon"
        )
    return np.asarray(rows[np.r_[fast, True] & np.r_[True, fast]])


def check_overlap(series: Series, other: Series, path: Path, column: str) -> None:
    """Refuse a file of one log that was not written at the time of the others, all on one clock, s."""
    (first, last), (begin, end) = (
        (min(clock[0] for clock, _ in one.values()), max(clock[-1] for clock, _ in one.values()))
        for one in (series, other)
    )
    if begin < last and end > first:
        return
    shift = _HALF_HOUR * round((begin + end - first - last) / 2.0 / _HALF_HOUR)
    zone = f"{'-' if shift < 0.0 else '+'}{int(abs(shift) // 3600):02d}:{int(abs(shift) % 3600 // 60):02d}"
    remedy = (
        f'likely its clock is in another time zone: write t = {{ column = "{column}", zone = "{zone}" }}'
        if begin - shift < last and end - shift > first and abs(shift) <= _LONGEST_ZONE
        else "name files that were written at the same time"
    )
    raise InputError(
        f"{path}: begins {begin - first:.6g} s after the other file of this log and does not overlap with "
        f"it, expected one time; {remedy}"
    )


def check_log(log: Log, tools: Instruments, source: Source, gnss: bool) -> list[str]:
    """Compare heading with course over ground, and look for a ship at berth; remarks on what may be wrong.

    The channels are as logged, in SI units, the heading without jumps. Looked at are speed and course over
    ground and, where they are of `gnss`, positions.
    """
    t, values = log.t, log.channels
    notes = [NO_RUDDER] if gnss and "delta" not in values else []
    if "ground_north" in values:
        velocity = values["ground_north"] + 1j * values["ground_east"]
    elif gnss and "x" in values:
        velocity = time_derivative(t, values["x"]) + 1j * time_derivative(t, values["y"])
    else:
        return notes
    fastest = float(np.quantile(np.abs(velocity), 0.95))
    if fastest < SLOWEST:
        raise InputError(
            f"{source.table.path}: the ship makes at most {fastest:.2g} m/s over ground, she lies at berth "
            "or at anchor, expected a manoeuvre; read another log"
        )
    moving = np.abs(velocity) > 0.3 * fastest
    if "psi" not in values or np.count_nonzero(moving) < 3:
        return notes
    _check_course(values["psi"][moving], np.angle(velocity[moving]), tools, source)
    offset = heading_offset(values, straight_parts(t, values)) if not tools.heading_offset else None
    magnetic = "mag" in source.columns.get("psi", source.columns["t"]).name.lower()
    if offset is not None and abs(offset[0]) > max(_COMPASS, 4.0 * offset[1]):
        told = f"{offset[0] / DEGREE:.1f}"
        notes.append(
            f"the heading shows {told} deg too much on every course, as a magnetic compass or a gyro that is "
            f"not aligned does; to take it out write heading_offset_deg = {told} in [sensors]"
        )
    elif magnetic and not tools.heading_offset:
        notes.append(
            "the heading is magnetic by its name; write what it shows too much as heading_offset_deg"
        )
    return notes


def _check_course(psi: Floats, course: Floats, tools: Instruments, source: Source) -> None:
    """Refuse a heading that is none beside the course over ground."""
    apart, mirrored = np.exp(1j * (course - psi)), np.exp(1j * (course + psi))
    mean, turned = float(np.angle(apart.mean())), float(np.ptp(psi))
    head = f"{source.table.path}: the heading "
    if turned > _TURNED and np.sqrt(np.mean(np.angle(apart) ** 2)) < _SAME:
        raise InputError(
            f"{head}is the course over ground, from which it differs by less than 0.3 deg in a turn of "
            f"{turned / DEGREE:.0f} deg, where a ship drifts; name the gyro's column: psi = "
            f'{{ column = "..." }}'
        )
    if turned > _TURNED and abs(mirrored.mean()) > max(0.95, abs(apart.mean()) + 0.02):
        raise InputError(
            f"{head}contradicts the course over ground: it turns the other way, expected it clockwise from "
            "north; change the sign of its column"
        )
    if abs(mean) > _CONTRADICTION and abs(apart.mean()) > 0.7 and not tools.heading_offset:
        raise InputError(
            f"{head}contradicts the course over ground by {-mean / DEGREE:.0f} deg, expected it clockwise "
            "from "
            f"north; name the right column, or write heading_offset_deg = {-mean / DEGREE:.0f} in [sensors]"
        )
