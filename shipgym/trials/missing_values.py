"""Missing values of a log: refused, or filled where no hole is too long; and time that goes on."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.resampling import FEWEST_SAMPLES

#: A hole of more rows that lasts more median time steps is too long to fill.
LONGEST_HOLE_ROWS = 10
LONGEST_HOLE_STEPS = 20.0

#: Time that goes on by less stands still.
SHORTEST_STEP_S = 1e-9

#: The setting with which missing values are filled.
REPAIR = ("repair", "interpolate")


class FilledChannels(NamedTuple):
    """Channels without missing values, SI units, of the rows from the first whole one to the last."""

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
    stands_still = np.diff(t) <= SHORTEST_STEP_S
    if stands_still.any():
        _refuse_time(t, int(np.argmax(stands_still)), locator)


def _refuse_time(t: Floats, k: int, locator: Locator) -> None:
    """Name the sample after the k-th, whose time is not later."""
    before, after = (locator.in_file("t", float(one)) for one in t[k : k + 2])
    change = f"stands still at {after:.10g}"
    if after < before:
        change = f"goes back from {before:.10g} to {after:.10g}"
    unit = locator.columns["t"].unit
    raise InputError(
        f"{locator.place(k + 1, 't')}: expected time to increase from row to row, got"
        f" one that {change} {unit}; sort the rows, remove the repeated ones, or split"
        " the file into one per run"
    )


def fill_missing(
    t: Floats, channels: Mapping[str, Floats], locator: Locator, repair: str | None
) -> FilledChannels:
    """Fill missing values by shape-preserving cubics (PCHIP) through their neighbours.

    Rows at either end that lack a value are left out. Raises InputError where `repair`
    is not "interpolate", a time is missing, less than half of the rows are whole, or a
    hole is too long.
    """
    missing = {name: ~np.isfinite(values) for name, values in channels.items()}
    no_time = ~np.isfinite(t)
    lacking = np.logical_or.reduce([no_time, *missing.values()])
    if no_time.any() or (repair is None and lacking.any()):
        _refuse_missing(t, channels, locator, int(lacking.sum()), repair)

    check_time(t, locator)
    whole = np.flatnonzero(~lacking)
    if whole.size < max(FEWEST_SAMPLES, t.size // 2):
        raise InputError(
            f"{locator.path}: expected at least half of the {t.size} rows, and"
            f" {FEWEST_SAMPLES}, without missing values to interpolate from, got only"
            f" {whole.size}; leave out the column that is mostly empty"
        )

    kept = slice(int(whole[0]), int(whole[-1]) + 1)
    locator = replace(locator, rows=locator.rows[kept])
    filled, counts = {}, {}
    for name, values in channels.items():
        gaps = missing[name][kept]
        filled[name] = values[kept]
        counts[name] = int(gaps.sum())
        if counts[name]:
            _check_holes(t[kept], gaps, name, locator)
            filled[name] = _interpolated(t[kept], values[kept], gaps, name == "psi")
    return FilledChannels(t[kept], filled, locator, counts)


def _refuse_missing(
    t: Floats,
    channels: Mapping[str, Floats],
    locator: Locator,
    rows: int,
    repair: str | None,
) -> None:
    """Name the first missing value; a missing time first where the others could be filled."""
    names = ["t"] if repair is not None else ["t", *channels]
    table = np.array([t, *channels.values()])[: len(names)]
    k, column = (int(one) for one in np.argwhere(~np.isfinite(table.T))[0])
    name = names[column]
    remedy = 'repair = "interpolate" fills it from its neighbours, or remove the row'
    if name == "t":
        remedy = "time cannot be interpolated, remove the row"
    raise InputError(
        f"{locator.place(k, name)}: expected a number, got no value"
        f" ({table[column, k]:g}); {remedy} ({rows} of {t.size} rows lack a value)",
        () if name == "t" else (REPAIR,),
    )


def _check_holes(t: Floats, missing: Flags, channel: str, locator: Locator) -> None:
    """Refuse to fill a hole of many rows; the first and the last row are whole."""
    edges = np.flatnonzero(np.diff(missing))
    first, after = edges[::2] + 1, edges[1::2] + 1
    rows = after - first
    spans = t[after] - t[first - 1]
    longest = LONGEST_HOLE_STEPS * np.median(np.diff(t))
    too_long = (rows > LONGEST_HOLE_ROWS) & (spans > longest)
    if not too_long.any():
        return
    i = int(np.argmax(too_long))
    span = locator.in_file("t", float(spans[i]))
    raise InputError(
        f"{locator.place(int(first[i]), channel)}: expected a hole of at most"
        f" {LONGEST_HOLE_STEPS:g} time steps to interpolate over, got {rows[i]} rows"
        f" without a value, over {span:g} {locator.columns['t'].unit}; split the file"
        " there, or leave out the rows or the column"
    )


def _interpolated(t: Floats, values: Floats, gaps: Flags, is_heading: bool) -> Floats:
    """Values with their gaps filled; headings without jumps."""
    from scipy.interpolate import PchipInterpolator

    known = values[~gaps]
    if is_heading:
        known = np.unwrap(known)
    filled = values.copy()
    filled[~gaps] = known
    filled[gaps] = PchipInterpolator(t[~gaps], known)(t[gaps])
    return filled
