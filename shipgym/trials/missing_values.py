"""Checks that time increases, and that no value is missing."""

from collections.abc import Mapping

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.columns import Locator
from shipgym.trials.readers.log_table import REPAIR
from shipgym.trials.resampling import FEWEST_SAMPLES


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
    earlier, later = (locator.in_file("t", one) for one in t[row - 1 : row + 1])
    change = f"goes back from {earlier} to {later}"
    if t[row] >= t[row - 1]:
        change = f"stands still at {later}"
    raise InputError(
        f"{locator.place(row, 't')}: expected time to increase from row to row, got one"
        f" that {change}; sort the rows, remove the repeated ones, keep those of one"
        " receiver, split the file into one per run, or log UTC where a clock was set"
        " back, as at the end of summer"
    )


def check_present(
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
