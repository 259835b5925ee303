"""Wind forces on a ship over the direction of the relative wind, and gusts."""

from dataclasses import dataclass
from math import gamma, pi, sqrt

import numpy as np

from shipgym.arrays import Floats
from shipgym.sea.conditions import Wind
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.filters import GaussMarkov
from shipgym.sea.harmonics import circle
from shipgym.sea.wind_coefficients import (
    BLENDERMANN,
    blendermann_coefficients,
    blendermann_type,
    check_coefficients,
)
from shipgym.ships.particulars import Particulars

#: Surface drag coefficient of Harris's spectrum for a rough sea.
SURFACE_DRAG = 0.003
#: 2^(2/3) B(1/2, 1/3), with Euler's beta function.
HARRIS_VARIANCE = 2.0 ** (2.0 / 3.0) * (
    gamma(1.0 / 2.0) * gamma(1.0 / 3.0) / gamma(5.0 / 6.0)
)
#: At 15 degrees Celsius and sea level, kg/m3 (ISO 2533 standard atmosphere).
AIR_DENSITY = 1.225


@dataclass(frozen=True)
class WindCurves:
    """Wind forces and moments by dynamic pressure, 0.5 air density relative speed^2.

    The angle is that of the relative wind seen from the bow, 0 ahead, pi / 2 from
    starboard: where (u_rw, v_rw) is the ship's velocity through the air in body axes
    and V its length, cos(angle) = u_rw / V and sin(angle) = v_rw / V. Wind from
    starboard pushes to port: Y < 0 there.
    """

    angle: Floats  # shape (points,); from 0 to below 2 pi, rad
    # shape (points,); surge and sway force by dynamic pressure, m2
    X: Floats
    Y: Floats
    # shape (points,); yaw moment about midship by dynamic pressure, positive to
    # starboard, m3
    N: Floats
    # shape (points,); heeling moment about the waterline by dynamic pressure, positive
    # to starboard, m3
    K: Floats


def wind_curves(
    particulars: Particulars, coefficients: str = "blendermann"
) -> WindCurves:
    """Wind forces of a ship over all directions; coefficients as in `Wind`.

    Areas, centroid and length overall are estimated where not given
    (`weather_particulars`). Raises InputError for unknown coefficients, or particulars
    too few to estimate the areas.
    """
    check_coefficients(coefficients, "wind coefficients")
    ship = weather_particulars(particulars)
    frontal = ship.require("frontal_area")
    lateral = ship.require("lateral_area")
    length = ship.require("length_overall")
    height = ship.require("lateral_centroid_height")

    angle = circle()
    from_starboard = angle <= np.pi
    folded = np.where(from_starboard, angle, 2.0 * np.pi - angle)
    to_lee = np.where(from_starboard, -1.0, 1.0)

    type_of_ship = blendermann_type(coefficients, ship.require("block_coefficient"))
    c = blendermann_coefficients(
        BLENDERMANN[type_of_ship],
        folded,
        area_ratio=frontal / lateral,
        centroid_ratio=ship.require("lateral_centroid") / length,
    )
    return WindCurves(
        angle,
        X=frontal * c.CX,
        Y=to_lee * lateral * c.CY,
        N=to_lee * lateral * length * c.CN,
        K=to_lee * lateral * height * c.CK,
    )


def gust_filter(wind: Wind) -> GaussMarkov:
    """First-order process with the variance and most energetic frequency of gusts.

    Harris 1971: f S / (k V^2) = 4 x / (2 + x^2)^(5/6) with x = f 1800 m / V and the
    surface drag coefficient k. Its integral is 6.677 k V^2, and it is largest at x =
    sqrt(3); f S(f) of a Gauss-Markov process at f = 1 / (2 pi T), so T = 165.4 m / V.
    Without gusts the deviation, m/s, is 0.
    """
    if not wind.gust or wind.calm:
        return GaussMarkov(1.0, 0.0)
    V = wind.speed
    peak = sqrt(3.0) * V / 1800.0
    variance = HARRIS_VARIANCE * SURFACE_DRAG * V**2
    return GaussMarkov(
        time_constant=1.0 / (2.0 * pi * peak),
        standard_deviation=sqrt(variance),
    )
