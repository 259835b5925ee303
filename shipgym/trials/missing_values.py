"""Missing values of a log, refused or filled, and the check that time increases."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.resampling import FEWEST_SAMPLES, usual_step

#: The setting with which missing values are filled.
REPAIR = ("repair", "interpolate")


class FilledChannels(NamedTuple):
    """Channels without missing values, SI units, between first and last whole row."""

    t: Floats
    channels: dict[str, Floats]
    locator: Locator
    counts: dict[str, int]  # values filled in, by channel


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
    before, after = t[row - 1], t[row]
    later = locator.in_file("t", after, digits=10)
    change = f"stands still at {later}"
    if after < before:
        earlier = locator.in_file("t", before, digits=10)
        change = f"goes back from {earlier} to {later}"
    place = locator.place(row, "t")
    raise InputError(
        f"{place}: expected time to increase from row to row, got one that {change};"
        " sort the rows, remove the repeated ones, or split the file into one per run"
    )


def fill_missing(
    t: Floats, channels: Mapping[str, Floats], locator: Locator, repair: str | None
) -> FilledChannels:
    """Fill missing values by shape-preserving cubics (PCHIP) through their neighbours.

    Rows at either end that lack a value are left out. Raises InputError where `repair`
    is not "interpolate", a time is missing, less than half of the rows are whole, or a
    hole is too long.
    """
    _check_present(t, channels, locator, repair)
    check_time(t, locator)
    whole = _whole_rows(channels, locator)
    first, last = int(whole[0]), int(whole[-1])
    kept = slice(first, last + 1)
    locator = replace(locator, rows=locator.rows[kept])
    t = t[kept]
    filled, counts = {}, {}
    for name, every in channels.items():
        values = every[kept]
        is_missing = ~np.isfinite(values)
        counts[name] = int(is_missing.sum())
        if counts[name]:
            _check_holes(t, is_missing, name, locator)
            values = _interpolated(t, values, is_missing, is_heading=name == "psi")
        filled[name] = values
    return FilledChannels(t, filled, locator, counts)


def _check_present(
    t: Floats, channels: Mapping[str, Floats], locator: Locator, repair: str | None
) -> None:
    """Refuse missing times and, without `repair`, every missing value."""
    table = {"t": t, **channels}
    values = np.column_stack(list(table.values()))
    is_missing = ~np.isfinite(values)
    refused = is_missing if repair is None else is_missing[:, :1]
    if not refused.any():
        return
    row, column = np.argwhere(refused)[0]
    name = list(table)[column]
    remedy = 'repair = "interpolate" fills it from its neighbours, or remove the row'
    if name == "t":
        remedy = "time cannot be interpolated, remove the row"
    lacking = np.count_nonzero(is_missing.any(axis=1))
    raise InputError(
        f"{locator.place(row, name)}: expected a number, got no value"
        f" ({values[row, column]:g}); {remedy} ({lacking} of {t.size} rows lack a value)",
        () if name == "t" else (REPAIR,),
    )


def _whole_rows(
    channels: Mapping[str, Floats], locator: Locator
) -> npt.NDArray[np.intp]:
    """Rows without missing values; InputError if less than half, or less than three."""
    present = [np.isfinite(values) for values in channels.values()]
    is_whole = np.all(present, axis=0)
    rows = np.flatnonzero(is_whole)
    n_rows, n_whole = is_whole.size, rows.size
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
    most_rows, most_steps = 10, 20.0  # both are exceeded by a hole too long to fill
    edges = np.flatnonzero(np.diff(is_missing)) + 1
    first, after = edges[::2], edges[1::2]
    rows = after - first
    spans = t[after] - t[first - 1]
    is_long = spans > most_steps * usual_step(t)
    too_long = is_long & (rows > most_rows)
    if not too_long.any():
        return
    k = np.argmax(too_long)
    raise InputError(
        f"{locator.place(first[k], channel)}: expected a hole of at most"
        f" {most_steps:g} time steps to interpolate over, got {rows[k]} rows"
        f" without a value, over {locator.in_file('t', spans[k])}; split the file there,"
        " or leave out the rows or the column"
    )


def _interpolated(
    t: Floats, values: Floats, is_missing: Flags, *, is_heading: bool
) -> Floats:
    """Values with their gaps filled; headings without jumps."""
    from scipy.interpolate import PchipInterpolator

    known = values[~is_missing]
    if is_heading:
        known = np.unwrap(known)
    curve = PchipInterpolator(t[~is_missing], known)
    filled = values.copy()
    filled[~is_missing] = known
    filled[is_missing] = curve(t[is_missing])
    return filled
