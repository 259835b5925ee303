"""Wind forces on a ship over the direction of the relative wind.

Coefficients are published ones, by Blendermann 1994 for types of ship and by Isherwood
1972 from a regression (`wind.toml`), or a table of one's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_number, check_table, did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import shipped_toml
from shipgym.sea.estimates import house_area, weather_particulars
from shipgym.sea.harmonics import Harmonics, circle, cosine_series, sine_series
from shipgym.ships.particulars import Particulars

#: At 15 degrees Celsius and sea level, kg/m3 (ISO 2533 standard atmosphere).
AIR_DENSITY = 1.225

_ISHERWOOD_MASTS = 2.0


class Blendermann(NamedTuple):
    """One row of Blendermann's table."""

    CD_t: float  # transverse resistance, by lateral area
    # longitudinal resistance in head and in following wind, by frontal area
    CD_l_bow: float
    CD_l_stern: float
    delta: float  # cross-force parameter
    kappa: float  # rolling-moment factor


_TABLES = shipped_toml("shipgym.sea", "wind.toml")
#: By type of ship.
BLENDERMANN = {ship: Blendermann(*row) for ship, row in _TABLES["blendermann"].items()}
#: Rows of CX, CY and CN every 10 degrees from the bow; columns of the regression.
ISHERWOOD = {name: np.array(rows) for name, rows in _TABLES["isherwood"].items()}

_PREFIX = "blendermann-"


def coefficient_names() -> tuple[str, ...]:
    """Words that `Wind(coefficients=...)` understands."""
    return ("blendermann", "isherwood", *(_PREFIX + ship for ship in BLENDERMANN))


@dataclass(frozen=True)
class WindTable:
    """Measured or computed wind coefficients of your own ship.

    Raises InputError for angles that do not rise from 0 to 180, or rows of another
    length.

    Parameters
    ----------
    angles_deg : tuple of float
        Where the relative wind comes from, degrees from the bow, rising from 0 to 180;
        the other side is the mirror image.
    CX : tuple of float
        Surge force divided by the frontal area; negative in head wind.
    CY : tuple of float
        Sway force to the LEE side divided by the lateral area, positive.
    CN : tuple of float
        Yaw moment about midship by lateral area and length overall, positive where the
        bow turns to lee.
    CK : tuple of float, optional
        Heeling moment about the waterline to lee by lateral area and its mean height
        (area by length overall); none is taken where it is not given.
    """

    angles_deg: tuple[float, ...]
    CX: tuple[float, ...]
    CY: tuple[float, ...]
    CN: tuple[float, ...]
    CK: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        names = ("angles_deg", "CX", "CY", "CN", *(() if self.CK is None else ("CK",)))
        for name in names:
            row, expected = (
                _row(getattr(self, name), f"wind table {name}"),
                len(self.angles_deg),
            )
            object.__setattr__(self, name, row)
            if len(row) != expected:
                raise InputError(
                    f"wind table {name}: {len(row)} values found, expected {expected},"
                    " one for each angle"
                )
        angles = self.angles_deg
        if (
            len(angles) < 3
            or np.any(np.diff(angles) <= 0.0)
            or (angles[0], angles[-1]) != (0.0, 180.0)
        ):
            raise InputError(
                f"wind table angles_deg: {angles} found, expected at least three that"
                " rise from 0 to 180"
            )
        for name in names[2:]:
            row = getattr(self, name)
            if row[0] != 0.0 or row[-1] != 0.0:
                raise InputError(
                    f"wind table {name}: {row[0]:g} and {row[-1]:g} found at 0 and 180"
                    " degrees, expected 0: a ship with port-starboard symmetry"
                )

    @classmethod
    def from_dict(
        cls, mapping: Mapping[str, Any], where: str = "wind table"
    ) -> WindTable:
        """Read a table as it stands in JSON; InputError for an unknown or missing row."""
        needed = ("angles_deg", "CX", "CY", "CN")
        return cls(**check_table(mapping, where, (*needed, "CK"), needed))


def _row(values: Any, where: str) -> tuple[float, ...]:
    if not isinstance(values, list | tuple | np.ndarray):
        raise InputError(f"{where}: {values!r} found, expected a list of numbers")
    return tuple(check_number(value, f"{where}[{i}]") for i, value in enumerate(values))


def check_coefficients(value: Any, where: str) -> None:
    """InputError for what `Wind(coefficients=...)` does not understand, naming the words that it does."""
    if isinstance(value, WindTable) or (
        isinstance(value, str) and value in coefficient_names()
    ):
        return
    hint = did_you_mean(value, coefficient_names()) if isinstance(value, str) else ""
    raise InputError(
        f"{where}: {value!r} found, expected a WindTable or one of"
        f" {quoted(coefficient_names())}.{hint}"
    )


def blendermann_type(name: str, block_coefficient: float) -> str:
    """Type of ship in :data:`BLENDERMANN` that a word asks for.

    "blendermann" alone takes a full hull (block coefficient of 0.75 or more) for a
    loaded tanker, a fine one (below 0.65) for a loaded container ship, and others for a
    loaded cargo ship.
    """
    if name.startswith(_PREFIX):
        return name.removeprefix(_PREFIX)
    if block_coefficient >= 0.75:
        return "tanker-loaded"
    return "container-loaded" if block_coefficient < 0.65 else "cargo-loaded"


def blendermann_coefficients(
    row: Blendermann, angle: Floats, area_ratio: float, centroid_ratio: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Blendermann's coefficients of a type of ship for wind from 0 (ahead) to pi (astern) of one side.

    `area_ratio` is the frontal by the lateral area, `centroid_ratio` the centroid of
    the lateral area forward of midship by length overall. Returns CX by frontal area;
    CY to lee by lateral area; CN with the bow to lee by lateral area and length
    overall; CK to lee by lateral area and the height of its centroid.
    """
    CD_l_AF = np.where(angle <= np.pi / 2, row.CD_l_bow, row.CD_l_stern)
    CD_l = CD_l_AF * area_ratio
    denominator = (
        1.0 - 0.5 * row.delta * (1.0 - CD_l / row.CD_t) * np.sin(2.0 * angle) ** 2
    )
    CX = -CD_l_AF * np.cos(angle) / denominator
    CY = row.CD_t * np.sin(angle) / denominator
    CN = (centroid_ratio - 0.18 * (angle - np.pi / 2)) * CY
    return CX, CY, CN, row.kappa * CY


def isherwood_coefficients(
    length: float,
    beam: float,
    lateral_area: float,
    frontal_area: float,
    perimeter: float,
    bow_to_centroid: float,
    masts: float,
    superstructure_area: float,
) -> tuple[Floats, Floats, Floats]:
    """Isherwood's coefficients every 10 degrees from 0 (ahead) to 180 (astern), three arrays of shape (19,).

    Lengths in m, projected areas above the water in m2; `length` is overall,
    `perimeter` that of the lateral projection without waterline, masts and ventilators,
    `bow_to_centroid` reaches to the centroid of the lateral area, `masts` are groups of
    masts seen from the side, `superstructure_area` is that of the lateral area. Returns
    CX by frontal area; CY to lee by lateral area; CN with the bow to lee by lateral
    area and length.
    """
    hull = [
        1.0,
        2.0 * lateral_area / length**2,
        2.0 * frontal_area / beam**2,
        length / beam,
    ]
    outline = [*hull, perimeter / length, bow_to_centroid / length]
    return (
        -ISHERWOOD["CX"] @ np.array([*outline, masts]),
        ISHERWOOD["CY"] @ np.array([*outline, superstructure_area / lateral_area]),
        ISHERWOOD["CN"] @ np.array(outline),
    )


@dataclass(frozen=True)
class WindCurves:
    """Wind forces and moments by dynamic pressure (half the air's density times relative speed squared).

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
    estimated: tuple[
        str, ...
    ] = ()  # names of the particulars that were estimated for it

    def harmonics(self, n: int = 8) -> Harmonics:
        """Fourier series of the curves up to the n-th harmonic, for kernels.

        For n = 8 the largest difference from the curve is below 1.5 % of its largest
        value for Blendermann's coefficients and below 9 % for Isherwood's, whose tables
        have kinks (`tests/shipgym/test_wind.py`).
        """
        lateral = (sine_series(curve, n) for curve in (self.Y, self.N, self.K))
        return Harmonics(cosine_series(self.X, n), *lateral)


def wind_curves(
    particulars: Particulars, coefficients: str | WindTable = "blendermann"
) -> WindCurves:
    """Wind forces of a ship over all directions; coefficients as in :class:`shipgym.sea.conditions.Wind`.

    Areas, centroid and length overall are estimated where not given
    (`weather_particulars`). Raises InputError for unknown coefficients, or particulars
    too few to estimate the areas.
    """
    check_coefficients(coefficients, "wind coefficients")
    ship = weather_particulars(particulars)
    angle = circle()
    folded = np.where(angle <= np.pi, angle, 2.0 * np.pi - angle)
    side = np.where(angle <= np.pi, -1.0, 1.0)  # which way is lee
    CX, CY, CN, heel = _coefficients(ship, coefficients, folded)
    frontal, lateral = ship.require("frontal_area"), ship.require("lateral_area")
    length = ship.require("length_overall")
    used = {
        "length_overall",
        "frontal_area",
        "lateral_area",
        "lateral_centroid",
        "lateral_centroid_height",
    }
    return WindCurves(
        angle,
        X=frontal * CX,
        Y=side * lateral * CY,
        N=side * lateral * length * CN,
        K=side * lateral * heel,
        estimated=tuple(sorted(ship.estimated & used)),
    )


def _coefficients(
    ship: Particulars, coefficients: str | WindTable, angle: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """CX, CY, CN, and CK times the height it refers to, at angles from 0 to pi."""
    length, lateral = ship.require("length_overall"), ship.require("lateral_area")
    height = ship.require("lateral_centroid_height")
    if isinstance(coefficients, WindTable):
        table = coefficients
        rows = (
            table.CX,
            table.CY,
            table.CN,
            table.CK or (0.0,) * len(table.angles_deg),
        )
        CX, CY, CN, CK = (
            np.interp(np.degrees(angle), table.angles_deg, row) for row in rows
        )
        return CX, CY, CN, CK * lateral / length
    if coefficients == "isherwood":
        CX, CY, CN = (
            np.interp(angle, np.radians(np.arange(0, 181, 10)), row)
            for row in _isherwood(ship)
        )
        return CX, CY, CN, CY * height
    row = BLENDERMANN[blendermann_type(coefficients, ship.require("block_coefficient"))]
    ratio = ship.require("frontal_area") / lateral
    CX, CY, CN, CK = blendermann_coefficients(
        row, angle, ratio, ship.require("lateral_centroid") / length
    )
    return CX, CY, CN, CK * height


def _isherwood(ship: Particulars) -> tuple[Floats, Floats, Floats]:
    """Isherwood's regression with an outline estimated from the lateral area."""
    length, lateral = ship.require("length_overall"), ship.require("lateral_area")
    return isherwood_coefficients(
        length,
        ship.require("beam"),
        lateral,
        ship.require("frontal_area"),
        # along the deck, up and down the sides of a rectangle of the same area, and of
        # the house
        perimeter=length + 2.0 * lateral / length + 2.0 * 0.07 * ship.length,
        bow_to_centroid=0.5 * length - ship.require("lateral_centroid"),
        masts=_ISHERWOOD_MASTS,
        superstructure_area=min(house_area(ship), 0.9 * lateral),
    )
