"""Time derivatives of sampled and noisy signals."""

import math
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
    from scipy.interpolate import make_interp_spline

    n = t.size
    since_start = t - t[0]
    step = since_start[-1] / (n - 1)
    samples = since_start / step
    part = _liveliest(values)
    spacing = _widest_spacing(samples[part], values[part])
    if spacing is None:
        spline = make_interp_spline(samples, values, k=min(3, n - 1))
    else:
        spline, _ = _smoothed(samples, values, spacing)
    derivative = spline.derivative()
    return np.asarray(derivative(samples) / step, dtype=np.float64)


def _liveliest(values: Floats) -> slice:
    """The part of a long signal that changes most, by which its noise is told."""
    longest = 20_000  # samples
    begins = range(0, max(values.size - longest // 2, 1), longest)
    parts = [slice(begin, begin + longest) for begin in begins]
    return max(parts, key=lambda part: float(np.std(np.diff(values[part]))))


def _widest_spacing(samples: Floats, values: Floats) -> int | None:
    """Samples from knot to knot up to which the noise hardly grows; None without."""
    fewest_spans = 8
    # of noise, as a power of the distance of knots: that of a random walk has a half
    steepest_growth = 0.8
    widest = None
    noise_before = 0.0
    spacing_before = 0
    spacing = 2
    while values.size // spacing >= fewest_spans:
        _, noise = _smoothed(samples, values, spacing)
        if spacing_before:
            growth = math.log(noise / noise_before)
            widening = math.log(spacing / spacing_before)
            if growth > steepest_growth * widening:
                break
            widest = spacing
        noise_before = noise
        spacing_before = spacing
        spacing = math.ceil(1.4 * spacing)
    return widest


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
