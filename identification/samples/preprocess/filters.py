"""Filters of single channels: running median, Savitzky-Golay and smoothing splines."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded
from scipy.ndimage import median_filter
from scipy.signal import savgol_coeffs, savgol_filter

from identification.arrays import mean_square
from identification.samples.preprocess.noise import NOISY, noise_ratio
from shipgym.arrays import Floats
from shipgym.trials.resampling import usual_step

ORDER = 3  # of the local polynomials
SHORTEST_WIDTH = ORDER + 2
#: Decades of stiffness tried, of a spline on knots a unit apart.
STIFFNESSES = tuple(float(stiffness) for stiffness in np.arange(-2.0, 8.01, 0.25))


def median(t: ArrayLike, values: ArrayLike, width: int = 5) -> Floats:
    """Running median of `width` samples, odd.

    It takes away spikes of up to half its width and keeps steps.
    """
    return median_filter(np.asarray(values, dtype=float), width, mode="nearest")


def savitzky_golay(t: ArrayLike, values: ArrayLike, width: int | None = None) -> Floats:
    """Local cubic polynomials by least squares.

    Source: Savitzky & Golay 1964, Analytical Chemistry 36(8). Records with uneven steps
    are filtered on an even grid with as many samples.

    Parameters
    ----------
    t, values : array-like of shape (n_samples,)
        Times, s, and the channel.
    width : int, optional
        Samples, odd, at least 5; by default the one that generalised cross-validation
        picks, of at most a fifth of the record. Without a width, values that are free
        of noise (`noise.NOISY`) or fewer than 25 are returned as they are.
    """
    t = np.asarray(t, dtype=float)
    values = np.asarray(values, dtype=float)
    if width is None:
        is_short = len(t) < 5 * SHORTEST_WIDTH
        if is_short or noise_ratio(t, values) < NOISY:
            return values

    steps = np.diff(t)
    unevenness = np.ptp(steps)
    if unevenness <= 1e-3 * np.median(steps):
        return _savitzky_golay(values, width)

    grid = np.linspace(t[0], t[-1], len(t))
    on_grid = np.interp(grid, t, values)
    filtered = _savitzky_golay(on_grid, width)
    return np.asarray(np.interp(t, grid, filtered))


def _savitzky_golay(values: Floats, width: int | None) -> Floats:
    """The filter on even steps; without a width the best one."""
    if width is None:
        width = _best_width(values)
    filtered: Floats = savgol_filter(values, width, ORDER)
    return filtered


def _best_width(values: Floats) -> int:
    """Width of least generalised cross-validation; widths grow by about a fifth."""
    longest = len(values) // 5
    sizes = np.geomspace(SHORTEST_WIDTH, longest, 24)
    odd = 2 * (sizes.astype(int) // 2) + 1
    widths = np.unique(odd)

    def criterion(width: int) -> float:
        fitted = savgol_filter(values, width, ORDER)
        weights = savgol_coeffs(width, ORDER)
        own_weight = float(weights[width // 2])
        left_out = mean_square(values - fitted)
        return left_out / (1.0 - own_weight) ** 2

    return int(min(widths.tolist(), key=criterion))


def smooth(t: ArrayLike, values: ArrayLike) -> Floats:
    """Smooth a channel by a cubic spline of a stiffness by cross-validation.

    The natural smoothing spline of Reinsch 1967 (Numerische Mathematik 10); the trace
    in the generalised criterion of Craven & Wahba 1979 (Numerische Mathematik 31) is
    estimated by random signs (Girard 1989), always the same ones. Times in s, of shape
    (n_samples,) as the values, which are returned as they are where they are free of
    noise (`NOISY`) or fewer than five.
    """
    times = np.ascontiguousarray(t, dtype=float)
    samples = np.ascontiguousarray(values, dtype=float)
    return _smoothed(times.tobytes(), samples.tobytes()).copy()


@lru_cache(maxsize=256)  # structures that are compared smooth the same channels
def _smoothed(times: bytes, samples: bytes) -> Floats:
    """Smooth a channel, both as the bytes of their samples."""
    t = np.frombuffer(times)
    values = np.frombuffer(samples)
    if len(t) < 5 or noise_ratio(t, values) < NOISY:
        return values

    spline = Reinsch(t / usual_step(t))
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], len(t))
    both = np.stack([values, signs])

    def criterion(stiffness: float) -> float:
        smoothed = spline.smoothed(both, 10.0**stiffness)
        left_out, rest = both - smoothed
        freedom = max(float(signs @ rest), 1.0)
        return float(left_out @ left_out) / freedom**2

    best = min(STIFFNESSES, key=criterion)
    return spline.smoothed(values, 10.0**best)


class Reinsch:
    """Natural cubic smoothing splines on given knots, by banded matrices.

    Source: Reinsch 1967. With Q' the second divided differences of the values y at the
    knots, T the Gram matrix of the spline's second derivative, and a stiffness s, the
    second derivatives at the inner knots are (T + s Q'Q)^-1 Q'y, and the smoothed
    values y - s Q of these.
    """

    def __init__(self, t: Floats) -> None:
        h = np.diff(t)
        left = 1.0 / h[:-1]
        right = 1.0 / h[1:]
        middle = -left - right
        #: the three diagonals of Q'
        self.diagonals = (left, middle, right)

        self.gram = _banded(
            diagonal=(h[:-1] + h[1:]) / 3.0,
            beside=h[1:-1] / 6.0,
            two_beside=0.0,
        )
        self.square = _banded(  # Q'Q
            diagonal=left**2 + middle**2 + right**2,
            beside=middle[:-1] * left[1:] + right[:-1] * middle[1:],
            two_beside=right[:-2] * left[2:],
        )

    def smoothed(self, values: Floats, stiffness: float) -> Floats:
        """Values of the spline at the knots.

        Shape (n_knots,) or (n_splines, n_knots), as the values.
        """
        *n_splines, n_knots = values.shape
        n_inner = n_knots - 2
        around = [slice(first, first + n_inner) for first in range(3)]
        differences = np.zeros((*n_splines, n_inner))
        for knots, diagonal in zip(around, self.diagonals, strict=True):
            differences += diagonal * values[..., knots]

        bands = self.gram + stiffness * self.square
        curvature = solveh_banded(bands, differences.T).T

        pull = np.zeros_like(values)
        for knots, diagonal in zip(around, self.diagonals, strict=True):
            pull[..., knots] += diagonal * curvature
        return values - stiffness * pull


def _banded(diagonal: Floats, beside: Floats, two_beside: Floats | float) -> Floats:
    """Upper bands of a symmetric matrix as `scipy.linalg.solveh_banded` wants them."""
    bands = np.zeros((3, len(diagonal)))
    bands[2] = diagonal
    bands[1, 1:] = beside
    bands[0, 2:] = two_beside
    return bands
