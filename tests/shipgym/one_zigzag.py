"""One zigzag of a ship of first order in yaw, written as many recorders do."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

DEGREE = math.pi / 180.0

SPEED, METRES = 7.0, 60.0 * 1852.0  # m/s, of a degree


class Second(NamedTuple):
    """The ship at a second."""

    t: float
    psi: float  # deg
    r: float  # deg/s
    rudder: float  # deg
    lat: float
    lon: float
    course: float  # deg
    speed: float  # m/s over ground


@cache
def sailed(count=240, step=1.0):
    """A zigzag of a ship of first order in yaw, without current."""
    psi, r, rudder, side, lat, lon = 40.0, 0.0, 0.0, 1.0, 57.7, 11.8
    rows = []
    for k in range(count):
        t = k * step
        sway = -30.0 * r * DEGREE
        speed, drift = math.hypot(SPEED, sway), math.atan2(sway, SPEED) / DEGREE
        rows.append(Second(t, psi, r, rudder, lat, lon, psi + drift, speed))
        order = 20.0 * side if t >= 30.0 else 0.0
        if side * (psi - 40.0) >= 20.0:
            side = -side
        for _ in range(10):
            rudder += np.clip(order - rudder, -0.25 * step, 0.25 * step)
            r += 0.1 * step * (0.08 * rudder - r) / 25.0
            psi += 0.1 * step * r
            sway = -30.0 * r * DEGREE
            north = SPEED * math.cos(psi * DEGREE) - sway * math.sin(psi * DEGREE)
            east = SPEED * math.sin(psi * DEGREE) + sway * math.cos(psi * DEGREE)
            lat += 0.1 * step * north / METRES
            lon += 0.1 * step * east / METRES / math.cos(57.7 * DEGREE)
    return rows
