"""Smoothing splines whose stiffness generalised cross-validation picks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded

from identification.regression.preprocess.noise import NOISY, noise_ratio
from shipgym.arrays import Floats

#: Decades of stiffness tried, of a spline on knots a unit apart.
STIFFNESSES = tuple(float(stiffness) for stiffness in np.arange(-2.0, 8.01, 0.25))


def smooth(t: ArrayLike, values: ArrayLike) -> Floats:
    """Smooth a channel by a cubic spline whose stiffness generalised cross-validation picks.

    The natural smoothing spline of Reinsch 1967 (Numerische Mathematik 10); the trace in the criterion of
    Craven & Wahba 1979 (Numerische Mathematik 31) is estimated by random signs (Girard 1989), always the same
    ones. Times in s, of shape (n_samples,) as the values, which are returned as they are where they are free
    of noise (`NOISY`) or fewer than five.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 5 or noise_ratio(t, values) < NOISY:
        return values
    spline = Reinsch(t / np.median(np.diff(t)))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(t))

    def criterion(stiffness: float) -> float:
        left_out = values - spline.smoothed(values, 10.0**stiffness)
        freedom = float(signs @ (signs - spline.smoothed(signs, 10.0**stiffness)))
        return float(left_out @ left_out) / max(freedom, 1.0) ** 2

    best = min(STIFFNESSES, key=criterion)
    return spline.smoothed(values, 10.0**best)


class Reinsch:
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
