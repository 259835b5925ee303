"""Values beyond what any ship does: ranges, headings, positions, clocks set forward."""

import math
from collections.abc import Mapping

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.plausibility.agreement import likelier_time_units
from shipgym.trials.resampling import usual_step
from shipgym.trials.units import (
    DEGREE,
    LARGEST_MAGNITUDES,
    QUANTITIES,
    UNITS,
    si_factor,
)

_LARGEST_JUMP = 30.0 * DEGREE  # of a heading's single outlier that passes
_TURN_AND_JUMP = 2.0 * math.pi + _LARGEST_JUMP


def check_ranges(channels: Mapping[str, Floats], locator: Locator) -> None:
    """Refuse values beyond `LARGEST_MAGNITUDES`; propose units that fit.

    The channels are in SI units, of shape (n_samples,), nan where there is none.
    """
    rounding = 1.0 + 1e-9
    for channel, largest in LARGEST_MAGNITUDES.items():
        if channel not in channels:
            continue
        sizes = np.abs(channels[channel])
        too_large = sizes > rounding * largest
        if too_large.any():
            first = int(np.argmax(too_large))
            value = float(channels[channel][first])
            raise _out_of_range(channel, value, first, np.nanmax(sizes), locator)


def _out_of_range(
    channel: str, value: float, row: int, size: float, locator: Locator
) -> InputError:
    declared = locator.columns[channel].unit
    own = si_factor(channel, declared)
    limit = LARGEST_MAGNITUDES[channel]
    fitting = []
    for unit, factor in UNITS[QUANTITIES[channel]].items():
        if factor / own <= limit / size:
            fitting.append((channel, unit))
    remedy = "check the column and its unit, or correct the value"
    if fitting:
        remedy = f"likely a wrong unit: declare {locator.declaration(*fitting[0])}"
    return InputError(
        f"{locator.place(row, channel)}: expected {channel} of at most"
        f" {_spelled(limit / own, declared)}, got {_spelled(value / own, declared)};"
        f" {remedy}",
        fitting,
    )


def _spelled(number: float, unit: str) -> str:
    """A number with its unit; radians in degrees too, in brackets."""
    text = f"{number:g} {unit}"
    if unit not in ("rad", "rad/s"):
        return text
    return f"{text} ({math.degrees(number):g} {unit.replace('rad', 'deg')})"


# ---- headings


def without_spikes(psi: Floats) -> tuple[Floats, int]:
    """Heading whose single outliers are filled in, and their number.

    An outlier is more than 30 degrees from both neighbours, which agree to 30 degrees.
    Where more than one in a hundred are, the sensor is at fault, and none is filled.

    Parameters
    ----------
    psi : array of shape (n_samples,)
        As logged, rad; it may jump at north.
    """
    if psi.size < 3 or np.isinf(psi).any():
        return psi, 0
    steps = _wrapped(np.diff(psi))
    across = _wrapped(psi[2:] - psi[:-2])
    jumps = np.abs(steps) > _LARGEST_JUMP
    outliers = np.flatnonzero(jumps[:-1] & jumps[1:] & (np.abs(across) < _LARGEST_JUMP))
    if not 0 < outliers.size <= 0.01 * psi.size:
        return psi, 0
    filled = psi.copy()
    filled[1 + outliers] = psi[outliers] + 0.5 * across[outliers]
    return filled, outliers.size


def _wrapped(angle: Floats) -> Floats:
    """Angle in [-pi, pi), rad."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def check_heading(t: Floats, psi: Floats, logged: Floats, locator: Locator) -> None:
    """Refuse a heading that turns faster than any ship.

    Single outliers of a noisy sensor pass; a jump of more than 30 degrees, or steps of
    which many are too fast, do not. Time in s, heading without jumps at north and as
    logged in rad, each of shape (n_samples,).
    """
    fastest_turn = 80.0 * DEGREE  # per second, of a small model
    fastest_jump = 60.0 * DEGREE
    several_turns = np.abs(np.diff(logged)) > _TURN_AND_JUMP
    steps = np.abs(np.diff(psi))
    jumps = (steps > fastest_jump * np.diff(t)) & (steps > _LARGEST_JUMP)
    is_fast = np.zeros(steps.size, dtype=bool)
    rows = math.ceil(0.1 / usual_step(t))  # beyond the noise of quick rows
    turned = np.abs(psi[rows:] - psi[:-rows])
    is_fast[: turned.size] = turned > fastest_turn * (t[rows:] - t[:-rows])
    if several_turns.any():
        wrong = several_turns
    elif is_fast.mean() > 0.05:
        wrong = is_fast
    elif jumps.any():
        remedy = 'empty the wrong cells and import with repair = "interpolate", or'
        raise _too_fast_turn(t, logged, jumps, locator, f"{remedy} correct them")
    else:
        return

    # the unit of time if the heading stays within a turn, else that of the heading
    time_units = list(likelier_time_units(t, locator))
    other = "deg" if locator.columns["psi"].unit == "rad" else "rad"
    proposal = ("psi", other)
    if time_units and np.ptp(logged) < _TURN_AND_JUMP:
        proposal = ("t", time_units[0])
    remedy = f"likely a wrong unit: declare {locator.declaration(*proposal)}"
    raise _too_fast_turn(t, logged, wrong, locator, remedy, proposal)


def _too_fast_turn(
    t: Floats,
    logged: Floats,
    wrong: Flags,
    locator: Locator,
    remedy: str,
    *proposals: tuple[str, str],
) -> InputError:
    """Error at the first of the wrong steps, in the unit of the file."""
    k = int(np.argmax(wrong))
    before = locator.in_file("psi", logged[k])
    after = locator.in_file("psi", logged[k + 1])
    return InputError(
        f"{locator.place(k + 1, 'psi')}: expected a heading that turns by at most 80"
        f" deg/s, got {before} and then {after} within {t[k + 1] - t[k]:g} s; {remedy}",
        proposals,
    )


# ---- positions


def find_outliers(t: Floats, x: Floats, y: Floats, locator: Locator) -> Flags:
    """Positions that no ship reaches from the one before, nor the next one from them.

    Time in s and positions in m, shape (n_positions,). Raises InputError for a track
    that jumps so often that two ships must be in the log.
    """
    fastest = 50.0  # m/s
    shortest_step = 0.1  # s, in which receivers write their times
    moved = np.hypot(np.diff(x), np.diff(y))
    too_fast = moved > fastest * np.maximum(np.diff(t), shortest_step)
    count = np.count_nonzero(too_fast)
    if too_fast.size < 2:
        return np.zeros(t.size, dtype=bool)
    if count > 0.1 * too_fast.size:
        k = int(np.argmax(too_fast))
        raise InputError(
            f"{locator.place(k + 1, 'lat')}: expected the track of one ship, got a"
            f" position that jumps {moved[k] / 1000.0:.4g} km within"
            f" {t[k + 1] - t[k]:g} s, as in {count} of {too_fast.size} steps; likely"
            " two ships are in one log: keep the rows of one, or declare the unit of"
            " lat and lon"
        )
    # the first and the last one have a neighbour on one side only
    to_it = np.insert(too_fast, 0, True)
    from_it = np.append(too_fast, True)
    is_outlier: Flags = to_it & from_it
    return is_outlier


def without_clock_jumps(t: Floats, x: Floats, y: Floats) -> tuple[Floats, list[str]]:
    """Times without the seconds by which the clock was set forward, and notes of them.

    Over such a gap a ship with way on has moved no farther than between any two rows;
    in a gap of the recording she sails on. `x` and `y` are positions in m.
    """
    if t.size < 20 or not np.isfinite(t + x + y).all():
        return t, []
    steps = np.diff(t)
    moved = np.hypot(np.diff(x), np.diff(y))
    usual = float(np.median(steps))
    shifts = np.zeros_like(t)
    notes = []
    for row in np.flatnonzero(steps > max(5.0 * usual, 5.0)).tolist():
        if not _hardly_moved(steps, moved, row):
            continue
        surplus = float(steps[row]) - usual
        shifts[row + 1 :] += surplus
        notes.append(
            f"the clock was set forward by {surplus:.3g} s after {t[row]:.6g} s, as the"
            f" ship moved by {moved[row]:.2g} m meanwhile; that time is taken out"
        )
    return t - shifts, notes


def _hardly_moved(steps: Floats, moved: Floats, row: int) -> bool:
    """Return whether a ship with way on moved over a step as in any around it."""
    around = np.arange(max(row - 10, 0), min(row + 11, steps.size))
    around = around[around != row]
    here = moved[row]
    with np.errstate(all="ignore"):
        speeds = moved[around] / steps[around]
        speed = float(np.median(speeds))
        is_far_too_short = here < 0.2 * speed * steps[row]
    as_usual = here < 2.0 * moved[around].max()
    return bool(speed >= 1.0 and as_usual and is_far_too_short)
