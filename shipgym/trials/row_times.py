"""Times of the rows of a table: numbers in their unit, clock times, repeated ones."""

import re
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.clock_texts import read_clock, spread_evenly
from shipgym.trials.columns import Column
from shipgym.trials.readers.cell_texts import is_number
from shipgym.trials.readers.log_table import REPAIR, LogTable
from shipgym.trials.resampling import usual_step
from shipgym.trials.units import si_factor

#: Beginnings of the units that count from a date.
_FROM_A_DATE = ("unix", "excel", "matlab")
_COMPACT = re.compile(
    r"((?:19|20)\d\d[01]\d[0-3]\d)?([0-2]\d)([0-5]\d)([0-5]\d(?:\.\d+)?)"
)


_PAUSE_S = 600.0  # put between the runs of a file


class RowTimes(NamedTuple):
    """Times of the rows of a table."""

    t: Floats  # s
    unit: str  # in which messages name them
    notes: list[str]


def read_times(table: LogTable, column: Column) -> RowTimes:
    """Times of the rows, those of clocks from the first one on.

    Raises InputError for the first cell that is no time.
    """
    cells = _time_cells(table, column)
    notes: list[str] = []
    compact = _with_colons(cells)
    if compact:
        notes.append(f"column '{column.name}' is the clock without colons, hhmmss")
    is_numeric = not compact and is_number(next(filter(None, cells), "0"))
    if not is_numeric:
        clock = _read_clock_cells(table, column, compact or cells)
    else:
        clock = si_factor("t", column.unit) * table.numbers(column.name)
        if column.unit.endswith("days"):
            clock = np.round(clock, 3)  # days have some nine decimals
        clock[np.isinf(clock)] = np.nan
    clock = _one_after_another(_spread(clock, notes), notes)
    if is_numeric and not column.unit.startswith(_FROM_A_DATE):
        return RowTimes(clock, column.unit, notes)
    known = clock[np.isfinite(clock)]
    zero = float(known[0]) if known.size else 0.0
    return RowTimes(clock - zero, "s", notes)


def _time_cells(table: LogTable, column: Column) -> list[str]:
    """Texts of the times, behind their dates; of plain numbers the first alone."""
    first = table.first_text(column.name)
    is_plain = table.plain_numbers(column.name) is not None
    if is_plain and column.date is None and not _COMPACT.fullmatch(first):
        return [first]
    cells = table.texts(column.name)
    if column.date is None:
        return cells
    # a spreadsheet writes dates with midnight as their time
    days = [re.sub(r" [0:. ]*$", "", date) for date in table.texts(column.date)]
    return [" ".join(parts).strip() for parts in zip(days, cells, strict=True)]


def _with_colons(cells: list[str]) -> list[str]:
    """Clock times that are written without colons, with or without the date; or none.

    Numbers that only look so count beyond 59, or do not pass a minute.
    """
    if not all(_COMPACT.fullmatch(cell) for cell in cells if cell):
        return []
    times = [_COMPACT.sub(r"\1 \2:\3:\4", cell).strip() for cell in cells]
    minutes = {time[:-3] for time in times}
    has_date = any(" " in time for time in times)
    return times if has_date or len(minutes) > 1 else []


def _read_clock_cells(table: LogTable, column: Column, cells: list[str]) -> Floats:
    """Seconds since 1970 or of the day; InputError for the first invalid cell."""
    try:
        return read_clock(cells)
    except ValueError as error:
        wrong = str(error)
    row = cells.index(wrong) if wrong in cells else 0
    raise InputError(
        f"{table.cell(row, column.name)}: expected a number, ISO 8601"
        " (2024-05-31T09:30:00), or a time of day with its date in another column:"
        f' t = {{ column = "{column.name}", date = "..." }}, got {cells[row][:40]!r}',
        [REPAIR],
    )


def _spread(clock: Floats, notes: list[str]) -> Floats:
    """Times whose clock is too coarse for the rows, spread until its next one.

    A few rows at one time are left to the check that time increases.
    """
    steps = np.diff(clock)
    repeats = np.count_nonzero(steps == 0.0)
    firsts = np.flatnonzero(np.append(True, steps > 0.0))
    is_coarse = 3 * repeats >= steps.size > 3 and firsts.size >= 3
    if not is_coarse or not np.all(steps >= 0.0):
        return clock
    moments = clock[firsts]
    tick = usual_step(moments)
    sizes = np.diff(firsts, append=clock.size)
    usual = int(np.median(sizes))
    notes.append(
        f"the clock shows {repeats} of {clock.size} times again: it counts in steps of"
        f" {tick:.4g} s, over which the rows are spread, {usual} a step"
    )
    group = np.repeat(np.arange(firsts.size), sizes)
    return spread_evenly(group, moments, tick, usual)


def _one_after_another(clock: Floats, notes: list[str]) -> Floats:
    """Times of several runs in one file, each after the one before with a pause.

    Where time goes back between runs of 20 rows or more; a clock that is set back by
    less than 10 s or an hour is left to the check that time increases.
    """
    goes_back = np.diff(clock) < 0.0
    starts = np.flatnonzero(goes_back) + 1
    back = clock[starts - 1] - clock[starts]
    rows = np.diff(starts, prepend=0, append=clock.size)
    is_hour = (back > 1700.0) & (back < 3700.0)
    is_clock = is_hour | (back < 10.0)
    if not starts.size or is_clock.any() or rows.min() < 20:
        return clock
    notes.append(
        f"time goes back by {back[0]:.6g} s: another run begins; the {rows.size} runs"
        f" are read {_PAUSE_S:g} s after each other"
    )
    shifts = np.zeros_like(clock)
    shifts[starts] = back + _PAUSE_S
    return clock + np.cumsum(shifts)
