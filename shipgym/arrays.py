"""Types of arrays, as annotations name them, their integral and size, and a number as JSON knows it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def finite(number: float) -> float | None:
    """A number as JSON knows it: null where it is not finite."""
    return float(number) if np.isfinite(number) else None


def integral(t: Floats, rate: NDArray[Any]) -> NDArray[Any]:
    """Integral over time from zero by the trapezoid rule, shape (n_samples,)."""
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (rate[1:] + rate[:-1]))])


def root_mean_square(values: Any, axis: int | None = None) -> Any:
    """Root mean square of all values, or along an axis."""
    return np.sqrt(np.mean(np.square(values), axis=axis))
