"""Positions that no ship reaches from those before and after, and tracks of two ships in one log."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from shipgym.arrays import Flags, Floats
from shipgym.trials.columns import Locator
from shipgym.trials.missing_values import REPAIR
from shipgym.trials.plausibility.finding import LogFinding, Proposal

FASTEST = 50.0  # m/s, of any ship
SHORTEST_STEP_S = 0.1  # in which receivers write their times
MOST_FAST_STEPS = 0.1  # share; more are two ships in turn


def too_fast_steps(t: Floats, x: Floats, y: Floats) -> Flags:
    """Steps between positions, m, that are faster than any ship; shape (n_positions - 1,)."""
    distance = np.hypot(np.diff(x), np.diff(y))
    return np.asarray(distance > FASTEST * np.maximum(np.diff(t), SHORTEST_STEP_S))


def outliers(too_fast: Flags) -> Flags:
    """Positions that no ship reaches from the one before nor leaves to the next."""
    if too_fast.size < 2:
        return np.zeros(too_fast.size + 1, dtype=bool)
    return np.r_[too_fast, True] & np.r_[True, too_fast]


def check_one_ship(
    t: Floats,
    x: Floats,
    y: Floats,
    rows: npt.NDArray[np.intp],
    locator: Locator,
) -> Iterator[LogFinding]:
    """Find a track that jumps so often that two ships must be in the log.

    Time in s and positions in m, shape (n_positions,), with the samples of the locator
    that they are.
    """
    too_fast = too_fast_steps(t, x, y)
    if too_fast.size < 2 or np.mean(too_fast) <= MOST_FAST_STEPS:
        return
    k = int(np.argmax(too_fast))
    distance = np.hypot(x[k + 1] - x[k], y[k + 1] - y[k]) / 1000.0
    yield LogFinding(
        locator.place(int(rows[k + 1]), "lat"),
        f"expected the track of one ship, got a position that jumps {distance:.4g} km"
        f" within {t[k + 1] - t[k]:g} s, as in {np.count_nonzero(too_fast)} of"
        f" {too_fast.size} steps",
        "likely two ships are in one log: keep the rows of one, or declare the unit of"
        " lat and lon",
    )


def outlier_finding(
    lat: Floats, lon: Floats, far: npt.NDArray[np.intp], count: int, locator: Locator
) -> LogFinding:
    """Outliers of the positions that nobody asked to fill: samples `far`, of `count` positions."""
    k = int(far[0])
    return LogFinding(
        locator.place(k, "lat"),
        "expected a position that a ship reaches from those before and after, got"
        f" {lat[k]:.5f}, {lon[k]:.5f}, one of {far.size} outliers among {count}",
        'empty its cells, or leave such rows to be filled with repair = "interpolate"',
        (Proposal(*REPAIR),),
    )
