"""Distance of a state from the data its model was identified from."""

from math import sqrt
from typing import NamedTuple

from shipgym.engine.motion import Motion


class Four(NamedTuple):
    """Surge and sway speed, yaw rate and rudder angle, SI units."""

    u: float
    v: float
    r: float
    delta: float


class Triangle(NamedTuple):
    """Upper triangle W, row by row: inside is |W (z - centre)| <= 1."""

    uu: float
    uv: float
    ur: float
    ud: float
    vv: float
    vr: float
    vd: float
    rr: float
    rd: float
    dd: float


class Envelope(NamedTuple):
    """The data's least and largest values, and the ellipsoid around them."""

    low: Four
    high: Four
    centre: Four
    shape: Triangle


def envelope_distance(motion: Motion, data: Envelope) -> float:
    """Size of the ellipsoid through the state relative to the one around the data."""
    centre = data.centre
    u = motion.u - centre.u
    v = motion.v - centre.v
    r = motion.r - centre.r
    delta = motion.delta - centre.delta

    w = data.shape
    first = w.uu * u + w.uv * v + w.ur * r + w.ud * delta
    second = w.vv * v + w.vr * r + w.vd * delta
    third = w.rr * r + w.rd * delta
    fourth = w.dd * delta
    square = first * first + second * second + third * third + fourth * fourth
    return sqrt(square)


def outside_range(motion: Motion, data: Envelope) -> bool:
    """Return whether u, v, r or delta is outside its range in the data."""
    low, high = data.low, data.high
    below = (
        (motion.u < low.u)
        | (motion.v < low.v)
        | (motion.r < low.r)
        | (motion.delta < low.delta)
    )
    above = (
        (motion.u > high.u)
        | (motion.v > high.v)
        | (motion.r > high.r)
        | (motion.delta > high.delta)
    )
    return below | above
