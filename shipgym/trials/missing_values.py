"""Missing values of a log, refused or filled, and the check that time increases."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.readers.log_table import REPAIR
from shipgym.trials.resampling import FEWEST_SAMPLES, usual_step


def check_time(t: Floats, locator: Locator) -> None:
    """Refuse fewer than three times, s, and time that stands still or goes back."""
    if t.size < FEWEST_SAMPLES:
        raise InputError(
            f"{locator.path}: expected at least {FEWEST_SAMPLES} rows below the header,"
            f" got {t.size}; export the whole manoeuvre"
        )
    nanosecond = 1e-9
    stands_still = np.diff(t) <= nanosecond
    if stands_still.any():
        row = int(np.argmax(stands_still)) + 1
        _refuse_time(t, row, locator)


def _refuse_time(t: Floats, row: int, locator: Locator) -> None:
    before = t[row - 1]
    after = t[row]
    earlier = locator.in_file("t", before, digits=10)
    later = locator.in_file("t", after, digits=10)
    remedy = "sort the rows, remove the repeated ones"
    if after < before:
        change = f"goes back from {earlier} to {later}"
        if 1700.0 < before - after < 3700.0:
            remedy = "where a clock was set back, as at the end of summer, log UTC"
    else:
        change = f"stands still at {later}"
    place = locator.place(row, "t")
    raise InputError(
        f"{place}: expected time to increase from row to row, got one that {change};"
        f" {remedy}, or split the file into one per run"
    )


def fill_missing(
    t: Floats, channels: Mapping[str, Floats], locator: Locator, repair: str | None
) -> tuple[Floats, dict[str, Floats], Locator, dict[str, int]]:
    """Fill missing values by shape-preserving cubics (PCHIP) through their neighbours.

    Rows at either end that lack a value are left out. Returns times, channels, locator
    and counts of filled values. Raises InputError where `repair` is not "interpolate",
    a time is missing, less than half of the rows are whole, or a hole is too long.
    """
    _check_present(t, channels, locator, repair)
    check_time(t, locator)
    whole = _whole_rows(channels, locator)
    kept = slice(whole[0], whole[-1] + 1)
    t = t[kept]
    locator = replace(locator, rows=locator.rows[kept])

    filled = {}
    counts = {}
    for name, every in channels.items():
        values = every[kept]
        is_missing = ~np.isfinite(values)
        if is_missing.any():
            _check_holes(t, is_missing, name, locator)
            is_heading = name == "psi"
            values = _interpolated(t, values, is_missing, is_heading=is_heading)
        filled[name] = values
        counts[name] = int(is_missing.sum())
    return t, filled, locator, counts


def _check_present(
    t: Floats, channels: Mapping[str, Floats], locator: Locator, repair: str | None
) -> None:
    """Refuse missing times and, without `repair`, every missing value."""
    values = np.column_stack([t, *channels.values()])
    is_missing = ~np.isfinite(values)
    refused = is_missing if repair is None else is_missing[:, :1]
    if not refused.any():
        return

    row, column = np.argwhere(refused)[0]
    name = ["t", *channels][column]
    place = locator.place(row, name)
    found = values[row, column]
    lacking = np.count_nonzero(is_missing.any(axis=1))
    remedy = 'repair = "interpolate" fills it from its neighbours, or remove the row'
    proposals = [REPAIR]
    if name == "t":
        remedy = "time cannot be interpolated, remove the row"
    raise InputError(
        f"{place}: expected a number, got no value ({found:g}); {remedy}"
        f" ({lacking} of {t.size} rows lack a value)",
        proposals,
    )


def _whole_rows(
    channels: Mapping[str, Floats], locator: Locator
) -> npt.NDArray[np.intp]:
    """Rows without missing values; InputError if less than half, or less than three."""
    is_present = np.isfinite(list(channels.values()))
    is_whole = is_present.all(axis=0)
    rows = np.flatnonzero(is_whole)
    n_rows = is_whole.size
    n_whole = rows.size
    fewest = max(FEWEST_SAMPLES, n_rows // 2)
    if n_whole < fewest:
        raise InputError(
            f"{locator.path}: expected at least half of the {n_rows} rows, and"
            f" {FEWEST_SAMPLES}, without missing values to interpolate from, got only"
            f" {n_whole}; leave out the column that is mostly empty"
        )
    return rows


def _check_holes(t: Floats, is_missing: Flags, channel: str, locator: Locator) -> None:
    """Refuse to fill a hole of many rows; the first and the last row are whole."""
    # both are exceeded by a hole too long to fill
    most_rows = 10
    most_steps = 20.0
    edges = np.flatnonzero(np.diff(is_missing)) + 1
    first = edges[::2]
    after = edges[1::2]
    rows = after - first
    spans = t[after] - t[first - 1]
    is_long = spans > most_steps * usual_step(t)
    too_long = is_long & (rows > most_rows)
    if not too_long.any():
        return

    k = int(too_long.argmax())
    place = locator.place(first[k], channel)
    span = locator.in_file("t", spans[k])
    raise InputError(
        f"{place}: expected a hole of at most {most_steps:g} time steps to interpolate"
        f" over, got {rows[k]} rows without a value, over {span}; split the file there,"
        " or leave out the rows or the column"
    )


def _interpolated(
    t: Floats, values: Floats, is_missing: Flags, *, is_heading: bool
) -> Floats:
    """Values with their gaps filled; headings without jumps."""
    from scipy.interpolate import PchipInterpolator

    is_known = ~is_missing
    known = values[is_known]
    if is_heading:
        known = np.unwrap(known)
    curve = PchipInterpolator(t[is_known], known)
    filled = values.copy()
    filled[is_known] = known
    filled[is_missing] = curve(t[is_missing])
    return filled
