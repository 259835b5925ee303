"""Conversion of a table's columns to channels in SI units, on one clock."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.column_values import (
    column_numbers,
    read_positions,
    without_sentinels,
)
from shipgym.trials.columns import Column, Locator, choose_columns
from shipgym.trials.missing_values import check_present, check_time
from shipgym.trials.navigation import local_metres
from shipgym.trials.plausibility.values import (
    check_heading,
    check_ranges,
    find_outliers,
    without_spikes,
)
from shipgym.trials.readers.log_table import REPAIR, LogTable
from shipgym.trials.resampling import (
    FEWEST_SAMPLES,
    Log,
    Signal,
    Signals,
    have_own_clocks,
    on_one_clock,
)
from shipgym.trials.row_times import read_times
from shipgym.trials.units import si_factor


def read_recording(
    table: LogTable,
    columns: Mapping[str, Column] | None,
    repair: str | None,
) -> Log:
    """Read the chosen columns of a table, checked and, if asked for, repaired.

    `columns` are as :func:`.columns.choose_columns` takes them. Anything wrong with a
    file is an InputError that names line, column, value and remedy.
    """
    chosen = choose_columns(table, columns)
    if ("lat" in chosen) != ("lon" in chosen):
        alone = "lat" if "lat" in chosen else "lon"
        raise InputError(
            f"{table.path}: columns: expected lat and lon, got {alone} alone; name the"
            " column of the other"
        )
    if repair is not None:
        names = [column.name for column in chosen.values()]
        time = chosen["t"].name
        table = table.without_odd_cells(names, time)
    notes = [*table.notes, *_settle_speed(chosen)]
    times = read_times(table, chosen["t"])
    chosen["t"] = replace(chosen["t"], unit=times.unit)
    every = np.arange(times.t.size)
    locator = Locator(table, chosen, rows=every)
    notes += times.notes
    channels = _read_numbers(locator, notes)
    left_out: dict[str, int] = {}
    if "lat" in chosen:
        north, east, outliers = _local_track(locator, times.t, repair, notes)
        channels |= {"x": north, "y": east}
        left_out |= {"x": outliers, "y": outliers}
        chosen["x"] = replace(chosen["lat"], unit="m")
        chosen["y"] = replace(chosen["lon"], unit="m")

    own_clocks = table.own_clocks or have_own_clocks(times.t, channels)
    if not own_clocks:
        check_time(times.t, locator)
        check_present(times.t, channels, locator, repair)
    if "psi" in channels:
        channels["psi"], left_out["psi"] = without_spikes(channels["psi"])
    is_whole = np.isfinite([*channels.values()]).all()
    signals = _signals(times.t, channels, locator)
    if "sog" in signals:
        _make_velocity(signals)
    rows = None if own_clocks or is_whole else times.t
    log = on_one_clock(signals, locator, rows)
    log.notes = notes + log.notes
    log.repaired = left_out | log.repaired
    return log


def _settle_speed(chosen: dict[str, Column]) -> list[str]:
    """Leave out a course alone, and a speed over ground alone where more is known.

    Such a speed is else taken as through the water, which a note says.
    """
    if {"sog", "cog"} <= chosen.keys():
        return []
    chosen.pop("cog", None)
    alone = chosen.pop("sog", None)
    if alone is None:
        return []
    if {"lat", "x", "stw", "u"} & chosen.keys():
        return ["the speed over ground has no course beside it and is left out"]
    chosen["stw"] = alone
    return [
        "the speed over ground is taken as through the water, as there is no course"
        " over ground"
    ]


@np.errstate(invalid="ignore")  # of signalling nan in binary files
def _read_numbers(locator: Locator, notes: list[str]) -> dict[str, Floats]:
    """Channels that are numbers in the file, in SI units, nan where there is none.

    Notes numbers that stand for "no value".
    """
    channels = {}
    for channel, column in locator.columns.items():
        if channel not in ("t", "lat", "lon"):
            numbers = column_numbers(locator.table, column)
            factor = si_factor(channel, column.unit)
            values, words = without_sentinels(channel, numbers, factor)
            notes += [f"column '{column.name}': {word}" for word in words]
            channels[channel] = factor * values
    if "sog" in channels:  # at rest there is no course
        sog = channels["sog"]
        cog = channels["cog"]
        lacks_one = np.isnan(sog) | np.isnan(cog)
        sog[lacks_one] = np.nan
        cog[lacks_one] = np.nan
    return channels


def _signals(t: Floats, channels: dict[str, Floats], locator: Locator) -> Signals:
    """Signals of channels, each where it has values; angles without jumps."""
    check_ranges({"t": t, **channels}, locator)
    signals = {}
    for name, values in channels.items():
        signal, here = _own_signal(name, t, values, locator)
        if name in ("psi", "wind_from"):
            unwrapped = np.unwrap(signal.values)
            if name == "psi":
                check_heading(signal.t, unwrapped, signal.values, here)
            signal = signal._replace(values=unwrapped)
        signals[name] = signal
    return signals


def _own_signal(
    channel: str, t: Floats, values: Floats, locator: Locator
) -> tuple[Signal, Locator]:
    """A channel where it has values, and their places.

    InputError for too few or time that goes back.
    """
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size == t.size:
        check_time(t, locator)
        return Signal(t, values), locator
    if rows.size < FEWEST_SAMPLES:
        raise InputError(
            f"{locator.path}: column '{locator.columns[channel].name}': expected"
            f" {FEWEST_SAMPLES} values or more, got {rows.size}; leave it out"
        )
    here = replace(locator, rows=locator.rows[rows])
    check_time(t[rows], here)
    return Signal(t[rows], values[rows]), here


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
    is_known = np.isfinite(lat + lon + t)
    rows = np.flatnonzero(is_known)
    if not rows.size:
        return np.full_like(t, np.nan), np.full_like(t, np.nan), 0

    north, east = local_metres(lat, lon, origin=(lat[rows[0]], lon[rows[0]]))
    here = replace(locator, rows=rows)
    outliers = rows[find_outliers(t[rows], north[rows], east[rows], here)]
    if repair is None and outliers.size:
        first = outliers[0]
        raise InputError(
            f"{locator.place(first, 'lat')}: expected a position that a ship reaches"
            f" from those before and after, got {lat[first]:.5f}, {lon[first]:.5f}, one"
            f" of {outliers.size} outliers among {rows.size}; empty its cells, or leave"
            ' such rows to be filled with repair = "interpolate"',
            [REPAIR],
        )
    is_known[outliers] = False
    north[~is_known] = np.nan
    east[~is_known] = np.nan
    return north, east, outliers.size


def _make_velocity(signals: Signals) -> None:
    """Replace speed and course over ground by velocities to the north and east."""
    t, speed = signals.pop("sog")
    _, course = signals.pop("cog")
    signals["ground_north"] = Signal(t, speed * np.cos(course))
    signals["ground_east"] = Signal(t, speed * np.sin(course))
