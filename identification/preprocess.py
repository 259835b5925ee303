"""How noisy a record is, and smoothing it where it is."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded

Floats = NDArray[np.float64]

#: Noise beyond this part of what a channel changes by from one sample to the next makes it noisy.
NOISY = 0.02

#: Decades of stiffness tried, of a spline on knots a unit apart.
STIFFNESSES = tuple(float(stiffness) for stiffness in np.arange(-2.0, 8.01, 0.25))


def noise_level(t: ArrayLike, values: ArrayLike) -> float:
    """Standard deviation of the sample-to-sample noise of a channel.

    Each sample is compared with the cubic through its two neighbours on either side; the median of the
    differences is not moved by corners of the signal.

    Parameters
    ----------
    t : array-like of shape (n_samples,)
        s.
    values : array-like of shape (n_samples,)
        The channel.

    Returns
    -------
    float
        In the unit of the channel; 0 with fewer than five samples.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 5:
        return 0.0
    around = (0, 1, 3, 4)
    times = {i: t[i : len(t) - 4 + i] for i in range(5)}
    expected, gain = np.zeros(len(t) - 4), np.ones(len(t) - 4)
    for i in around:
        weight = np.ones(len(t) - 4)
        for j in around:
            if j != i:
                weight = weight * (times[2] - times[j]) / (times[i] - times[j])
        expected += weight * values[i : len(t) - 4 + i]
        gain += weight**2
    return float(np.median(np.abs(values[2:-2] - expected) / np.sqrt(gain)) / 0.6745)


def noise_ratio(t: ArrayLike, values: ArrayLike, window: int = 1) -> float:
    """Noise of the change over a window relative to the change itself (root mean squares).

    Parameters
    ----------
    t, values : array-like of shape (n_samples,)
        s and the unit of the channel.
    window : int
        Number of sampling steps.

    Returns
    -------
    float
        0 for a channel without noise.
    """
    values = np.asarray(values, dtype=float)
    change = values[window:] - values[:-window]
    size = float(np.sqrt(np.mean(change**2))) if len(change) else 0.0
    return np.sqrt(2.0) * noise_level(t, values) / size if size > 0.0 else 0.0


def is_noisy(t: ArrayLike, channels: Iterable[ArrayLike]) -> bool:
    """Whether any of some channels, each of shape (n_samples,), has noise beyond `NOISY`."""
    return any(noise_ratio(t, values) > NOISY for values in channels)


def smooth(t: ArrayLike, values: ArrayLike) -> Floats:
    """Smooth a channel by a cubic spline whose stiffness generalised cross-validation picks.

    The natural smoothing spline of Reinsch 1967 (Numerische Mathematik 10); the trace in the criterion of
    Craven & Wahba 1979 (Numerische Mathematik 31) is estimated by random signs (Girard 1989), always the
    same ones.

    Parameters
    ----------
    t, values : array-like of shape (n_samples,)
        s and the unit of the channel.

    Returns
    -------
    array of shape (n_samples,)
        The values themselves where they are free of noise (`NOISY`) or fewer than five.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 5 or noise_ratio(t, values) < NOISY:
        return values
    spline = _Reinsch(t / np.median(np.diff(t)))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(t))

    def criterion(stiffness: float) -> float:
        left_out = values - spline.smoothed(values, 10.0**stiffness)
        freedom = float(signs @ (signs - spline.smoothed(signs, 10.0**stiffness)))
        return float(left_out @ left_out) / max(freedom, 1.0) ** 2

    best = min(STIFFNESSES, key=criterion)
    return spline.smoothed(values, 10.0**best)


class _Reinsch:
    """Natural cubic smoothing splines on given knots, by banded matrices."""

    def __init__(self, t: Floats) -> None:
        h = np.diff(t)
        self.left, self.right = 1.0 / h[:-1], 1.0 / h[1:]
        self.middle = -self.left - self.right
        self.curvature = np.zeros((3, len(h) - 1))  # upper bands, as scipy.linalg.solveh_banded wants them
        self.curvature[2] = (h[:-1] + h[1:]) / 3.0
        self.curvature[1, 1:] = h[1:-1] / 6.0
        self.roughness = np.zeros_like(self.curvature)
        self.roughness[2] = self.left**2 + self.middle**2 + self.right**2
        self.roughness[1, 1:] = self.middle[:-1] * self.left[1:] + self.right[:-1] * self.middle[1:]
        self.roughness[0, 2:] = self.right[:-2] * self.left[2:]

    def smoothed(self, values: Floats, stiffness: float) -> Floats:
        """Values of the spline at the knots."""
        bends = self.left * values[:-2] + self.middle * values[1:-1] + self.right * values[2:]
        forces = solveh_banded(self.curvature + stiffness * self.roughness, bends)
        pull = np.zeros_like(values)
        pull[:-2] += self.left * forces
        pull[1:-1] += self.middle * forces
        pull[2:] += self.right * forces
        smoothed: Floats = values - stiffness * pull
        return smoothed
