"""Time derivatives of sampled and noisy signals."""

import math

import numpy as np

from shipgym.arrays import Floats

_DEGREE = 5
_FEWEST_SPANS = 8
# of noise, as a power of the distance of knots: that of a random walk has a half
_STEEPEST_GROWTH = 0.8


def time_derivative(t: Floats, values: Floats) -> Floats:
    """Differentiate a sampled signal, in units per second; smoothed as far as its noise asks for.

    Quintic splines are fitted by least squares with a knot at every second, third,
    fifth, ... sample. While the knots resolve the motion, the residual is the noise and
    hardly grows from one fit to the next, whether the noise is white or not; once they
    are too far apart it grows with a high power of their distance. The last fit before
    that growth is differentiated. Where it sets in at once, the samples hold no noise
    to speak of and a cubic spline through all of them is differentiated. Steps of the
    time, s, may differ.
    """
    from scipy.interpolate import make_interp_spline, make_lsq_spline

    n = t.size
    step = (t[-1] - t[0]) / (n - 1)
    s = (t - t[0]) / step
    size = max(float(np.abs(values).max()), 1e-290)
    best = make_interp_spline(s, values, k=min(3, n - 1))
    before: tuple[int, float] | None = None
    spacing = 2
    while n // spacing >= _FEWEST_SPANS:
        inner = s[np.arange(spacing, n - spacing, spacing)]
        knots = np.concatenate(
            [np.full(_DEGREE + 1, s[0]), inner, np.full(_DEGREE + 1, s[-1])]
        )
        fit = make_lsq_spline(s, values, knots, k=_DEGREE)
        free = max(n - (inner.size + _DEGREE + 1), 1)
        noise = (
            float(np.linalg.norm(values - fit(s))) * math.sqrt(n) / free + 1e-15 * size
        )
        if before is not None:
            growth = math.log(noise / before[1]) / math.log(spacing / before[0])
            if growth > _STEEPEST_GROWTH:
                break
            best = fit
        before = (spacing, noise)
        spacing = math.ceil(1.4 * spacing)
    return np.asarray(best.derivative()(s) / step, dtype=np.float64)
