"""Filters of single channels: running median and Savitzky-Golay."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import median_filter
from scipy.signal import savgol_coeffs, savgol_filter

from identification.regression.preprocess.noise import NOISY, noise_ratio
from shipgym.arrays import Floats

MEDIAN_WIDTH = 5  # samples
ORDER = 3  # of the local polynomials
LONGEST_FILTER = 0.2  # of the record
UNEVEN = 1e-3  # relative difference of time steps beyond which a record is filtered on an even grid


def median(t: ArrayLike, values: ArrayLike, width: int = MEDIAN_WIDTH) -> Floats:
    """Running median of `width` samples, odd; takes away spikes of up to half its width and keeps steps."""
    found: Floats = median_filter(np.asarray(values, dtype=float), width, mode="nearest")
    return found


def savitzky_golay(t: ArrayLike, values: ArrayLike, width: int | None = None) -> Floats:
    """Local cubic polynomials by least squares (Savitzky & Golay 1964, Analytical Chemistry 36(8)).

    Records with uneven steps are filtered on an even grid with as many samples. `t`, `values`: s and the unit
    of the channel, shape (n_samples,); `width`: samples, odd, at least 5; by default the one that generalised
    cross-validation picks, of at most a fifth of the record. Returns the values themselves where they are
    free of noise (`noise.NOISY`) or fewer than 25, the width not being given, shape (n_samples,).
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    longest = int(LONGEST_FILTER * len(t))
    if width is None and (longest < ORDER + 2 or noise_ratio(t, values) < NOISY):
        return values
    steps = np.diff(t)
    even = np.ptp(steps) <= UNEVEN * np.median(steps)
    grid = t if even else np.linspace(t[0], t[-1], len(t))
    on_grid = values if even else np.interp(grid, t, values)
    chosen = _best_width(on_grid, longest) if width is None else width
    filtered: Floats = savgol_filter(on_grid, chosen, ORDER)
    return filtered if even else np.interp(t, grid, filtered)


def _best_width(values: Floats, longest: int) -> int:
    """Width of least generalised cross-validation; widths grow by about a fifth."""
    sizes = np.geomspace(ORDER + 2, max(longest, ORDER + 2), 24)
    widths = np.unique(2 * (sizes.astype(int) // 2) + 1)
    widths = widths[widths <= len(values)]

    def criterion(width: int) -> float:
        left_out = values - savgol_filter(values, width, ORDER)
        freedom = 1.0 - float(savgol_coeffs(width, ORDER)[width // 2])
        return float(np.mean(left_out**2)) / freedom**2

    return int(min(widths.tolist(), key=criterion))
