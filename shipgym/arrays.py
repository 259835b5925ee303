"""Types of arrays, as annotations name them, and their integral."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


def integral(t: Floats, rate: NDArray[Any]) -> NDArray[Any]:
    """Integral over time from zero by the trapezoid rule, shape (n_samples,)."""
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (rate[1:] + rate[:-1]))])
