"""Types of arrays for annotations, their integral, and numbers as JSON has them."""

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
    trapezoids = 0.5 * np.diff(t) * (rate[1:] + rate[:-1])
    return np.concatenate([[0.0], np.cumsum(trapezoids)])
