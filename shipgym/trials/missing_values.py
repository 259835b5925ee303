"""Missing values of a log, refused or filled, and the check that time increases."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

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
    if not stands_still.any():
        return
    row = int(np.argmax(stands_still)) + 1
    earlier, later = (
        locator.in_file("t", one, digits=10) for one in t[row - 1 : row + 1]
    )
    change = f"goes back from {earlier} to {later}"
    if t[row] >= t[row - 1]:
        change = f"stands still at {later}"
    raise InputError(
        f"{locator.place(row, 't')}: expected time to increase from row to row, got one"
        f" that {change}; sort the rows, remove the repeated ones, keep those of one"
        " receiver, split the file into one per run, or log UTC where a clock was set"
        " back, as at the end of summer"
    )


def fill_missing(
    t: Floats, channels: Mapping[str, Floats], locator: Locator, repair: str | None
) -> tuple[Floats, dict[str, Floats], Locator, dict[str, int]]:
    """Fill missing values by shape-preserving cubics (PCHIP) through their neighbours.

    Rows at either end that lack a value are left out. Returns times, channels, locator
    and counts of filled values. Raises InputError where `repair` is not "interpolate",
    a time is missing, no row is whole, or a hole is too long.
    """
    _check_present(t, channels, locator, repair)
    rows = np.flatnonzero(np.isfinite([*channels.values()]).all(axis=0))
    if rows.size < FEWEST_SAMPLES:
        raise InputError(
            f"{locator.path}: expected rows without missing values to interpolate from,"
            " got none; leave out the column that is mostly empty"
        )
    kept = slice(rows[0], rows[-1] + 1)
    t = t[kept]
    locator = replace(locator, rows=locator.rows[kept])
    filled = {}
    counts = {}
    for name, every in channels.items():
        values = every[kept]
        is_missing = ~np.isfinite(values)
        if is_missing.any():
            _check_holes(t, is_missing, name, locator)
            values = _interpolated(t, values, is_missing, is_angle=name == "psi")
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
    remedy = 'repair = "interpolate" fills it from its neighbours, or remove the row'
    if name == "t":
        remedy = "time cannot be interpolated, remove the row"
    raise InputError(
        f"{locator.place(row, name)}: expected a number, got no value"
        f" ({values[row, column]:g}); {remedy}"
        f" ({is_missing.any(axis=1).sum()} of {t.size} rows lack a value)",
        [REPAIR],
    )


def _check_holes(t: Floats, is_missing: Flags, channel: str, locator: Locator) -> None:
    """Refuse to fill a hole of many rows; the first and the last row are whole."""
    # both are exceeded by a hole too long to fill
    most_rows = 10
    most_steps = 20.0
    first, after = (np.flatnonzero(np.diff(is_missing)) + 1).reshape(-1, 2).T
    rows = after - first
    spans = t[after] - t[first - 1]
    too_long = (spans > most_steps * usual_step(t)) & (rows > most_rows)
    if too_long.any():
        k = int(too_long.argmax())
        raise InputError(
            f"{locator.place(first[k], channel)}: expected a hole of at most"
            f" {most_steps:g} time steps to interpolate over, got {rows[k]} rows"
            f" without a value, over {locator.in_file('t', spans[k])}; split the file"
            " there, or leave out the rows or the column"
        )


def _interpolated(
    t: Floats, values: Floats, is_missing: Flags, *, is_angle: bool
) -> Floats:
    """Values with their gaps filled; headings without jumps."""
    from scipy.interpolate import PchipInterpolator

    filled = values.copy()
    if is_angle:
        filled[~is_missing] = np.unwrap(values[~is_missing])
    curve = PchipInterpolator(t[~is_missing], filled[~is_missing])
    filled[is_missing] = curve(t[is_missing])
    return filled
