"""Time derivatives of sampled and noisy signals."""

import math
from functools import lru_cache
from typing import Any

import numpy as np

from shipgym.arrays import Floats


def time_derivative(t: Floats, values: Floats) -> Floats:
    """Differentiate a sampled signal by a spline that smooths its noise.

    Quintic splines are fitted by least squares with a knot at every second, third,
    fifth, ... sample. While the knots resolve the motion, the residual is the noise and
    hardly grows from one fit to the next, whether the noise is white or not; once they
    are too far apart it grows with a high power of their distance. The last fit before
    that growth is differentiated. Where it sets in at once, the samples hold no noise
    to speak of and a cubic spline through all of them is differentiated. Steps of the
    time, s, may differ.
    """
    return _derivative(t.tobytes(), values.tobytes()).copy()


@lru_cache(maxsize=8)  # a log is read again where a check proposes another setting
def _derivative(t_bytes: bytes, value_bytes: bytes) -> Floats:
    """Derivative of float64 values by their times, both as bytes."""
    from scipy.interpolate import make_interp_spline

    fewest_spans = 8
    # of noise, as a power of the distance of knots: that of a random walk has a half
    steepest_growth = 0.8
    t = np.frombuffer(t_bytes)
    values = np.frombuffer(value_bytes)
    n = t.size
    since_start = t - t[0]
    step = since_start[-1] / (n - 1)
    samples = since_start / step
    best = make_interp_spline(samples, values, k=min(3, n - 1))

    noise_before = 0.0
    spacing_before = 0
    spacing = 2
    while n // spacing >= fewest_spans:
        spline, noise = _smoothed(samples, values, spacing)
        if spacing_before:
            growth = math.log(noise / noise_before)
            widening = math.log(spacing / spacing_before)
            if growth > steepest_growth * widening:
                break
            best = spline
        noise_before = noise
        spacing_before = spacing
        spacing = math.ceil(1.4 * spacing)

    derivative = best.derivative()
    return np.asarray(derivative(samples) / step, dtype=np.float64)


def _smoothed(samples: Floats, values: Floats, spacing: int) -> tuple[Any, float]:
    """Quintic spline with a knot every `spacing` samples, and the noise it leaves."""
    from scipy.interpolate import make_lsq_spline

    degree = 5
    n = samples.size
    first = np.repeat(samples[0], degree + 1)
    inner = samples[spacing : n - spacing : spacing]
    last = np.repeat(samples[-1], degree + 1)
    knots = np.concatenate([first, inner, last])
    spline = make_lsq_spline(samples, values, knots, k=degree, method="norm-eq")

    residual = np.linalg.norm(values - spline(samples))
    free = max(n - inner.size - degree - 1, 1)
    noise = residual * math.sqrt(n) / free
    largest = max(np.abs(values).max(), 1e-290)
    rounding = 1e-15 * largest
    return spline, float(noise + rounding)
