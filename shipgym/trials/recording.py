"""Conversion of a table's columns to channels in SI units, each on its clock."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.column_values import (
    column_numbers,
    read_positions,
    two_rudders_note,
    without_sentinels,
)
from shipgym.trials.columns import Column, Locator, choose_columns
from shipgym.trials.missing_values import check_time, fill_missing
from shipgym.trials.navigation import local_metres
from shipgym.trials.plausibility.values import (
    check_heading,
    check_ranges,
    find_outliers,
    without_clock_jumps,
    without_spikes,
)
from shipgym.trials.readers.log_table import REPAIR, LogTable
from shipgym.trials.resampling import (
    FEWEST_SAMPLES,
    Signal,
    Signals,
    have_own_clocks,
)
from shipgym.trials.row_times import read_times
from shipgym.trials.units import si_factor

_PAIRS = {"lat": "lon", "lon": "lat", "sog": "cog", "cog": "sog"}  # of no use alone


@dataclass(frozen=True)
class Recording:
    """The channels of one file, in SI units.

    Attributes
    ----------
    signals : dict of str to Signal
        By channel, headings without jumps.
    locator : Locator
        Places of the values in the file.
    filled : dict of str to int
        How many values of a channel were filled in.
    start : float or None
        Clock at t = 0 in UTC, s since 1970 or of the day; None where the time is no
        clock's.
    notes : list of str
        What was assumed of the values.
    """

    signals: Signals
    locator: Locator
    filled: Mapping[str, int]
    start: float | None
    notes: list[str] = field(default_factory=list)


def read_recording(
    table: LogTable,
    columns: Mapping[str, Column] | None,
    repair: str | None,
    *,
    part: bool = False,
) -> Recording:
    """Read the chosen columns of a table, checked and, if asked for, repaired.

    `columns` and `part` are as :func:`.columns.choose_columns` takes them. Anything
    wrong with a file is an InputError that names line, column, value and remedy.
    """
    chosen = choose_columns(table, columns, part=part)
    if _PAIRS.keys() & chosen.keys():
        _check_pairs(table, chosen)
    notes: list[str] = []
    if repair is not None:
        known = len(table.notes)
        names = [column.name for column in chosen.values()]
        table = table.without_odd_cells(names, chosen["t"].name)
        notes += table.notes[known:]
    times = read_times(table, chosen["t"])
    chosen["t"] = replace(chosen["t"], unit=times.unit)
    locator = Locator(
        table=table,
        columns=chosen,
        rows=np.arange(times.t.size),
    )

    notes += times.notes
    channels = _read_numbers(locator, notes)
    outliers = 0
    if "lat" in chosen:
        north, east, outliers = _local_track(locator, times.t, repair, notes)
        channels |= {"x": north, "y": east}
        chosen["x"] = replace(chosen["lat"], unit="m")
        chosen["y"] = replace(chosen["lon"], unit="m")

    t = times.t
    if {"x", "y"} <= channels.keys():
        t, jumps = without_clock_jumps(t, channels["x"], channels["y"])
        notes += jumps
    signals, locator, filled = _signals(t, channels, locator, repair)
    if outliers:
        filled |= {"x": outliers, "y": outliers}
    if "sog" in signals:
        _make_velocity(signals, locator)
    return Recording(
        signals=signals,
        locator=locator,
        filled=filled,
        start=times.start,
        notes=notes,
    )


def _check_pairs(table: LogTable, chosen: Mapping[str, Column]) -> None:
    """Refuse one channel of a pair without the other."""
    for name, other in _PAIRS.items():
        if name in chosen and other not in chosen:
            raise InputError(
                f"{table.path}: columns: expected {name} and {other}, got {name} alone;"
                " name the column of the other"
            )


def _read_numbers(locator: Locator, notes: list[str]) -> dict[str, Floats]:
    """Channels that are numbers in the file, in SI units, nan where there is none.

    Notes numbers that stand for "no value".
    """
    channels = {}
    for channel, column in locator.columns.items():
        if channel in ("t", "lat", "lon"):
            continue
        numbers = column_numbers(locator.table, column)
        factor = si_factor(channel, column.unit)
        values, words = without_sentinels(channel, numbers, factor)
        if column.mean_with is not None:
            notes.append(two_rudders_note(locator.table, column))
        notes += [f"column '{column.name}': {word}" for word in words]
        channels[channel] = factor * values
    return channels


def _signals(
    t: Floats, channels: dict[str, Floats], locator: Locator, repair: str | None
) -> tuple[Signals, Locator, dict[str, int]]:
    """Signals of channels, their locator, and counts of values filled in.

    The channels are on the clock of the rows, or each on a clock of its own.
    """
    filled: dict[str, int] = {}
    signals: Signals = {}
    if "psi" in channels:
        channels["psi"], spikes = without_spikes(channels["psi"])
        if spikes:
            filled["psi"] = spikes
    table = {"t": t, **channels}
    columns = np.array(list(table.values()))
    is_whole = bool(np.isfinite(columns).all())
    own_clocks = locator.table.own_clocks or have_own_clocks(t, channels)
    if not is_whole and own_clocks:
        check_ranges(table, locator)
        for channel, values in channels.items():
            signals[channel] = _own_signal(channel, t, values, locator)
        return signals, locator, filled

    if is_whole:
        check_time(t, locator)
    else:
        t, channels, locator, missing = fill_missing(t, channels, locator, repair)
        filled = dict(Counter(filled) + Counter(missing))
    check_ranges({"t": t, **channels}, locator)
    for channel, values in channels.items():
        continuous = _continuous(channel, t, values, locator)
        signals[channel] = Signal(t, continuous)
    return signals, locator, filled


def _continuous(
    channel: str,
    t: Floats,
    values: Floats,
    locator: Locator,
) -> Floats:
    """Values of a channel, headings and directions of the wind without jumps."""
    if channel == "wind_from":
        return np.unwrap(values)
    if channel == "psi":
        unwrapped = np.unwrap(values)
        check_heading(t, unwrapped, values, locator)
        return unwrapped
    return values


def _local_track(
    locator: Locator, t: Floats, repair: str | None, notes: list[str]
) -> tuple[Floats, Floats, int]:
    """Positions by north and east of the first one, m, and the number of outliers.

    NaN where there is none. Outliers are refused unless they are to be filled.
    """
    columns = locator.columns
    lat, lon, none = read_positions(locator.table, columns["lat"], columns["lon"])
    if none:
        notes.append(
            f"{none} positions that are none (91 and 181 deg, 0 and 0) are taken as"
            " missing"
        )
    check_ranges({"lat": lat, "lon": lon}, locator)
    north = np.full_like(t, np.nan)
    east = np.full_like(t, np.nan)
    is_known = np.isfinite(lat + lon + t)
    rows = np.flatnonzero(is_known)
    if not rows.size:
        return north, east, 0

    lat = lat[rows]
    lon = lon[rows]
    clock = t[rows]
    here = replace(locator, rows=rows)
    x, y = local_metres(lat, lon, origin=(lat[0], lon[0]))
    is_far = find_outliers(clock, x, y, here)
    if repair is None and is_far.any():
        k = int(np.argmax(is_far))
        raise InputError(
            f"{here.place(k, 'lat')}: expected a position that a ship reaches from"
            f" those before and after, got {lat[k]:.5f}, {lon[k]:.5f}, one of"
            f" {np.count_nonzero(is_far)} outliers among {lat.size}; empty its cells,"
            ' or leave such rows to be filled with repair = "interpolate"',
            [REPAIR],
        )
    is_near = ~is_far
    kept = rows[is_near]
    north[kept] = x[is_near]
    east[kept] = y[is_near]
    return north, east, int(is_far.sum())


def _own_signal(
    channel: str,
    t: Floats,
    values: Floats,
    locator: Locator,
) -> Signal:
    """A channel where it has values; InputError for too few or time that goes back."""
    is_present = np.isfinite(values)
    rows = np.flatnonzero(is_present)
    column = locator.columns[channel].name
    if rows.size < FEWEST_SAMPLES:
        raise InputError(
            f"{locator.path}: column '{column}': expected {FEWEST_SAMPLES} values or"
            f" more, got {rows.size}; leave it out"
        )

    clock = t[rows]
    here = replace(locator, rows=locator.rows[rows])
    stands_still = np.diff(clock) <= 0.0
    if stands_still.any():
        k = np.argmax(stands_still)
        before, after = clock[k : k + 2]
        place = here.place(k + 1, "t")
        raise InputError(
            f"{place}: expected time to increase between values of"
            f" '{column}', got {before:.10g} and then {after:.10g} s; sort the rows,"
            " or, where two ships or receivers are in the file, keep those of one"
        )
    present = _continuous(channel, clock, values[rows], here)
    return Signal(clock, present)


def _make_velocity(signals: Signals, locator: Locator) -> None:
    """Replace speed and course over ground by velocities to the north and east."""
    t, speed = signals.pop("sog")
    _, course = signals.pop("cog")
    if speed.size != course.size:
        raise InputError(
            f"{locator.path}: expected sog and cog in the same rows, got {speed.size}"
            f" values of sog and {course.size} of cog"
        )
    north = speed * np.cos(course)
    east = speed * np.sin(course)
    signals["ground_north"] = Signal(t, north)
    signals["ground_east"] = Signal(t, east)
