"""How far a state lies outside the data its model was identified from."""

from __future__ import annotations

from math import sqrt
from typing import Any

from .compiling import inlined
from .layout import ENVELOPE_CENTRE, ENVELOPE_HIGH, ENVELOPE_LOW, ENVELOPE_SHAPE, LANES


@inlined
def envelope_distance(u: float, v: float, r: float, delta: float, ship: Any, lane: int) -> float:
    """Size of the ellipsoid through (u, v, r, delta) relative to the one around the data."""
    c, w = ENVELOPE_CENTRE, ENVELOPE_SHAPE
    a = u - ship[c + lane]
    b = v - ship[c + 1 * LANES + lane]
    d = r - ship[c + 2 * LANES + lane]
    e = delta - ship[c + 3 * LANES + lane]
    p = (
        ship[w + lane] * a
        + ship[w + 1 * LANES + lane] * b
        + ship[w + 2 * LANES + lane] * d
        + ship[w + 3 * LANES + lane] * e
    )
    q = ship[w + 4 * LANES + lane] * b + ship[w + 5 * LANES + lane] * d + ship[w + 6 * LANES + lane] * e
    s = ship[w + 7 * LANES + lane] * d + ship[w + 8 * LANES + lane] * e
    t = ship[w + 9 * LANES + lane] * e
    return sqrt(p * p + q * q + s * s + t * t)


@inlined
def outside_range(u: float, v: float, r: float, delta: float, ship: Any, lane: int) -> bool:
    """Whether one of u, v, r, delta is outside its range in the data."""
    low, high = ENVELOPE_LOW, ENVELOPE_HIGH
    return (
        (u < ship[low + lane])
        | (u > ship[high + lane])
        | (v < ship[low + 1 * LANES + lane])
        | (v > ship[high + 1 * LANES + lane])
        | (r < ship[low + 2 * LANES + lane])
        | (r > ship[high + 2 * LANES + lane])
        | (delta < ship[low + 3 * LANES + lane])
        | (delta > ship[high + 3 * LANES + lane])
    )
