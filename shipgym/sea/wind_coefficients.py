"""Wind coefficients: published ones, and tables of a user's own ship.

The published ones are by Blendermann 1994 for types of ship (`wind.toml`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy import cos, degrees, interp, pi, sin, where

from shipgym.arrays import Floats
from shipgym.checks import check_number, check_table, did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import shipped_toml


class Blendermann(NamedTuple):
    """One row of Blendermann's table."""

    CD_t: float  # transverse resistance, by lateral area
    # longitudinal resistance in head and in following wind, by frontal area
    CD_l_bow: float
    CD_l_stern: float
    delta: float  # cross-force parameter
    kappa: float  # rolling-moment factor


class WindCoefficients(NamedTuple):
    """Coefficients at some angles of the relative wind, arrays of one shape."""

    CX: Floats  # surge force by frontal area
    CY: Floats  # sway force to lee by lateral area
    # yaw moment about midship, bow to lee, by lateral area and length overall
    CN: Floats
    # heeling moment about the waterline, to lee, by lateral area and a height
    CK: Floats


_TABLES = shipped_toml("shipgym.sea", "wind.toml")
#: By type of ship.
BLENDERMANN = {ship: Blendermann(*row) for ship, row in _TABLES["blendermann"].items()}


@dataclass(frozen=True)
class WindTable:
    """Measured or computed wind coefficients of your own ship.

    Raises InputError for angles that do not rise from 0 to 180, rows of another length,
    and forces to one side of a wind from ahead or astern.

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
        lateral = ["CY", "CN"]
        if self.CK is not None:
            lateral.append("CK")
        for name in ("angles_deg", "CX", *lateral):
            row = _numbers(getattr(self, name), f"wind table {name}")
            object.__setattr__(self, name, row)
        self._check_angles()
        for name in ("CX", *lateral):
            self._check_length(name)
        for name in lateral:
            self._check_symmetry(name)

    def _check_angles(self) -> None:
        angles = self.angles_deg
        enough = len(angles) >= 3
        rising = np.all(np.diff(angles) > 0.0)
        if not (enough and rising and angles[0] == 0.0 and angles[-1] == 180.0):
            raise InputError(
                "wind table angles_deg: expected at least three that rise from 0 to"
                f" 180, got {angles}"
            )

    def _check_length(self, name: str) -> None:
        expected = len(self.angles_deg)
        row = getattr(self, name)
        if len(row) != expected:
            raise InputError(
                f"wind table {name}: expected {expected} values, one for each angle,"
                f" got {len(row)}"
            )

    def _check_symmetry(self, name: str) -> None:
        row = getattr(self, name)
        if row[0] != 0.0 or row[-1] != 0.0:
            raise InputError(
                f"wind table {name}: expected 0 at 0 and 180 degrees, for a ship with"
                f" port-starboard symmetry, got {row[0]:g} and {row[-1]:g}"
            )

    @classmethod
    def from_dict(
        cls, mapping: Mapping[str, Any], where: str = "wind table"
    ) -> WindTable:
        """Read a table from JSON; InputError for an unknown or missing row."""
        needed = ("angles_deg", "CX", "CY", "CN")
        table = check_table(
            mapping,
            where,
            allowed=(*needed, "CK"),
            required=needed,
        )
        return cls(**table)

    def at(self, angle: Floats) -> WindCoefficients:
        """Coefficients at angles from 0 to pi, straight between those of the table."""
        at = degrees(angle)
        CK = np.zeros_like(at)
        if self.CK is not None:
            CK = interp(at, self.angles_deg, self.CK)
        return WindCoefficients(
            CX=interp(at, self.angles_deg, self.CX),
            CY=interp(at, self.angles_deg, self.CY),
            CN=interp(at, self.angles_deg, self.CN),
            CK=CK,
        )


def _numbers(values: Any, where: str) -> tuple[float, ...]:
    if not isinstance(values, list | tuple | np.ndarray):
        raise InputError(f"{where}: expected a list of numbers, got {values!r}")
    return tuple(check_number(value, f"{where}[{i}]") for i, value in enumerate(values))


def coefficient_names() -> tuple[str, ...]:
    """Words that `Wind(coefficients=...)` understands."""
    types = [f"blendermann-{ship}" for ship in BLENDERMANN]
    return ("blendermann", *types)


def check_coefficients(value: Any, where: str) -> None:
    """Raise InputError for what `Wind(coefficients=...)` does not understand."""
    if isinstance(value, WindTable):
        return
    names = coefficient_names()
    if isinstance(value, str) and value in names:
        return
    hint = ""
    if isinstance(value, str):
        hint = did_you_mean(value, names)
    raise InputError(
        f"{where}: expected a WindTable or one of {quoted(names)}, got {value!r}.{hint}"
    )


def blendermann_type(name: str, block_coefficient: float) -> str:
    """Type of ship in :data:`BLENDERMANN` that a word asks for.

    "blendermann" alone takes a full hull (block coefficient of 0.75 or more) for a
    loaded tanker, a fine one (below 0.65) for a loaded container ship, and others for a
    loaded cargo ship.
    """
    if name != "blendermann":
        return name.removeprefix("blendermann-")
    if block_coefficient >= 0.75:
        return "tanker-loaded"
    if block_coefficient < 0.65:
        return "container-loaded"
    return "cargo-loaded"


def blendermann_coefficients(
    row: Blendermann, angle: Floats, area_ratio: float, centroid_ratio: float
) -> WindCoefficients:
    """Blendermann's coefficients of a type of ship for wind of one side.

    Fossen 2021, section 10.1.2. `angle` is from 0 (ahead) to pi
    (astern), `area_ratio` the frontal by the lateral area, `centroid_ratio` the
    centroid of the lateral area forward of midship by length overall. CK is by lateral
    area and the height of its centroid.
    """
    CD_l_AF = where(angle <= pi / 2, row.CD_l_bow, row.CD_l_stern)
    CD_l = CD_l_AF * area_ratio
    cross_force = 0.5 * row.delta * (1.0 - CD_l / row.CD_t)
    oblique = sin(2.0 * angle) ** 2
    denominator = 1.0 - cross_force * oblique

    CY = row.CD_t * sin(angle) / denominator
    lever = centroid_ratio - 0.18 * (angle - pi / 2)
    return WindCoefficients(
        CX=-CD_l_AF * cos(angle) / denominator,
        CY=CY,
        CN=lever * CY,
        CK=row.kappa * CY,
    )
