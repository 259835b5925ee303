"""Noise of a record."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from identification.arrays import root_mean_square

#: Noise beyond this part of what a channel changes by from one sample to the next makes
#: it noisy.
NOISY = 0.02
NEIGHBOURS = (0, 1, 3, 4)  # of the middle one of five samples


def noise_level(t: ArrayLike, values: ArrayLike) -> float:
    """Standard deviation of the sample-to-sample noise of a channel, in its unit.

    Each sample is compared with the cubic through its two neighbours on either side;
    the median of the differences is not moved by corners of the signal. 0 with fewer
    than five samples.
    """
    t = np.asarray(t, dtype=float)
    values = np.asarray(values, dtype=float)
    n_compared = len(t) - 4
    if n_compared < 1:
        return 0.0

    expected = np.zeros(n_compared)
    gain = np.ones(n_compared)  # of the variance of a difference by that of a sample
    times = [t[j : j + n_compared] for j in range(5)]
    for i in NEIGHBOURS:
        # Lagrange's polynomial of the i-th of five samples in the middle one
        weight = np.ones(n_compared)
        for j in NEIGHBOURS:
            if j != i:
                weight *= (times[2] - times[j]) / (times[i] - times[j])
        expected += weight * values[i : i + n_compared]
        gain += weight**2

    scaled = np.abs(values[2:-2] - expected) / np.sqrt(gain)
    quartile_of_normal = 0.6745
    return float(np.median(scaled) / quartile_of_normal)


def noise_ratio(t: ArrayLike, values: ArrayLike, window: int = 1) -> float:
    """Noise of the change over a window of steps relative to the change itself.

    Both are root mean squares.
    """
    values = np.asarray(values, dtype=float)
    before = values[:-window]
    change = values[window:] - before
    if not np.any(change):
        return 0.0
    noise_of_change = np.sqrt(2.0) * noise_level(t, values)
    return float(noise_of_change / root_mean_square(change))


def is_noisy(t: ArrayLike, channels: Iterable[ArrayLike]) -> bool:
    """Return whether a channel, each (n_samples,), has noise beyond `NOISY`."""
    return any(noise_ratio(t, values) > NOISY for values in channels)
