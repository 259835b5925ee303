"""Positions that no ship reaches, and tracks of two ships in one log."""

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.trials.columns import Locator
from shipgym.trials.missing_values import REPAIR
from shipgym.trials.plausibility.refusal import Proposal, implausible


def find_outliers(t: Floats, x: Floats, y: Floats) -> Flags:
    """Positions that no ship reaches from the one before, nor the next one from them.

    Time in s and positions in m, shape (n_positions,).
    """
    is_outlier = np.zeros(t.size, dtype=bool)
    too_fast = _too_fast(t, x, y)
    if too_fast.size >= 2:
        is_outlier[0] = too_fast[0]
        is_outlier[1:-1] = too_fast[:-1] & too_fast[1:]
        is_outlier[-1] = too_fast[-1]
    return is_outlier


def check_track(t: Floats, x: Floats, y: Floats, locator: Locator) -> None:
    """Refuse a track that jumps so often that two ships must be in the log.

    Units are those of `find_outliers`.
    """
    too_fast = _too_fast(t, x, y)
    count = np.count_nonzero(too_fast)
    if too_fast.size < 2 or count <= 0.1 * too_fast.size:
        return
    k = np.argmax(too_fast)
    distance = np.hypot(x[k + 1] - x[k], y[k + 1] - y[k]) / 1000.0
    duration = t[k + 1] - t[k]
    raise implausible(
        locator.place(k + 1, "lat"),
        f"expected the track of one ship, got a position that jumps {distance:.4g} km"
        f" within {duration:g} s, as in {count} of {too_fast.size} steps",
        "likely two ships are in one log: keep the rows of one, or declare the unit of"
        " lat and lon",
    )


def check_outliers(
    lat: Floats, lon: Floats, is_outlier: Flags, locator: Locator
) -> None:
    """Refuse outliers of positions, in degrees, that nobody asked to fill."""
    if not is_outlier.any():
        return
    k = np.argmax(is_outlier)
    count = np.count_nonzero(is_outlier)
    raise implausible(
        locator.place(k, "lat"),
        "expected a position that a ship reaches from those before and after, got"
        f" {lat[k]:.5f}, {lon[k]:.5f}, one of {count} outliers among {lat.size}",
        'empty its cells, or leave such rows to be filled with repair = "interpolate"',
        Proposal(*REPAIR),
    )


def _too_fast(t: Floats, x: Floats, y: Floats) -> Flags:
    """Flags of steps that are faster than any ship, shape (n_positions - 1,)."""
    fastest = 50.0  # m/s
    shortest_step = 0.1  # s, in which receivers write their times
    distance = np.hypot(np.diff(x), np.diff(y))
    duration = np.maximum(np.diff(t), shortest_step)
    too_fast: Flags = distance > fastest * duration
    return too_fast
