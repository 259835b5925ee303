"""Random processes as linear filters of white noise, from step to step.

Steps are exact (Van Loan 1978, Computing integrals involving the matrix exponential):
the variance of a process does not depend on their length.
"""

from math import factorial, sqrt
from typing import NamedTuple

from shipgym.engine.mathematics import sin_cos
from shipgym.engine.record_code import polynomial

decay_series = polynomial(
    "decay_series", *((-1.0) ** k / factorial(k) for k in range(8))
)


class GaussMarkov(NamedTuple):
    """A first-order process of mean zero.

    Its autocorrelation is standard_deviation^2 exp(-|lag| / time_constant).
    """

    time_constant: float  # s
    standard_deviation: float  # in the units of the process


class Filter(NamedTuple):
    """A first-order process in its discrete form."""

    kept: float  # part of the value that is left after a step
    shock: float  # standard deviation of what is added in a step
    deviation: float  # standard deviation of the process


class Oscillator(NamedTuple):
    """State of an oscillator driven by white noise; both have a variance of 1."""

    displacement: float
    velocity: float  # by its frequency


class OscillatorStep(NamedTuple):
    """Transition P of an oscillator's state over a step, and factors N of the noise.

    Displacement and velocity z become P z + N w, with w two independent numbers of
    noise of variance 1. N N' is the covariance that the step adds, I - P P'.
    """

    p11: float
    p12: float  # -p21
    p22: float
    n11: float
    n12: float  # n21 is 0
    n22: float


def first_order_step(now: float, mean: float, filter: Filter, noise: float) -> float:
    """Value of a first-order process after a step."""
    return mean + filter.kept * (now - mean) + filter.shock * noise


def decay(x: float) -> float:
    """exp(-x) for x from 0 to 8, and above as at 8, to 1e-7 up to 1.

    It is the fourth power of the series of exp(-x / 4).
    """
    quarter = decay_series(0.25 * min(x, 8.0))
    return quarter * quarter * quarter * quarter


def oscillator_step(turn: float, damping: float, ringing: float) -> OscillatorStep:
    """Exact step of a lightly damped oscillator driven by white noise.

    z1' = w z2, z2' = -w z1 - 2 lambda w z2 + sqrt(4 lambda w) noise, over an angle w h
    of `turn`; `damping` is lambda, `ringing` sqrt(1 - lambda^2).
    """
    decayed = decay(damping * turn)
    sine, cosine = sin_cos(ringing * turn)
    swing = decayed * sine / ringing
    stay = decayed * cosine
    p11 = stay + damping * swing
    p22 = stay - damping * swing

    # covariance I - P P' of the noise
    c11 = 1.0 - p11 * p11 - swing * swing
    c12 = swing * (p11 - p22)
    c22 = 1.0 - swing * swing - p22 * p22

    # and its Cholesky factor
    smallest_variance = 1e-12
    n22 = sqrt(max(c22, smallest_variance))
    n12 = c12 / n22
    n11 = sqrt(max(c11 - n12 * n12, 0.0))
    return OscillatorStep(
        p11=p11,
        p12=swing,
        p22=p22,
        n11=n11,
        n12=n12,
        n22=n22,
    )


def stepped(now: Oscillator, w1: float, w2: float, step: OscillatorStep) -> Oscillator:
    """State of an oscillator after a step, by two numbers of noise."""
    z1, z2 = now
    displacement = step.p11 * z1 + step.p12 * z2
    velocity = step.p22 * z2 - step.p12 * z1
    return Oscillator(
        displacement=displacement + step.n11 * w1 + step.n12 * w2,
        velocity=velocity + step.n22 * w2,
    )
