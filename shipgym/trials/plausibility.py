"""Values that no ship can have, and channels that contradict each other.

Most often a unit, a sign, a frame or a clock is wrong. What cannot be right is an
InputError with the line to write; what may be right is a remark.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Floats, integral
from shipgym.errors import InputError
from shipgym.trials.columns import Source
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import Instruments, heading_offset, straight_parts
from shipgym.trials.resampling import Log, Series
from shipgym.trials.units import DEGREE, LIMITS, QUANTITIES, UNITS, si_factor

_FASTEST_TURN = 60.0 * DEGREE
_LARGEST_JUMP = 30.0 * DEGREE
_WINDOWS = 30
#: Faster than any ship, and slower than any manoeuvre, over ground, m/s.
FASTEST, SLOWEST = 50.0, 0.3
_MOST_OUTLIERS = 0.1  # share of the steps; more are two ships in turn
_SAME, _COMPASS, _CONTRADICTION, _TURNED = (
    0.3 * DEGREE,
    2.0 * DEGREE,
    25.0 * DEGREE,
    20.0 * DEGREE,
)
_HALF_HOUR, _LONGEST_ZONE = 1800.0, 14.0 * 3600.0
_ALIKE = 0.5  # logarithm of the ratio of two rates that are the same in the right units
_USUAL_STEPS = (
    0.01,
    10.0,
)  # s, between the rows of a log; of others the unit of time is doubted
NO_RUDDER = (
    "no rudder angle in this log: without rudder nothing can be identified from it, it"
    " can only be looked at; log the rudder too (in NMEA 0183 the sentence RSA)"
)


def check_ranges(channels: Mapping[str, Floats], source: Source) -> None:
    """Refuse values beyond :data:`LIMITS`, and name the unit that would make them plausible.

    The channels are in SI units, of shape (n_samples,), nan where there is none; the
    source is for messages.
    """
    for channel, limit in LIMITS.items():
        if channel not in channels:
            continue
        size = np.nan_to_num(np.abs(channels[channel]))
        if size.max(initial=0.0) <= limit * (1.0 + 1e-9):
            continue
        first = int(np.argmax(size > limit * (1.0 + 1e-9)))
        unit = source.columns[channel].unit
        factor = si_factor(channel, unit)
        found = _spelled(channels[channel][first] / factor, channel, unit)
        units = UNITS[QUANTITIES[channel]].items()
        fitting = [
            u for u, f in units if f < factor and size.max() * (f / factor) <= limit
        ]
        remedies = [
            f"likely a wrong unit: declare {source.declare(channel, other)}"
            for other in fitting
        ]
        remedies.append("check the column and its unit, or correct the value")
        raise InputError(
            f"{source.at(first, channel)}: {channel} = {found} found, "
            f"expected at most {_spelled(limit / factor, channel, unit)};"
            f" {remedies[0]}",
            [(channel, other) for other in fitting],
        )


def check_heading(t: Floats, psi: Floats, raw_psi: Floats, source: Source) -> None:
    """Refuse a heading that turns faster than any ship.

    Single outliers of a noisy sensor pass; a jump of more than 30 degrees, or steps
    most of which are too fast, do not. Time in s; heading without and with the jumps at
    north, rad; each of shape (n_samples,).
    """
    step = np.diff(psi)
    fast = np.abs(step) > _FASTEST_TURN * np.diff(t)
    jump = fast & (np.abs(step) > _LARGEST_JUMP)
    several_turns = np.abs(np.diff(raw_psi)) > 2.0 * math.pi + _LARGEST_JUMP
    unit = source.columns["psi"].unit
    factor = si_factor("psi", unit)
    instead: list[tuple[str, str]] = []
    if several_turns.any() or np.mean(fast) > 0.05:
        k = int(np.argmax(several_turns if several_turns.any() else fast))
        times = (
            _time_units(t, source)
            if np.ptp(raw_psi) < 2.0 * math.pi + _LARGEST_JUMP
            else {}
        )
        instead = (
            [("t", next(iter(times)))]
            if times
            else [("psi", "deg" if unit == "rad" else "rad")]
        )
        remedy = f"likely a wrong unit: declare {source.declare(*instead[0])}"
    elif jump.any():
        k = int(np.argmax(jump))
        remedy = (
            'empty the wrong cells and import with repair = "interpolate", or correct'
            " them"
        )
    else:
        return
    before, after = raw_psi[k : k + 2] / factor
    raise InputError(
        f"{source.at(k + 1, 'psi')}: heading goes from {before:g} to {after:g} {unit} "
        f"within {t[k + 1] - t[k]:g} s, expected at most 60 deg/s; {remedy}",
        instead,
    )


def check_consistency(log: Log, frame: str, source: Source) -> None:
    """Refuse channels that contradict each other so plainly that a unit, sign or frame must be wrong.

    Compared over windows in time, so that noise and offsets do not matter: yaw rate
    with the change of heading, and velocities with the change of position. The channels
    are as recorded, in SI units, the heading without jumps; `frame`, "body" or "earth",
    is the declared one of u and v.
    """
    if {"psi", "r"} <= log.channels.keys():
        _check_yaw_rate(log, source)
    if {"x", "y", "psi", "u", "v"} <= log.channels.keys():
        _check_velocity(log, frame, source)


def _check_yaw_rate(log: Log, source: Source) -> None:
    parts = log.channels["psi"], integral(log.t, log.channels["r"])
    turned, expected = (_detrended(log.t, part) for part in parts)
    if max(np.ptp(turned), np.ptp(expected)) < 2.0 * DEGREE:
        return
    gain, misfit = _fit(np.diff(expected), np.diff(turned))
    if misfit > 0.5 or 0.2 < gain.real < 5.0:
        return
    names = [source.columns[channel].name for channel in ("psi", "r")]
    head = (
        f"{source.table.path}: columns '{names[0]}' (heading) and '{names[1]}' (yaw"
        " rate)"
    )
    if gain.real < 0.0:
        raise InputError(
            f"{head} have opposite signs, expected both to be positive when the bow"
            " turns to starboard (clockwise seen from above); change the sign of the"
            " column that is positive to port"
        )
    instead = _nearest_units(gain.real, log.t, source)
    whose = (
        "of time" if {channel for channel, _ in instead} == {"t"} else "of one of them"
    )
    raise InputError(
        f"{head} disagree: the heading changes {gain.real:.3g} times as fast as the yaw"
        f" rate says, expected 1; likely a wrong unit {whose}, declare"
        f" {' or '.join(source.declare(*one) for one in instead)}",
        instead,
    )


def _check_velocity(log: Log, frame: str, source: Source) -> None:
    t, channels = log.t, log.channels
    moved = np.diff(_at_windows(channels["x"] + 1j * channels["y"]))
    velocity = channels["u"] + 1j * channels["v"]
    velocities = {"body": velocity * np.exp(1j * channels["psi"]), "earth": velocity}
    fits = {
        name: _fit(np.diff(_at_windows(integral(t, part))), moved)
        for name, part in velocities.items()
    }
    gain, misfit = fits.pop(frame)
    ((other, (other_gain, other_misfit)),) = fits.items()
    x, y, u, v = (source.columns[channel].name for channel in ("x", "y", "u", "v"))
    head = f"{source.table.path}: positions and velocities disagree"
    if misfit > 0.03 and other_misfit < 0.2 * misfit and 0.8 < other_gain.real < 1.25:
        raise InputError(
            f"{head}: columns '{u}' and '{v}' follow the positions as velocities in the"
            f" {other} frame, "
            f'velocity_frame = "{frame}" found; declare velocity_frame = "{other}"',
            [("velocity_frame", other)],
        )
    if misfit < 0.2 and not 0.55 < abs(gain) < 1.8:
        times = [
            one
            for one, scale in _time_units(t, source).items()
            if 0.55 < abs(gain) / scale < 1.8
        ]
        likely = [f"time, declare {source.declare('t', one)}" for one in times]
        likely.append(
            f"'{x}', '{y}' or of '{u}', '{v}' (a knot is 0.514 m/s): declare it"
        )
        raise InputError(
            f"{head}: the position changes {abs(gain):.3g} times as fast as the"
            f" velocities say, expected 1; likely a wrong unit of {likely[0]}",
            [("t", one) for one in times],
        )


def _at_windows(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the values at the edges of at most 30 windows."""
    edges = np.unique(np.linspace(0, values.size - 1, _WINDOWS + 1).round().astype(int))
    return np.asarray(values[edges])


def _detrended(t: Floats, values: Floats) -> Floats:
    """Return the values at the windows' edges without their straight line: a rate sensor has a bias."""
    time, ends = _at_windows(t - t[0]), _at_windows(values)
    slope, level = np.polyfit(time, ends, 1)
    return np.asarray(ends - slope * time - level)


def _fit(
    regressor: npt.NDArray[Any], target: npt.NDArray[Any]
) -> tuple[complex, float]:
    """Fit target = gain * regressor; return the gain and the residual's share of the target's norm."""
    power, size = (
        float(np.vdot(regressor, regressor).real),
        float(np.linalg.norm(target)),
    )
    if power == 0.0 or size == 0.0:
        return 1.0 + 0.0j, 1.0
    gain = complex(np.vdot(regressor, target) / power)
    return gain, float(np.linalg.norm(target - gain * regressor)) / size


def _spelled(value: float, channel: str, unit: str) -> str:
    """Spell a value in its unit, with degrees in brackets where it is in radians."""
    text = f"{value:g} {unit}"
    if QUANTITIES[channel] in ("angle", "angular rate") and unit.startswith("rad"):
        return f"{text} ({math.degrees(value):g} {unit.replace('rad', 'deg')})"
    return text


def _time_units(t: Floats, source: Source) -> dict[str, float]:
    """Units of time by the declared one, where the steps are unusual in this and usual in those."""
    (low, high), step = _USUAL_STEPS, float(np.median(np.diff(t)))
    if low <= step <= high:
        return {}
    own = si_factor("t", source.columns["t"].unit)
    scales = {
        unit: factor / own
        for unit, factor in UNITS["time"].items()
        if "unix" not in unit
    }
    return {
        unit: scale for unit, scale in scales.items() if low <= step * scale <= high
    }


def _nearest_units(gain: float, t: Floats, source: Source) -> list[tuple[str, str]]:
    """The channels, with their units, of which one would bring heading and yaw rate together.

    Where none does and the unit of time is doubted, that comes first: two units are
    wrong.
    """
    times = {
        ("t", unit): gain / scale for unit, scale in _time_units(t, source).items()
    }
    gains = {
        (channel, unit): (
            gain * (factor / si_factor(channel, source.columns[channel].unit)) ** sign
        )
        for channel, sign in (("psi", 1.0), ("r", -1.0))
        for unit, factor in UNITS[QUANTITIES[channel]].items()
        if unit != source.columns[channel].unit
    }
    distances = {
        one: abs(math.log(changed)) for one, changed in (gains | times).items()
    }  # from 1
    nearest = min(distances.values())
    if times and nearest > _ALIKE:
        return list(times)[:1]
    return [one for one, distance in distances.items() if distance < nearest + 0.01]


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
            f"{source.at(int(rows[k + 1]), 'lat')}: the position jumps"
            f" {steps[k] / 1000.0:.4g} km within {t[k + 1] - t[k]:g} s, as in"
            f" {int(fast.sum())} of {fast.size} steps, expected the track of one ship;"
            " likely two ships are in one log: keep the rows of one, or declare the"
            " unit of lat and lon"
        )
    return np.asarray(rows[np.r_[fast, True] & np.r_[True, fast]])


def check_overlap(series: Series, other: Series, path: Path, column: str) -> None:
    """Refuse a file of one log that was not written at the time of the others, all on one clock, s."""
    (first, last), (begin, end) = (
        (
            min(clock[0] for clock, _ in one.values()),
            max(clock[-1] for clock, _ in one.values()),
        )
        for one in (series, other)
    )
    if begin < last and end > first:
        return
    shift = _HALF_HOUR * round((begin + end - first - last) / 2.0 / _HALF_HOUR)
    zone = f"{'-' if shift < 0.0 else '+'}{int(abs(shift) // 3600):02d}:{int(abs(shift) % 3600 // 60):02d}"
    remedy = (
        f'likely its clock is in another time zone: write t = {{ column = "{column}",'
        f' zone = "{zone}" }}'
        if begin - shift < last and end - shift > first and abs(shift) <= _LONGEST_ZONE
        else "name files that were written at the same time"
    )
    raise InputError(
        f"{path}: begins {begin - first:.6g} s after the other file of this log and"
        f" does not overlap with it, expected one time; {remedy}"
    )


def check_log(log: Log, tools: Instruments, source: Source, gnss: bool) -> list[str]:
    """Compare heading with course over ground, and look for a ship at berth; remarks on what may be wrong.

    The channels are as logged, in SI units, the heading without jumps. Looked at are
    speed and course over ground and, where they are of `gnss`, positions.
    """
    t, values = log.t, log.channels
    notes = [NO_RUDDER] if gnss and "delta" not in values else []
    notes += [
        f"the rows are {np.median(np.diff(t)):.4g} s apart, which is unusual in a"
        f" manoeuvre; if the unit of time is wrong, declare {source.declare('t', unit)}"
        for unit in list(_time_units(t, source))[:1]
    ]
    if "ground_north" in values:
        velocity = values["ground_north"] + 1j * values["ground_east"]
    elif gnss and "x" in values:
        velocity = time_derivative(t, values["x"]) + 1j * time_derivative(
            t, values["y"]
        )
    else:
        return notes
    fastest = float(np.quantile(np.abs(velocity), 0.95))
    if fastest < SLOWEST:
        raise InputError(
            f"{source.table.path}: the ship makes at most {fastest:.2g} m/s over"
            " ground, she is at berth or at anchor, expected a manoeuvre; read"
            " another log"
        )
    moving = np.abs(velocity) > 0.3 * fastest
    if "psi" not in values or np.count_nonzero(moving) < 3:
        return notes
    _check_course(values["psi"][moving], np.angle(velocity[moving]), tools, source)
    offset = (
        heading_offset(values, straight_parts(t, values))
        if not tools.heading_offset
        else None
    )
    magnetic = "mag" in source.columns.get("psi", source.columns["t"]).name.lower()
    if offset is not None and abs(offset[0]) > max(_COMPASS, 4.0 * offset[1]):
        told = f"{offset[0] / DEGREE:.1f}"
        notes.append(
            f"the heading shows {told} deg too much on every course, as a magnetic"
            " compass or a gyro that is not aligned does; to remove it write"
            f" heading_offset_deg = {told} in [sensors]"
        )
    elif magnetic and not tools.heading_offset:
        notes.append(
            "the heading is magnetic by its name; write what it shows too much as"
            " heading_offset_deg"
        )
    return notes


def _check_course(
    psi: Floats, course: Floats, tools: Instruments, source: Source
) -> None:
    """Refuse a heading that is none beside the course over ground."""
    apart, mirrored = np.exp(1j * (course - psi)), np.exp(1j * (course + psi))
    mean, turned = float(np.angle(apart.mean())), float(np.ptp(psi))
    head = f"{source.table.path}: the heading "
    if turned > _TURNED and np.sqrt(np.mean(np.angle(apart) ** 2)) < _SAME:
        raise InputError(
            f"{head}is the course over ground, from which it differs by less than 0.3"
            f" deg in a turn of {turned / DEGREE:.0f} deg, where a ship drifts; name"
            ' the gyro\'s column: psi = { column = "..." }'
        )
    if turned > _TURNED and abs(mirrored.mean()) > max(0.95, abs(apart.mean()) + 0.02):
        raise InputError(
            f"{head}contradicts the course over ground: it turns the other way,"
            " expected it clockwise from north; change the sign of its column"
        )
    if (
        abs(mean) > _CONTRADICTION
        and abs(apart.mean()) > 0.7
        and not tools.heading_offset
    ):
        raise InputError(
            f"{head}contradicts the course over ground by {-mean / DEGREE:.0f} deg,"
            " expected it clockwise from north; name the right column, or write"
            f" heading_offset_deg = {-mean / DEGREE:.0f} in [sensors]"
        )
