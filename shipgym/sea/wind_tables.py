"""Published wind coefficients of ships: Blendermann 1994 by type of ship, Isherwood 1972 by regression."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_keys, check_number, check_table, did_you_mean, quoted
from shipgym.errors import InputError


class Blendermann(NamedTuple):
    """One row of Blendermann's table."""

    CD_t: float  # transverse resistance, by lateral area
    # longitudinal resistance in head and in following wind, by frontal area
    CD_l_bow: float
    CD_l_stern: float
    delta: float  # cross-force parameter
    kappa: float  # rolling-moment factor


#: Blendermann 1994, Parameter identification of wind loads on ships, Journal of Wind Engineering and
#: Industrial Aerodynamics 51; table as in Fossen 2021, section 10.1.2, and the MSS toolbox.
BLENDERMANN = {
    "car-carrier": Blendermann(0.95, 0.55, 0.60, 0.80, 1.2),
    "cargo-loaded": Blendermann(0.85, 0.65, 0.55, 0.40, 1.7),
    "cargo-container-on-deck": Blendermann(0.85, 0.55, 0.50, 0.40, 1.4),
    "container-loaded": Blendermann(0.90, 0.55, 0.55, 0.40, 1.4),
    "destroyer": Blendermann(0.85, 0.60, 0.65, 0.65, 1.1),
    "diving-support": Blendermann(0.90, 0.60, 0.80, 0.55, 1.7),
    "drilling": Blendermann(1.00, 0.85, 0.925, 0.10, 1.7),
    "ferry": Blendermann(0.90, 0.45, 0.50, 0.80, 1.1),
    "fishing": Blendermann(0.95, 0.70, 0.70, 0.40, 1.1),
    "lng-tanker": Blendermann(0.70, 0.60, 0.65, 0.50, 1.1),
    "offshore-supply": Blendermann(0.90, 0.55, 0.80, 0.55, 1.2),
    "passenger-liner": Blendermann(0.90, 0.40, 0.40, 0.80, 1.2),
    "research": Blendermann(0.85, 0.55, 0.65, 0.60, 1.4),
    "speed-boat": Blendermann(0.90, 0.55, 0.60, 0.60, 1.1),
    "tanker-loaded": Blendermann(0.70, 0.90, 0.55, 0.40, 3.1),
    "tanker-ballast": Blendermann(0.70, 0.75, 0.55, 0.40, 2.2),
    "tender": Blendermann(0.85, 0.55, 0.55, 0.65, 1.1),
}

_PREFIX = "blendermann-"


def coefficient_names() -> tuple[str, ...]:
    """Words that `Wind(coefficients=...)` understands."""
    return ("blendermann", "isherwood", *(_PREFIX + ship for ship in BLENDERMANN))


@dataclass(frozen=True)
class WindTable:
    """Measured or computed wind coefficients of one's own ship.

    Parameters
    ----------
    angles_deg : tuple of float
        Where the relative wind comes from, degrees from the bow, rising from 0 to 180; the other side is
        the mirror image.
    CX : tuple of float
        Surge force by the frontal area; negative in head wind.
    CY : tuple of float
        Sway force to the LEE side by the lateral area, positive.
    CN : tuple of float
        Yaw moment about midship by lateral area and length overall, positive where the bow turns to lee.
    CK : tuple of float, optional
        Heeling moment about the waterline to lee by lateral area and its mean height (area by length
        overall); none is taken where it is not given.

    Raises
    ------
    InputError
        For angles that do not rise from 0 to 180, or rows of another length.
    """

    angles_deg: tuple[float, ...]
    CX: tuple[float, ...]
    CY: tuple[float, ...]
    CN: tuple[float, ...]
    CK: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("angles_deg", "CX", "CY", "CN", "CK"):
            if getattr(self, name) is None and name == "CK":
                continue
            row, expected = _row(getattr(self, name), f"wind table {name}"), len(self.angles_deg)
            object.__setattr__(self, name, row)
            if len(row) != expected:
                raise InputError(
                    f"wind table {name}: {len(row)} values found, expected {expected}, one for each angle"
                )
        rising = all(a < b for a, b in zip(self.angles_deg, self.angles_deg[1:], strict=False))
        if len(self.angles_deg) < 3 or not rising or self.angles_deg[0] != 0 or self.angles_deg[-1] != 180:
            raise InputError(
                f"wind table angles_deg: {self.angles_deg} found, expected at least three that rise from 0 "
                "to 180"
            )
        for name in ("CY", "CN", "CK"):
            row = getattr(self, name)
            if row is not None and (row[0] != 0.0 or row[-1] != 0.0):
                raise InputError(
                    f"wind table {name}: {row[0]:g} and {row[-1]:g} found at 0 and 180 degrees, expected "
                    "0: a ship with port-starboard symmetry"
                )

    @classmethod
    def from_dict(cls, mapping: Mapping[str, Any], where: str = "wind table") -> WindTable:
        """Read a table as it stands in JSON; InputError for an unknown or missing row."""
        table = check_table(mapping, where)
        needed = ("angles_deg", "CX", "CY", "CN")
        check_keys(table, (*needed, "CK"), where, needed)
        return cls(**table)


def _row(values: Any, where: str) -> tuple[float, ...]:
    if not isinstance(values, list | tuple | np.ndarray):
        raise InputError(f"{where}: {values!r} found, expected a list of numbers")
    return tuple(check_number(value, f"{where}[{i}]") for i, value in enumerate(values))


def check_coefficients(value: Any, where: str) -> None:
    """InputError for what `Wind(coefficients=...)` does not understand, naming the words that it does."""
    if isinstance(value, WindTable) or (isinstance(value, str) and value in coefficient_names()):
        return
    hint = did_you_mean(value, coefficient_names()) if isinstance(value, str) else ""
    raise InputError(
        f"{where}: {value!r} found, expected a WindTable or one of {quoted(coefficient_names())}.{hint}"
    )


def blendermann_type(name: str, block_coefficient: float) -> str:
    """Type of ship in :data:`BLENDERMANN` that a word asks for.

    "blendermann" alone takes a full hull (block coefficient of 0.75 or more) for a loaded tanker, a fine one
    (below 0.65) for a loaded container ship, and others for a loaded cargo ship.
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

    `area_ratio` is the frontal by the lateral area, `centroid_ratio` the centroid of the lateral area forward
    of midship by length overall. Returns CX by frontal area; CY to lee by lateral area; CN with the bow to
    lee by lateral area and length overall; CK to lee by lateral area and the height of its centroid.
    """
    CD_l_AF = np.where(angle <= np.pi / 2, row.CD_l_bow, row.CD_l_stern)
    CD_l = CD_l_AF * area_ratio
    denominator = 1.0 - 0.5 * row.delta * (1.0 - CD_l / row.CD_t) * np.sin(2.0 * angle) ** 2
    CX = -CD_l_AF * np.cos(angle) / denominator
    CY = row.CD_t * np.sin(angle) / denominator
    CN = (centroid_ratio - 0.18 * (angle - np.pi / 2)) * CY
    return CX, CY, CN, row.kappa * CY


# Isherwood 1972, Wind resistance of merchant ships, Transactions of RINA 115; rows every 10 degrees from
# the bow, as tabulated in the MSS toolbox. Columns: constant, 2 AL / L^2, 2 AF / B^2, L / B, S / L, C / L,
# then the number of masts (CX) or the superstructure's share of the lateral area (CY).
_CX = np.array([
    [2.152, -5.00, 0.243, -0.164, 0, 0, 0], [1.714, -3.33, 0.145, -0.121, 0, 0, 0],
    [1.818, -3.97, 0.211, -0.143, 0, 0, 0.033], [1.965, -4.81, 0.243, -0.154, 0, 0, 0.041],
    [2.333, -5.99, 0.247, -0.190, 0, 0, 0.042], [1.726, -6.54, 0.189, -0.173, 0.348, 0, 0.048],
    [0.913, -4.68, 0, -0.104, 0.482, 0, 0.052], [0.457, -2.88, 0, -0.068, 0.346, 0, 0.043],
    [0.341, -0.91, 0, -0.031, 0, 0, 0.032], [0.355, 0, 0, 0, -0.247, 0, 0.018],
    [0.601, 0, 0, 0, -0.372, 0, -0.020], [0.651, 1.29, 0, 0, -0.582, 0, -0.031],
    [0.564, 2.54, 0, 0, -0.748, 0, -0.024], [-0.142, 3.58, 0, 0.047, -0.700, 0, -0.028],
    [-0.677, 3.64, 0, 0.069, -0.529, 0, -0.032], [-0.723, 3.14, 0, 0.064, -0.475, 0, -0.032],
    [-2.148, 2.56, 0, 0.081, 0, 1.27, -0.027], [-2.707, 3.97, -0.175, 0.126, 0, 1.81, 0],
    [-2.529, 3.76, -0.174, 0.128, 0, 1.55, 0],
])  # fmt: skip
_CY = np.array([
    [0, 0, 0, 0, 0, 0, 0], [0.096, 0.22, 0, 0, 0, 0, 0], [0.176, 0.71, 0, 0, 0, 0, 0],
    [0.225, 1.38, 0, 0.023, 0, -0.29, 0], [0.329, 1.82, 0, 0.043, 0, -0.59, 0],
    [1.164, 1.26, 0.121, 0, -0.242, -0.95, 0], [1.163, 0.96, 0.101, 0, -0.177, -0.88, 0],
    [0.916, 0.53, 0.069, 0, 0, -0.65, 0], [0.844, 0.55, 0.082, 0, 0, -0.54, 0],
    [0.889, 0, 0.138, 0, 0, -0.66, 0], [0.799, 0, 0.155, 0, 0, -0.55, 0],
    [0.797, 0, 0.151, 0, 0, -0.55, 0], [0.996, 0, 0.184, 0, -0.212, -0.66, 0.34],
    [1.014, 0, 0.191, 0, -0.280, -0.69, 0.44], [0.784, 0, 0.166, 0, -0.209, -0.53, 0.38],
    [0.536, 0, 0.176, -0.029, -0.163, 0, 0.27], [0.251, 0, 0.106, -0.022, 0, 0, 0],
    [0.125, 0, 0.046, -0.012, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0],
])  # fmt: skip
_CN = np.array([
    [0, 0, 0, 0, 0, 0], [0.0596, 0.061, 0, 0, 0, -0.074], [0.1106, 0.204, 0, 0, 0, -0.170],
    [0.2258, 0.245, 0, 0, 0, -0.380], [0.2017, 0.457, 0, 0.0067, 0, -0.472],
    [0.1759, 0.573, 0, 0.0118, 0, -0.523], [0.1925, 0.480, 0, 0.0115, 0, -0.546],
    [0.2133, 0.315, 0, 0.0081, 0, -0.526], [0.1827, 0.254, 0, 0.0053, 0, -0.443],
    [0.2627, 0, 0, 0, 0, -0.508], [0.2102, 0, -0.0195, 0, 0.0335, -0.492],
    [0.1567, 0, -0.0258, 0, 0.0497, -0.457], [0.0801, 0, -0.0311, 0, 0.0740, -0.396],
    [-0.0189, 0, -0.0488, 0.0101, 0.1128, -0.420], [0.0256, 0, -0.0422, 0.0100, 0.0889, -0.463],
    [0.0552, 0, -0.0381, 0.0109, 0.0689, -0.476], [0.0881, 0, -0.0306, 0.0091, 0.0366, -0.415],
    [0.0851, 0, -0.0122, 0.0025, 0, -0.220], [0, 0, 0, 0, 0, 0],
])  # fmt: skip


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

    Lengths in m, projected areas above the water in m2; `length` is overall, `perimeter` that of the lateral
    projection without waterline, masts and ventilators, `bow_to_centroid` reaches to the centroid of the
    lateral area, `masts` are groups of masts seen from the side, `superstructure_area` is that of the lateral
    area. Returns CX by frontal area; CY to lee by lateral area; CN with the bow to lee by lateral area and
    length.
    """
    hull = [1.0, 2.0 * lateral_area / length**2, 2.0 * frontal_area / beam**2, length / beam]
    outline = [*hull, perimeter / length, bow_to_centroid / length]
    return (
        -_CX @ np.array([*outline, masts]),
        _CY @ np.array([*outline, superstructure_area / lateral_area]),
        _CN @ np.array(outline),
    )
