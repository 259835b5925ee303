"""From a table's columns to channels in SI units, each with its time: one file of a log."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.angle_texts import read_angles
from shipgym.trials.clock_texts import read_clock, zone_seconds
from shipgym.trials.columns import Column, Locator, choose_columns
from shipgym.trials.missing_values import check_time, fill_missing
from shipgym.trials.navigation import local_metres
from shipgym.trials.plausibility.finding import settle
from shipgym.trials.plausibility.headings import check_heading
from shipgym.trials.plausibility.positions import (
    check_one_ship,
    outlier_finding,
    outliers,
    too_fast_steps,
)
from shipgym.trials.plausibility.ranges import check_ranges
from shipgym.trials.readers.log_table import LogTable, is_number
from shipgym.trials.resampling import (
    FEWEST_SAMPLES,
    Signal,
    Signals,
    have_own_clocks,
)
from shipgym.trials.units import si_factor

_PAIRS = (("lat", "lon"), ("sog", "cog"))  # of which none is of use alone


@dataclass(frozen=True)
class Recording:
    """The channels of one file, in SI units.

    Attributes
    ----------
    signals : dict of str to Signal
        By channel, headings without jumps.
    locator : Locator
        Where the values stand in the file.
    filled : dict of str to int
        How many values of a channel were filled in.
    start : float or None
        Clock at t = 0 in UTC, s since 1970 or of the day; None where the time is no
        clock's.
    has_positions : bool
        Whether x and y are positions of GNSS.
    """

    signals: Signals
    locator: Locator
    filled: Mapping[str, int]
    start: float | None
    has_positions: bool


class _RowTimes(NamedTuple):
    """Times of the rows of a table."""

    t: Floats  # s
    column: Column  # with the unit of `t` in messages
    start: float | None  # as in `Recording`


def read_recording(
    table: LogTable,
    columns: Mapping[str, Any] | None,
    repair: str | None,
    *,
    part: bool = False,
) -> Recording:
    """Read the chosen columns of a table, check them, and fill what is missing where that is asked for.

    `columns` and `part` are as :func:`.columns.choose_columns` takes them. Anything
    wrong with a file is an InputError that names line, column, value and remedy.
    """
    chosen = choose_columns(table, columns, part=part)
    _check_pairs(table, chosen)
    times = _read_times(table, chosen["t"])
    chosen["t"] = times.column
    channels = {
        channel: si_factor(channel, column.unit) * table.numbers(column.name)
        for channel, column in chosen.items()
        if channel not in ("t", "lat", "lon")
    }
    filled: dict[str, int] = {}
    has_positions = "lat" in chosen
    if has_positions:
        track, count = _local_track(table, chosen, times.t, repair)
        channels |= track
        filled = dict.fromkeys(track, count)
        chosen["x"] = replace(chosen.pop("lat"), unit="m")
        chosen["y"] = replace(chosen.pop("lon"), unit="m")

    locator = Locator(table, chosen, np.arange(times.t.size))
    is_whole = all(np.isfinite(one).all() for one in (times.t, *channels.values()))
    if is_whole:
        check_time(times.t, locator)
        signals = _signals(times.t, channels, locator)
    elif _at_own_rates(times.t, channels):
        signals = _signals_at_own_rates(times.t, channels, locator)
    else:
        whole = fill_missing(times.t, channels, locator, repair)
        locator, filled = whole.locator, whole.counts
        signals = _signals(whole.t, whole.channels, locator)
    _add_ground_velocity(table, signals)
    return Recording(signals, locator, filled, times.start, has_positions)


def _check_pairs(table: LogTable, chosen: Mapping[str, Column]) -> None:
    for pair in _PAIRS:
        present = [name for name in pair if name in chosen]
        if len(present) == 1:
            raise InputError(
                f"{table.path}: columns: expected {' and '.join(pair)}, got"
                f" {present[0]} alone; name the column of the other"
            )


def _read_times(table: LogTable, column: Column) -> _RowTimes:
    """Times of the rows: numbers in their unit, or clock times, which begin at zero."""
    cells = table.texts(column.name)
    if column.date is not None:
        dates = table.texts(column.date)
        cells = [
            f"{date} {time}".strip() for date, time in zip(dates, cells, strict=True)
        ]

    first = next((cell for cell in cells if cell), "0")
    if is_number(first.replace(",", ".")):
        clock = table.numbers(column.name) * si_factor("t", column.unit)
        if not column.unit.startswith("unix"):
            return _RowTimes(clock, column, None)
    else:
        clock = _read_clock_cells(table, column, cells)
    known = clock[np.isfinite(clock)]
    zero = float(known[0]) if known.size else 0.0
    start = zero - zone_seconds(column.zone, str(table.path))
    return _RowTimes(clock - zero, replace(column, unit="s"), start)


def _read_clock_cells(table: LogTable, column: Column, cells: list[str]) -> Floats:
    """Seconds since 1970 or of the day; InputError names the first cell that is no time."""
    try:
        return read_clock(cells).seconds
    except ValueError as error:
        row = cells.index(str(error)) if str(error) in cells else 0
        raise InputError(
            f"{table.path}: {table.place(row)}, column '{column.name}': expected a"
            " number, ISO 8601 (2024-05-31T09:30:00), or a time of day with its date in"
            f' another column: t = {{ column = "{column.name}", date = "..." }}, got'
            f" {cells[row][:40]!r}"
        ) from None


def _read_position(table: LogTable, column: Column) -> Floats:
    """Degrees of latitude or longitude in any of their forms."""
    cells = table.texts(column.name)
    try:
        return read_angles(cells, minutes=column.unit != "deg")
    except ValueError as error:
        cell = str(error)
    if is_number(cell):  # such as 1e-05
        return table.numbers(column.name)
    row = cells.index(cell) if cell in cells else 0
    raise InputError(
        f"{table.path}: {table.place(row)}, column '{column.name}': expected degrees"
        " (57.6872), degrees and minutes (57°41.234'N) or ddmm.mmm (5741.234N), got"
        f" {cell!r}"
    )


def _local_track(
    table: LogTable, chosen: Mapping[str, Column], t: Floats, repair: str | None
) -> tuple[dict[str, Floats], int]:
    """North and east of the first position, m, nan where there is none, and the number of outliers."""
    lat, lon = (_read_position(table, chosen[name]) for name in ("lat", "lon"))
    x, y = np.full((2, t.size), np.nan)
    known = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon) & np.isfinite(t))
    if not known.size:
        return {"x": x, "y": y}, 0

    locator = Locator(table, chosen, np.arange(t.size))
    settle(check_ranges({"lat": lat, "lon": lon}, locator))
    origin = lat[known[0]], lon[known[0]]
    x[known], y[known] = local_metres(lat[known], lon[known], origin)
    settle(check_one_ship(t[known], x[known], y[known], known, locator))
    too_fast = too_fast_steps(t[known], x[known], y[known])
    far = known[outliers(too_fast)]
    if far.size and repair is None:
        settle([outlier_finding(lat, lon, far, known.size, locator)])
    x[far] = y[far] = np.nan
    return {"x": x, "y": y}, far.size


def _at_own_rates(t: Floats, channels: Mapping[str, Floats]) -> bool:
    """Tell whether what is missing are rows between those of channels at different rates."""
    if not np.isfinite(t).all():
        return False
    return have_own_clocks(~np.isfinite(values) for values in channels.values())


def _signals(t: Floats, channels: Mapping[str, Floats], locator: Locator) -> Signals:
    """Checked channels on the clock of the rows."""
    settle(check_ranges({"t": t, **channels}, locator))
    signals = {channel: Signal(t, values) for channel, values in channels.items()}
    _unwrap(signals, locator)
    return signals


def _signals_at_own_rates(
    t: Floats, channels: Mapping[str, Floats], locator: Locator
) -> Signals:
    """Checked channels, each on the clock of the rows in which it has a value."""
    settle(check_ranges({"t": t, **channels}, locator))
    signals = {
        channel: _own_signal(channel, t, values, locator)
        for channel, values in channels.items()
    }
    if "psi" in channels:
        rows = locator.rows[np.isfinite(channels["psi"])]
        locator = replace(locator, rows=rows)
    _unwrap(signals, locator)
    return signals


def _own_signal(channel: str, t: Floats, values: Floats, locator: Locator) -> Signal:
    """Values of a channel where it has some; InputError for too few or time that goes back."""
    rows = np.flatnonzero(np.isfinite(values))
    clock, name = t[rows], locator.columns[channel].name
    if rows.size < FEWEST_SAMPLES:
        raise InputError(
            f"{locator.path}: column '{name}': expected {FEWEST_SAMPLES} values or"
            f" more, got {rows.size}; leave it out"
        )
    stands_still = np.diff(clock) <= 0.0
    if stands_still.any():
        k = int(np.argmax(stands_still))
        raise InputError(
            f"{locator.place(int(rows[k + 1]), 't')}: expected time to increase between"
            f" values of '{name}', got {clock[k]:.10g} and then {clock[k + 1]:.10g} s;"
            " sort the rows, or, where two ships or receivers are in the file, keep"
            " those of one"
        )
    return Signal(clock, values[rows])


def _unwrap(signals: Signals, locator: Locator) -> None:
    """Take the jumps at north out of headings and wind directions; refuse headings that turn too fast."""
    if "wind_from" in signals:
        t, logged = signals["wind_from"]
        signals["wind_from"] = Signal(t, np.unwrap(logged))
    if "psi" in signals:
        t, logged = signals["psi"]
        psi = np.unwrap(logged)
        settle(check_heading(t, psi, logged, locator))
        signals["psi"] = Signal(t, psi)


def _add_ground_velocity(table: LogTable, signals: Signals) -> None:
    """Replace speed and course over ground by velocities to the north and east."""
    if "sog" not in signals:
        return
    t, speed = signals.pop("sog")
    course = signals.pop("cog").values
    if speed.size != course.size:
        raise InputError(
            f"{table.path}: expected sog and cog in the same rows, got {speed.size}"
            f" values of sog and {course.size} of cog"
        )
    signals["ground_north"] = Signal(t, speed * np.cos(course))
    signals["ground_east"] = Signal(t, speed * np.sin(course))
