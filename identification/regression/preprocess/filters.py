"""Filters of single channels: running median, Savitzky-Golay and smoothing splines."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded
from scipy.ndimage import median_filter
from scipy.signal import savgol_coeffs, savgol_filter

from identification.regression.preprocess.noise import NOISY, noise_ratio
from shipgym.arrays import Floats

MEDIAN_WIDTH = 5  # samples
ORDER = 3  # of the local polynomials
LONGEST_FILTER = 0.2  # of the record
# relative difference of time steps beyond which a record is filtered on an even grid
UNEVEN = 1e-3
#: Decades of stiffness tried, of a spline on knots a unit apart.
STIFFNESSES = tuple(float(stiffness) for stiffness in np.arange(-2.0, 8.01, 0.25))


def median(t: ArrayLike, values: ArrayLike, width: int = MEDIAN_WIDTH) -> Floats:
    """Running median of `width` samples, odd; takes away spikes of up to half its width and keeps steps."""
    return median_filter(np.asarray(values, dtype=float), width, mode="nearest")


def savitzky_golay(t: ArrayLike, values: ArrayLike, width: int | None = None) -> Floats:
    """Local cubic polynomials by least squares (Savitzky & Golay 1964, Analytical Chemistry 36(8)).

    Records with uneven steps are filtered on an even grid with as many samples.
    `width`: samples, odd, at least 5; by default the one that generalised
    cross-validation picks, of at most a fifth of the record. Without a width, values
    that are free of noise (`noise.NOISY`) or fewer than 25 are returned as they are.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    longest = int(LONGEST_FILTER * len(t))
    if width is None and (longest < ORDER + 2 or noise_ratio(t, values) < NOISY):
        return values
    uneven = np.ptp(np.diff(t)) > UNEVEN * np.median(np.diff(t))
    grid = np.linspace(t[0], t[-1], len(t))
    on_grid = np.interp(grid, t, values) if uneven else values
    chosen = _best_width(on_grid, longest) if width is None else width
    filtered: Floats = savgol_filter(on_grid, chosen, ORDER)
    return np.interp(t, grid, filtered) if uneven else filtered


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


def smooth(t: ArrayLike, values: ArrayLike) -> Floats:
    """Smooth a channel by a cubic spline whose stiffness generalised cross-validation picks.

    The natural smoothing spline of Reinsch 1967 (Numerische Mathematik 10); the trace
    in the criterion of Craven & Wahba 1979 (Numerische Mathematik 31) is estimated by
    random signs (Girard 1989), always the same ones. Times in s, of shape (n_samples,)
    as the values, which are returned as they are where they are free of noise (`NOISY`)
    or fewer than five.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 5 or noise_ratio(t, values) < NOISY:
        return values
    spline = Reinsch(t / np.median(np.diff(t)))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(t))

    both = np.stack([values, signs])

    def criterion(stiffness: float) -> float:
        left_out, rest = both - spline.smoothed(both, 10.0**stiffness)
        freedom = float(signs @ rest)
        return float(left_out @ left_out) / max(freedom, 1.0) ** 2

    return spline.smoothed(values, 10.0 ** min(STIFFNESSES, key=criterion))


class Reinsch:
    """Natural cubic smoothing splines on given knots, by banded matrices."""

    def __init__(self, t: Floats) -> None:
        h = np.diff(t)
        self.left, self.right = 1.0 / h[:-1], 1.0 / h[1:]
        self.middle = -self.left - self.right
        self.curvature = np.zeros(
            (3, len(h) - 1)
        )  # upper bands, as scipy.linalg.solveh_banded wants them
        self.curvature[2] = (h[:-1] + h[1:]) / 3.0
        self.curvature[1, 1:] = h[1:-1] / 6.0
        self.roughness = np.zeros_like(self.curvature)
        self.roughness[2] = self.left**2 + self.middle**2 + self.right**2
        self.roughness[1, 1:] = (
            self.middle[:-1] * self.left[1:] + self.right[:-1] * self.middle[1:]
        )
        self.roughness[0, 2:] = self.right[:-2] * self.left[2:]

    def smoothed(self, values: Floats, stiffness: float) -> Floats:
        """Values of the spline at the knots, shape (n_knots,) or (n_splines, n_knots)."""
        bends = (
            self.left * values[..., :-2]
            + self.middle * values[..., 1:-1]
            + self.right * values[..., 2:]
        )
        forces = solveh_banded(self.curvature + stiffness * self.roughness, bends.T).T
        pull = np.zeros_like(values)
        pull[..., :-2] += self.left * forces
        pull[..., 1:-1] += self.middle * forces
        pull[..., 2:] += self.right * forces
        return values - stiffness * pull
