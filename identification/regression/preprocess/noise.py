"""How noisy a record is."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

#: Noise beyond this part of what a channel changes by from one sample to the next makes
#: it noisy.
NOISY = 0.02


def noise_level(t: ArrayLike, values: ArrayLike) -> float:
    """Standard deviation of the sample-to-sample noise of a channel, in its unit.

    Each sample is compared with the cubic through its two neighbours on either side;
    the median of the differences is not moved by corners of the signal. 0 with fewer
    than five samples.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if len(t) < 5:
        return 0.0
    around = (0, 1, 3, 4)
    times = {i: t[i : len(t) - 4 + i] for i in range(5)}
    expected, gain = np.zeros(len(t) - 4), np.ones(len(t) - 4)
    for i in around:
        others = [times[j] for j in around if j != i]
        weight = np.prod(
            [(times[2] - other) / (times[i] - other) for other in others], axis=0
        )
        expected += weight * values[i : len(t) - 4 + i]
        gain += weight**2
    return float(np.median(np.abs(values[2:-2] - expected) / np.sqrt(gain)) / 0.6745)


def noise_ratio(t: ArrayLike, values: ArrayLike, window: int = 1) -> float:
    """Noise of the change over a window of steps relative to the change itself (root mean squares)."""
    values = np.asarray(values, dtype=float)
    change = values[window:] - values[:-window]
    size = float(np.sqrt(np.mean(change**2))) if len(change) else 0.0
    return np.sqrt(2.0) * noise_level(t, values) / size if size > 0.0 else 0.0


def is_noisy(t: ArrayLike, channels: Iterable[ArrayLike]) -> bool:
    """Whether any of some channels, each of shape (n_samples,), has noise beyond `NOISY`."""
    return any(noise_ratio(t, values) > NOISY for values in channels)
