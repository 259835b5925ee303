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
    too_fast = _too_fast(t, x, y)
    if too_fast.size < 2:
        return np.zeros(t.size, dtype=bool)
    # the first and the last one have a neighbour on one side only
    to_it = np.insert(too_fast, 0, True)
    from_it = np.append(too_fast, True)
    is_outlier: Flags = to_it & from_it
    return is_outlier


def check_track(t: Floats, x: Floats, y: Floats, locator: Locator) -> None:
    """Refuse a track that jumps so often that two ships must be in the log.

    Units are those of `find_outliers`.
    """
    too_fast = _too_fast(t, x, y)
    steps = too_fast.size
    count = np.count_nonzero(too_fast)
    if steps < 2 or count <= 0.1 * steps:
        return

    k = np.argmax(too_fast)
    north = x[k + 1] - x[k]
    east = y[k + 1] - y[k]
    kilometres = np.hypot(north, east) / 1000.0
    duration = t[k + 1] - t[k]
    raise implausible(
        locator.place(k + 1, "lat"),
        f"expected the track of one ship, got a position that jumps {kilometres:.4g} km"
        f" within {duration:g} s, as in {count} of {steps} steps",
        "likely two ships are in one log: keep the rows of one, or declare the unit of"
        " lat and lon",
    )


def check_outliers(
    lat: Floats, lon: Floats, is_outlier: Flags, locator: Locator
) -> None:
    """Refuse outliers of positions, in degrees, that are not to be filled."""
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
    north = np.diff(x)
    east = np.diff(y)
    distance = np.hypot(north, east)
    duration = np.maximum(np.diff(t), shortest_step)
    too_fast: Flags = distance > fastest * duration
    return too_fast
