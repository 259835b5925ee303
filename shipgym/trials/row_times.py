"""Times of the rows of a table: numbers in their unit, clock times, repeated ones."""

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.clock_texts import DAY, read_clock, spread_evenly, zone_seconds
from shipgym.trials.columns import Column
from shipgym.trials.readers.cell_texts import is_number
from shipgym.trials.readers.log_table import REPAIR, LogTable
from shipgym.trials.units import si_factor

_WEEK = 7.0 * DAY
#: Zero of the units that count from a date, s since 1970.
_EPOCHS = {
    "unix": 0.0,
    "unix ms": 0.0,
    "unix us": 0.0,
    "unix ns": 0.0,
    "excel days": -25_569.0 * DAY,
    "excel days 1904": -24_107.0 * DAY,
    "matlab days": -719_529.0 * DAY,
    # 1980-01-06, less the leap seconds since 2017
    "gps s": 315_964_782.0,
    "gps tow": 315_964_782.0,
    "gps tow ms": 315_964_782.0,
}
_STAMP = re.compile(r"\d{9,10}\.\d{1,9}")
_COMPACT = re.compile(
    r"(?P<date>(?:19|20)\d\d[01]\d[0-3]\d)?(?P<time>[0-2]\d[0-5]\d[0-5]\d(?:\.\d+)?)"
)


class RowTimes(NamedTuple):
    """Times of the rows of a table."""

    t: Floats  # s
    unit: str  # in which messages name them
    start: float | None  # of the clock at t = 0, UTC; None where it is no clock's
    notes: list[str]


def read_times(table: LogTable, column: Column) -> RowTimes:
    """Times of the rows, those of clocks from the first one on.

    Raises InputError for the first cell that is no time.
    """
    is_week_time = column.unit.startswith("gps tow")
    cells = _time_cells(table, column, is_week_time)
    notes: list[str] = []
    if _are_unpadded(cells):
        cells = [_padded(cell) for cell in cells]
        table = replace(table, cells={**table.cells, column.name: cells})
        notes.append(
            f"the digits behind the point of column '{column.name}' count nanoseconds"
        )
    first = next(filter(None, cells), "0")
    is_numeric = is_number(first.replace(",", "."))
    if _are_compact(cells):
        is_numeric = False
        cells = [_parted(cell) for cell in cells]
        notes.append(f"column '{column.name}' is the clock without colons, hhmmss")
    if is_numeric:
        clock = _numeric_clock(table, column)
    else:
        clock = _read_clock_cells(table, column, cells)
    if is_week_time:
        clock = _week_times(table, column, clock, notes)
    clock = _spread(clock, notes)
    if is_numeric and column.unit not in _EPOCHS:
        return RowTimes(clock, column.unit, start=None, notes=notes)

    if is_numeric:
        clock = clock + _EPOCHS[column.unit]
    known = clock[np.isfinite(clock)]
    zero = float(known[0]) if known.size else 0.0
    ahead = zone_seconds(column.zone, str(table.path))
    return RowTimes(clock - zero, unit="s", start=zero - ahead, notes=notes)


def _time_cells(table: LogTable, column: Column, is_week_time: bool) -> list[str]:
    """Texts of the times, behind their dates; of plain numbers the first alone."""
    first = table.first_text(column.name)
    is_plain = table.plain_numbers(column.name) is not None
    may_be_compact = _COMPACT.fullmatch(first) is not None
    if is_plain and column.date is None and not may_be_compact:
        return [first]
    cells = table.texts(column.name)
    if column.date is None or is_week_time:
        return cells
    dates = table.texts(column.date)
    moments = []
    for date, cell in zip(dates, cells, strict=True):
        moment = f"{_day(date)} {cell}"
        moments.append(moment.strip())
    return moments


def _numeric_clock(table: LogTable, column: Column) -> Floats:
    """Times that are numbers, s from the zero of their unit."""
    numbers = table.numbers(column.name)
    clock = si_factor("t", column.unit) * numbers
    if column.nanoseconds is not None:
        clock = clock + 1e-9 * table.numbers(column.nanoseconds)
    if column.unit in ("excel days", "excel days 1904", "matlab days"):
        clock = np.round(clock, 3)  # days have some nine decimals
    return clock


def _are_unpadded(cells: list[str]) -> bool:
    """Return whether fractions of seconds are counts of nanoseconds, without zeros.

    As ROS joins seconds and nanoseconds: then alone the times increase.
    """
    stamps = [cell for cell in cells if _STAMP.fullmatch(cell)]
    if len(stamps) < 3 or len(stamps) < len(cells):
        return False
    as_written = [float(stamp) for stamp in stamps]
    as_counts = [float(_padded(stamp)) for stamp in stamps]
    goes_back = np.any(np.diff(as_written) <= 0.0)
    increases = np.all(np.diff(as_counts) > 0.0)
    return bool(goes_back and increases)


def _padded(stamp: str) -> str:
    """A time whose fraction has nine digits."""
    whole, _, count = stamp.partition(".")
    return f"{whole}.{count:0>9}"


def _are_compact(cells: list[str]) -> bool:
    """Return whether cells are clock times without colons, with or without the date.

    Numbers that only look so count beyond 59, or do not pass a minute.
    """
    minutes = set()
    dated = []
    for cell in filter(None, cells):
        match = _COMPACT.fullmatch(cell)
        if match is None:
            return False
        hours_and_minutes = match["time"][:4]
        minutes.add(hours_and_minutes)
        dated.append(bool(match["date"]))

    have_date = bool(dated) and all(dated)
    return have_date or len(minutes) > 1


def _parted(cell: str) -> str:
    """A clock time, or date and time, with colons."""
    match = _COMPACT.fullmatch(cell)
    if match is None:
        return cell
    time = match["time"]
    date = match["date"] or ""
    if date:
        date = f"{date[:4]}-{date[4:6]}-{date[6:8]} "
    return f"{date}{time[:2]}:{time[2:4]}:{time[4:]}"


def _day(date: str) -> str:
    """The day of a date that a spreadsheet wrote with midnight as its time."""
    day, blank, time = date.partition(" ")
    is_midnight = bool(blank) and not time.strip("0:. ")
    return day if is_midnight else date


def _week_times(
    table: LogTable, column: Column, of_week: Floats, notes: list[str]
) -> Floats:
    """Seconds since GPS time 0, by the time of the week and the column of weeks."""
    if column.date is None:
        return np.unwrap(of_week, period=_WEEK)
    weeks = table.numbers(column.date)
    first = float(weeks[0]) if weeks.size else 0.0
    weeks_of_counter = 1024
    if first < weeks_of_counter:
        turned = 2 * weeks_of_counter  # since 2019
        notes.append(
            f"GPS week {first:.0f} in column '{column.date}' is counted from the last"
            f" rollover of 1024 weeks: read as week {first + turned:.0f}"
        )
        weeks = weeks + turned
    return weeks * _WEEK + of_week


def _read_clock_cells(table: LogTable, column: Column, cells: list[str]) -> Floats:
    """Seconds since 1970 or of the day; InputError for the first invalid cell."""
    try:
        return read_clock(cells)
    except ValueError as error:
        wrong = str(error)
    row = cells.index(wrong) if wrong in cells else 0
    place = table.cell(row, column.name)
    beginning = cells[row][:40]
    raise InputError(
        f"{place}: expected a number, ISO 8601"
        " (2024-05-31T09:30:00), or a time of day with its date in another column:"
        f' t = {{ column = "{column.name}", date = "..." }}, got {beginning!r}',
        [REPAIR],
    )


def _spread(clock: Floats, notes: list[str]) -> Floats:
    """Times whose clock is too coarse for the rows, spread until its next one.

    A few rows at one time are left to the check that time increases.
    """
    if not np.isfinite(clock).all():
        return clock
    steps = np.diff(clock)
    repeats = np.count_nonzero(steps == 0.0)
    is_coarse = 3 * repeats >= steps.size and steps.size > 3
    if not is_coarse or not np.all(steps >= 0.0):
        return clock
    firsts = np.flatnonzero(np.concatenate([[True], steps > 0.0]))
    moments = clock[firsts]
    if moments.size < 3:
        return clock

    tick = float(np.median(np.diff(moments)))
    sizes = np.diff(np.append(firsts, clock.size))
    usual = int(np.median(sizes))
    group = np.repeat(np.arange(firsts.size), sizes)
    spread = spread_evenly(group, moments, tick, usual)
    notes.append(
        f"the clock shows {repeats} of {clock.size} times again: it counts in steps of"
        f" {tick:.4g} s, over which the rows are spread, {usual} a step"
    )
    return spread
