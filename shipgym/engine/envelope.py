"""Distance of a state from the data its model was identified from."""

from math import sqrt
from typing import NamedTuple

from shipgym.engine.record_code import written


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


def _distance() -> list[str]:
    """Lines of `envelope_distance`: |W (z - centre)|."""
    names = Four._fields
    lines = [f"{name} = motion.{name} - data.centre.{name}" for name in names]
    squares = []
    for k, row in enumerate(names):
        terms = [f"data.shape.{row[0]}{by[0]} * {by}" for by in names[k:]]
        lines.append(f"w{k} = {' + '.join(terms)}")
        squares.append(f"w{k} * w{k}")
    return [*lines, f"return sqrt({' + '.join(squares)})"]


def _outside() -> list[str]:
    """Lines of `outside_range`."""
    beyond = "(motion.{0} < data.low.{0}) | (motion.{0} > data.high.{0})"
    return [f"return {' | '.join(beyond.format(name) for name in Four._fields)}"]


#: (motion, data): the size of the ellipsoid through the state by that around the data.
envelope_distance = written(
    "envelope_distance", "motion, data", _distance(), {"sqrt": sqrt}
)
#: (motion, data): whether u, v, r or delta is outside its range in the data.
outside_range = written("outside_range", "motion, data", _outside(), {})
