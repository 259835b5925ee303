"""Values beyond what any ship does: ranges, headings, positions."""

import math
from collections.abc import Mapping

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.resampling import Log, changes
from shipgym.trials.units import (
    DEGREE,
    LARGEST_MAGNITUDES,
    QUANTITIES,
    UNITS,
    si_factor,
)

_LARGEST_JUMP = 30.0 * DEGREE  # of a heading's single outlier that passes
_RUDDERS = {"delta", "delta_command"}
_TURN_AND_JUMP = 2.0 * math.pi + _LARGEST_JUMP


def check_ranges(channels: Mapping[str, Floats], locator: Locator) -> None:
    """Refuse values beyond `LARGEST_MAGNITUDES`; propose units that fit.

    The channels are in SI units, of shape (n_samples,), nan where there is none.
    """
    for channel, values in channels.items():
        limit = LARGEST_MAGNITUDES[channel]
        too_large = np.abs(values) > (1.0 + 1e-9) * limit
        if not too_large.any():
            continue
        first = int(np.argmax(too_large))
        declared = locator.columns[channel].unit
        own = si_factor(channel, declared)
        largest = np.nanmax(np.abs(values)) / own
        factors = UNITS[QUANTITIES[channel]]
        fitting = [
            (channel, unit) for unit in factors if factors[unit] <= limit / largest
        ]
        remedy = "check the column and its unit, or correct the value"
        if fitting:
            remedy = f"likely a wrong unit: declare {locator.declaration(*fitting[0])}"
        raise InputError(
            f"{locator.place(first, channel)}: expected {channel} of at most"
            f" {limit / own:g} {declared}, got {values[first] / own:g} {declared};"
            f" {remedy}",
            fitting,
        )


def without_spikes(psi: Floats) -> tuple[Floats, int]:
    """Heading without its single outliers, which become nan, and their number.

    An outlier is more than 30 degrees from both neighbours, which agree to 30 degrees.
    Where more than one in a hundred are, the sensor is at fault, and none is taken out.

    Parameters
    ----------
    psi : array of shape (n_samples,)
        As logged, rad; it may jump at north.
    """
    if psi.size < 3 or np.isinf(psi).any():
        return psi, 0
    steps = _wrapped(np.diff(psi))
    jumps = np.abs(steps) > _LARGEST_JUMP
    jumps_to_and_fro = jumps[:-1] & jumps[1:]
    across = _wrapped(psi[2:] - psi[:-2])
    neighbours_agree = np.abs(across) < _LARGEST_JUMP
    outliers = np.flatnonzero(jumps_to_and_fro & neighbours_agree)
    if not 0 < outliers.size <= 0.01 * psi.size:
        return psi, 0
    filled = psi.copy()
    filled[1 + outliers] = np.nan
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
    steps = np.abs(np.diff(psi))
    jumps = (steps > fastest_jump * np.diff(t)) & (steps > _LARGEST_JUMP)
    wrong = np.abs(np.diff(logged)) > _TURN_AND_JUMP
    passed, turned = changes(t, 0.1, psi)  # beyond the noise of quick rows
    is_fast = np.abs(turned) > fastest_turn * passed
    if not wrong.any() and is_fast.mean() > 0.05:
        wrong = is_fast
    remedy = 'empty the wrong cells and import with repair = "interpolate", or correct'
    proposals = []
    if wrong.any():
        unit = "deg" if locator.columns["psi"].unit == "rad" else "rad"
        proposals = [("psi", unit)]
        remedy = f"likely a wrong unit: declare {locator.declaration('psi', unit)}"
    elif jumps.any():
        wrong = jumps
    else:
        return
    k = int(np.argmax(wrong))
    before, after = (locator.in_file("psi", one) for one in logged[k : k + 2])
    raise InputError(
        f"{locator.place(k + 1, 'psi')}: expected a heading that turns by at most 80"
        f" deg/s, got {before} and then {after} within {t[k + 1] - t[k]:g} s; {remedy}",
        proposals,
    )


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
            f" position that jumps {moved[k]:.4g} m within {t[k + 1] - t[k]:g} s, as in"
            f" {count} of {too_fast.size} steps; likely two ships are in one log: keep"
            " the rows of one, or declare the unit of lat and lon"
        )
    # the first and the last one have a neighbour on one side only
    is_outlier: Flags = np.append(True, too_fast) & np.append(too_fast, True)
    return is_outlier


def check_rudder_unit(log: Log, locator: Locator) -> None:
    """Refuse a rudder in degrees that is too small for the turns of the log.

    The channels are in SI units, the heading without jumps.
    """
    turned_deg, fastest = _turning(log)
    for channel in locator.columns.keys() & log.channels.keys() & _RUDDERS:
        column = locator.columns[channel]
        largest = np.abs(log.channels[channel]).max()
        largest_deg = largest / DEGREE
        is_small = column.unit == "deg" and 0.05 < largest_deg < 1.0
        # in a second no ship turns by half her rudder
        is_turn = turned_deg > 20.0 and fastest > 0.5 * largest
        if not is_small or not is_turn or column.full is not None:
            continue
        raise InputError(
            f"{locator.path}: expected column '{column.name}' to move by more than 1"
            f" deg in a turn of {turned_deg:.0f} deg, got at most"
            f" {largest_deg:.2g} deg; likely a wrong unit, declare"
            f" {locator.declaration(channel, 'rad')}",
            [(channel, "rad")],
        )


def _turning(log: Log) -> tuple[float, float]:
    """Range of the heading, deg, and how fast it turns over some seconds, rad/s."""
    passed, turned = changes(log.t, 5.0, log.heading)
    rates = np.abs(turned) / passed
    return math.degrees(np.ptp(log.heading)), float(np.quantile(rates, 0.95))


def frozen_heading(log: Log) -> list[str]:
    """Remark on the longest stretch in which the heading does not change at all.

    Of stretches of at least 10 s and 10 samples with the rudder over by more than 5
    deg.
    """
    if not log.has("psi", "delta"):
        return []
    psi = log.channels["psi"]
    delta = log.channels["delta"]
    is_over = np.abs(delta) > 5.0 * DEGREE
    stands = np.abs(np.diff(psi)) < 1e-9
    is_frozen = stands & is_over[1:]
    ends = np.flatnonzero(~is_frozen)
    stretches = np.split(log.t, ends + 1)
    longest = max(stretches, key=np.ptp)
    lasted = np.ptp(longest)
    if longest.size <= 10 or lasted < 10.0:
        return []
    return [
        f"the heading stands still from {longest[0]:g} to {longest[-1]:g} s while the"
        " rudder is over: the instrument was stuck; leave that part out with cut"
    ]
