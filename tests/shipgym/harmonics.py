"""Sums of Fourier series, to compare them with the curves they stand for."""

import numpy as np


def evaluate_cosines(series, angle):
    """Sum of a cosine series, the mean first, at the angles."""
    orders = np.arange(len(series))
    return np.cos(np.multiply.outer(np.asarray(angle, dtype=float), orders)) @ series


def evaluate_sines(series, angle):
    """Sum of a sine series, that of sin(angle) first, at the angles."""
    orders = np.arange(1, len(series) + 1)
    return np.sin(np.multiply.outer(np.asarray(angle, dtype=float), orders)) @ series
