"""Ends of 95 % intervals of drawn values, and how many are drawn."""

import numpy as np

from shipgym.arrays import Floats

#: Models drawn where the caller does not say: one number for all verdicts.
DRAWS = 200
#: Shares of the draws below the lower and the upper end of the interval.
LEVELS_95 = (0.025, 0.975)


def upper_95(values: Floats) -> float:
    """The value that 95 % of the draws do not exceed."""
    return float(np.quantile(values, 0.95))


def band_95(values: Floats) -> tuple[Floats, Floats]:
    """Both ends of the interval over the first axis, in the shape of the others."""
    low, high = np.quantile(values, LEVELS_95, axis=0)
    return low, high
