"""Wind forces on a ship over the direction of the relative wind."""

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats
from shipgym.sea.estimates import house_area, weather_particulars
from shipgym.sea.harmonics import Harmonics, circle, cosine_series, sine_series
from shipgym.sea.wind_tables import (
    BLENDERMANN,
    WindTable,
    blendermann_coefficients,
    blendermann_type,
    check_coefficients,
    isherwood_coefficients,
)
from shipgym.ships.particulars import Particulars

#: At 15 degrees Celsius and sea level, kg/m3 (ISO 2533 standard atmosphere).
AIR_DENSITY = 1.225

_ISHERWOOD_MASTS = 2.0


@dataclass(frozen=True)
class WindCurves:
    """Wind forces and moments by dynamic pressure (half the air's density times relative speed squared).

    The angle is that of the relative wind seen from the bow, 0 ahead, pi / 2 from starboard: where
    (u_rw, v_rw) is the ship's velocity through the air in body axes and V its length, cos(angle) = u_rw / V
    and sin(angle) = v_rw / V. Wind from starboard pushes to port: Y < 0 there.
    """

    angle: Floats  # shape (points,); from 0 to below 2 pi, rad
    # shape (points,); surge and sway force by dynamic pressure, m2
    X: Floats
    Y: Floats
    N: Floats  # shape (points,); yaw moment about midship by dynamic pressure, positive to starboard, m3
    # shape (points,); heeling moment about the waterline by dynamic pressure, positive to starboard, m3
    K: Floats
    estimated: tuple[str, ...] = ()  # names of the particulars that were estimated for it

    def harmonics(self, n: int = 8) -> Harmonics:
        """Fourier series of the curves up to the n-th harmonic, for kernels.

        For n = 8 the largest difference from the curve is below 1.5 % of its largest value for Blendermann's
        coefficients and below 9 % for Isherwood's, whose tables have kinks (`tests/shipgym/test_wind.py`).
        """
        return Harmonics(
            cosine_series(self.X, n), sine_series(self.Y, n), sine_series(self.N, n), sine_series(self.K, n)
        )


def wind_curves(particulars: Particulars, coefficients: str | WindTable = "blendermann") -> WindCurves:
    """Wind forces of a ship over all directions; coefficients as in :class:`shipgym.sea.conditions.Wind`.

    Areas, centroid and length overall are estimated where not given (`weather_particulars`). Raises
    InputError for unknown coefficients, or particulars too few to estimate the areas.
    """
    check_coefficients(coefficients, "wind coefficients")
    ship = weather_particulars(particulars)
    angle = circle()
    folded = np.where(angle <= np.pi, angle, 2.0 * np.pi - angle)
    side = np.where(angle <= np.pi, -1.0, 1.0)  # which way is lee
    CX, CY, CN, heel = _coefficients(ship, coefficients, folded)
    frontal, lateral = ship.require("frontal_area"), ship.require("lateral_area")
    length = ship.require("length_overall")
    return WindCurves(
        angle,
        X=frontal * CX,
        Y=side * lateral * CY,
        N=side * lateral * length * CN,
        K=side * lateral * heel,
        estimated=tuple(sorted(ship.estimated & set(_USED))),
    )


_USED = ("length_overall", "frontal_area", "lateral_area", "lateral_centroid", "lateral_centroid_height")


def _coefficients(
    ship: Particulars, coefficients: str | WindTable, angle: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """CX, CY, CN, and CK times the height it refers to, at angles from 0 to pi."""
    length, lateral = ship.require("length_overall"), ship.require("lateral_area")
    height = ship.require("lateral_centroid_height")
    if isinstance(coefficients, WindTable):
        degrees = np.degrees(angle)
        table = coefficients
        rows = (table.CX, table.CY, table.CN, table.CK or (0.0,) * len(table.angles_deg))
        CX, CY, CN, CK = (np.interp(degrees, table.angles_deg, row) for row in rows)
        return CX, CY, CN, CK * lateral / length
    if coefficients == "isherwood":
        CX, CY, CN = (np.interp(angle, np.radians(np.arange(0, 181, 10)), row) for row in _isherwood(ship))
        return CX, CY, CN, CY * height
    row = BLENDERMANN[blendermann_type(coefficients, ship.require("block_coefficient"))]
    ratio = ship.require("frontal_area") / lateral
    CX, CY, CN, CK = blendermann_coefficients(row, angle, ratio, ship.require("lateral_centroid") / length)
    return CX, CY, CN, CK * height


def _isherwood(ship: Particulars) -> tuple[Floats, Floats, Floats]:
    """Isherwood's regression with an outline estimated from the lateral area."""
    length, lateral = ship.require("length_overall"), ship.require("lateral_area")
    return isherwood_coefficients(
        length=length,
        beam=ship.require("beam"),
        lateral_area=lateral,
        frontal_area=ship.require("frontal_area"),
        # along the deck, up and down the sides of a rectangle of the same area, and of the house
        perimeter=length + 2.0 * lateral / length + 2.0 * 0.07 * ship.length,
        bow_to_centroid=0.5 * length - ship.require("lateral_centroid"),
        masts=_ISHERWOOD_MASTS,
        superstructure_area=min(house_area(ship), 0.9 * lateral),
    )
