"""Batched physics of bare ships, and the mathematics that lets its loops
be vectorised."""

import numpy as np

from shipgym.engine.compiling import compiled
from shipgym.engine.mathematics import (
    arctan,
    arctan2,
    exponential,
    sin_cos,
)


def loop(x, y, out):
    for i in range(x.size):
        out[0, i], out[1, i], out[2, i] = (
            exponential(x[i]),
            arctan(x[i]),
            arctan2(y[i], x[i]),
        )


def over(x, y):
    """Our functions as loops compile them."""
    out = np.empty((3, x.size))
    compiled(
        loop, "void(float64[::1], float64[::1], float64[:, ::1])", {}, "mathematics"
    )(x, y, out)
    return out


def test_the_exponential_is_exact_to_rounding_over_its_whole_range():
    x = np.concatenate(
        [np.linspace(-708.0, 709.7, 200_001), np.linspace(-1.0, 1.0, 20_001)]
    )
    np.testing.assert_allclose(over(x, x)[0], np.exp(x), rtol=5e-16)
    subnormal = np.linspace(-745.0, -708.0, 1001)
    np.testing.assert_allclose(
        over(subnormal, subnormal)[0], np.exp(subnormal), rtol=5e-16, atol=1e-323
    )


def test_the_arc_tangent_is_exact_to_rounding_over_its_whole_range():
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((2, 100_000)) * 10.0 ** rng.uniform(
        -12.0, 12.0, (2, 100_000)
    )
    _, single, double = over(x, y)
    np.testing.assert_allclose(single, np.arctan(x), rtol=5e-16)
    np.testing.assert_allclose(double, np.arctan2(y, x), rtol=5e-16)


def test_sine_and_cosine_to_the_last_digits():
    angles = np.linspace(-500.0, 500.0, 20001)
    found = np.array([sin_cos(angle) for angle in angles])
    expected = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-15)
