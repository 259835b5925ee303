"""Wind forces on a ship over the direction of the relative wind, and gusts."""

from math import gamma, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy import cos, sin, where

from shipgym.arrays import Floats
from shipgym.sea.conditions import Wind
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.filters import GaussMarkov
from shipgym.sea.harmonics import Curves, circle
from shipgym.ships.particulars import Particulars

#: Surface drag coefficient of Harris's spectrum for a rough sea.
SURFACE_DRAG = 0.003
#: 2^(2/3) B(1/2, 1/3), with Euler's beta function.
HARRIS_VARIANCE = 2.0 ** (2.0 / 3.0) * (
    gamma(1.0 / 2.0) * gamma(1.0 / 3.0) / gamma(5.0 / 6.0)
)
#: At 15 degrees Celsius and sea level, kg/m3 (ISO 2533 standard atmosphere).
AIR_DENSITY = 1.225


class Blendermann(NamedTuple):
    """Coefficients of a type of ship."""

    CD_t: float  # transverse resistance, by lateral area
    # longitudinal resistance in head and in following wind, by frontal area
    CD_l_bow: float
    CD_l_stern: float
    delta: float  # cross-force parameter
    kappa: float  # rolling-moment factor


#: By least block coefficient: a loaded tanker, cargo ship and container ship.
#: Blendermann 1994, Parameter identification of wind loads on ships, J. Wind
#: Engineering and Industrial Aerodynamics 51; as in Fossen 2021, section 10.1.2.
BLENDERMANN = {
    0.75: Blendermann(0.70, 0.90, 0.55, 0.40, 3.1),
    0.65: Blendermann(0.85, 0.65, 0.55, 0.40, 1.7),
    0.0: Blendermann(0.90, 0.55, 0.55, 0.40, 1.4),
}


def wind_curves(particulars: Particulars) -> Curves:
    """Wind forces of a ship by dynamic pressure, 0.5 air density relative speed^2.

    Over all directions of the relative wind: where (u_rw, v_rw) is the ship's velocity
    through the air in body axes and V its length, cos(angle) = u_rw / V and sin(angle)
    = v_rw / V. X and Y in m2, N and K in m3; coefficients by the fullness of the hull.

    Areas, centroid and length overall are estimated where not given
    (`weather_particulars`). Raises InputError for particulars too few to estimate them.
    """
    ship = weather_particulars(particulars)
    frontal = ship.require("frontal_area")
    lateral = ship.require("lateral_area")
    length = ship.require("length_overall")
    height = ship.require("lateral_centroid_height")

    angle = circle()
    from_starboard = angle <= np.pi
    folded = np.where(from_starboard, angle, 2.0 * np.pi - angle)
    to_lee = np.where(from_starboard, -1.0, 1.0)

    fullness = ship.require("block_coefficient")
    row = next(row for least, row in BLENDERMANN.items() if fullness >= least)
    CX, CY = coefficients(row, folded, area_ratio=frontal / lateral)
    sway = to_lee * lateral * CY
    from_abeam = folded - 0.5 * pi
    lever = ship.require("lateral_centroid") - 0.18 * length * from_abeam
    return Curves(
        X=frontal * CX,
        Y=sway,
        N=lever * sway,
        K=row.kappa * height * sway,
    )


def coefficients(
    row: Blendermann, angle: Floats, area_ratio: float
) -> tuple[Floats, Floats]:
    """Coefficients of surge, by frontal area, and of sway to lee, by lateral area.

    Fossen 2021, section 10.1.2. `angle` is from 0 (ahead) to pi (astern), `area_ratio`
    the frontal by the lateral area.
    """
    CD_l_AF = where(angle <= pi / 2, row.CD_l_bow, row.CD_l_stern)
    CD_l = CD_l_AF * area_ratio
    cross_force = 0.5 * row.delta * (1.0 - CD_l / row.CD_t)
    oblique = sin(2.0 * angle) ** 2
    denominator = 1.0 - cross_force * oblique
    surge = -CD_l_AF * cos(angle)
    sway = row.CD_t * sin(angle)
    return surge / denominator, sway / denominator


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
    time_constant = 1.0 / (2.0 * pi * peak)
    return GaussMarkov(
        time_constant=time_constant,
        standard_deviation=sqrt(variance),
    )
