"""Conversion of latitude and longitude to metres, and of earth and body frame."""

import math
from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.units import DEGREE, KNOT

_EQUATOR = 6378137.0  # semi-major axis of WGS 84, m
_ECCENTRICITY_2 = 6.69437999014e-3  # its first eccentricity, squared


def local_metres(
    lat: Floats, lon: Floats, origin: tuple[float, float]
) -> tuple[Floats, Floats]:
    """North and east of an origin, m, of latitudes and longitudes in degrees.

    Valid across the date line too. By the radii of curvature of WGS 84 along the
    meridian and across it (Fossen 2011, Handbook of Marine Craft Hydrodynamics and
    Motion Control, 2.3): within 1 part in 10,000 up to 30 km away.
    """
    origin_lat, origin_lon = origin
    phi = origin_lat * DEGREE
    curvature = 1.0 - _ECCENTRICITY_2 * math.sin(phi) ** 2
    along_meridian = _EQUATOR * (1.0 - _ECCENTRICITY_2) / curvature**1.5
    across_meridian = _EQUATOR / math.sqrt(curvature)

    turned_north = (lat - origin_lat) * DEGREE
    from_antimeridian = lon - origin_lon + 180.0
    turned_east = from_antimeridian % 360.0 - 180.0
    middle = phi + 0.5 * turned_north
    parallel = across_meridian * np.cos(middle)
    north = along_meridian * turned_north
    east = parallel * turned_east * DEGREE
    return north, east


def rotate_to_body(north: Any, east: Any, psi: Any) -> tuple[Any, Any]:
    """Rotate a north and east vector by the heading, rad, to surge and sway.

    With -psi it rotates back. Numbers, or arrays of shape (n_samples,).
    """
    c, s = np.cos(psi), np.sin(psi)
    return north * c + east * s, east * c - north * s


def set_and_drift(north: float, east: float) -> str:
    """Speed of a current, given in m/s, in m/s and knots, and where it sets."""
    speed = math.hypot(north, east)
    knots = speed / KNOT
    bearing = math.atan2(east, north)
    degrees = math.degrees(bearing)
    towards = degrees % 360.0
    return f"{speed:.2f} m/s ({knots:.2f} knots) towards {towards:03.0f} deg"
