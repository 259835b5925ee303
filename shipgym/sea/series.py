"""Sums of short Fourier series over an angle, by its cosine and sine alone."""

from typing import NamedTuple


class Sines(NamedTuple):
    """A series of sines: the amplitudes of six harmonics."""

    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    sixth: float


class Cosines(NamedTuple):
    """A series of cosines: its mean, and the amplitudes of six harmonics."""

    mean: float
    first: float
    second: float
    third: float
    fourth: float
    fifth: float
    sixth: float


def sum_of_sines(cosine: float, sine: float, a: Sines) -> float:
    """Sum of amplitudes times sin(k angle), k from 1 to 6, by Chebyshev's recurrence.

    sin((k + 1) angle) = 2 cos(angle) sin(k angle) - sin((k - 1) angle).
    """
    d = 2.0 * cosine
    s2 = d * sine
    s3 = d * s2 - sine
    s4 = d * s3 - s2
    s5 = d * s4 - s3
    s6 = d * s5 - s4
    return (
        a.first * sine
        + a.second * s2
        + a.third * s3
        + a.fourth * s4
        + a.fifth * s5
        + a.sixth * s6
    )


def sum_of_cosines(cosine: float, a: Cosines) -> float:
    """Mean and sum of amplitudes times cos(k angle), k from 1 to 6, likewise."""
    d = 2.0 * cosine
    c2 = d * cosine - 1.0
    c3 = d * c2 - cosine
    c4 = d * c3 - c2
    c5 = d * c4 - c3
    c6 = d * c5 - c4
    return a.mean + (
        a.first * cosine
        + a.second * c2
        + a.third * c3
        + a.fourth * c4
        + a.fifth * c5
        + a.sixth * c6
    )
