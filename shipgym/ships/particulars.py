"""Particulars of a ship, and estimates from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import (
    bounded,
    check_table,
    check_text,
    keep_numbers,
    placed,
    quoted,
    unexpected,
)
from shipgym.constants import SEA_WATER
from shipgym.errors import InputError

#: Added masses, in the prime system; in a ship file under ``[ship.added_mass]``.
ADDED_MASSES = ("X_udot", "Y_vdot", "Y_rdot", "N_vdot", "N_rdot")


_IN_PRIME_SYSTEM = (
    "in the prime system (mass by rho L^3 / 2), as a derivative: Y_vdot is minus the"
    " added mass"
)


def _size() -> Any:
    """Field of a value above 0 that may be unknown."""
    return bounded(None, above=0.0)


def _added_mass(below: float) -> Any:
    """Field of a derivative by an acceleration."""
    return bounded(None, above=-1.0, below=below, hint=_IN_PRIME_SYSTEM)


@dataclass(frozen=True)
class Particulars(Mapping[str, Any]):
    """Main dimensions, mass and added masses of a ship; a mapping from name to value.

    Unknown values are None. :meth:`completed` estimates those that the models need.

    Raises InputError for values that no ship has.

    Parameters
    ----------
    name : str
        The ship's name.
    length, beam, draught : float
        Length between perpendiculars, beam and draught, m; all but the length are
        optional.
    mass, xg, yaw_gyradius : float, optional
        Displacement mass, kg; centre of gravity forward of midship, m; radius of
        gyration in yaw about it, m.
    block_coefficient, speed : float, optional
        Displaced volume divided by length * beam * draught; service speed, m/s.
    rudder_area, propeller_diameter : float, optional
        Movable area of the rudder, of all rudders together, m2; m.
    rudder_aspect_ratio, propeller_pitch_ratio : float, optional
        Squared span of a rudder divided by its area; pitch of the propeller divided by
        its diameter.
    rudders, propellers : float, optional
        How many; 1 where not given.
    length_overall, frontal_area, lateral_area : float, optional
        m; projected areas above the water seen from ahead and from the side, m2.
    lateral_centroid, lateral_centroid_height : float, optional
        Centroid of the lateral area forward of midship and above the water, m.
    metacentric_height, roll_period : float, optional
        Transverse, GM, m; natural period of roll, s.
    water_density : float, optional
        kg/m3.
    X_udot, Y_vdot, Y_rdot, N_vdot, N_rdot : float, optional
        Added-mass derivatives in the prime system: the first two by rho L^3 / 2, Y_rdot
        and N_vdot by rho L^4 / 2, N_rdot by rho L^5 / 2; about midship.
    estimated : frozenset of str
        Names of the values that were estimated.
    """

    length: float = bounded(
        above=0.01, below=2000.0, hint="between perpendiculars, in m"
    )
    name: str = "ship"
    beam: float | None = _size()
    draught: float | None = _size()
    mass: float | None = _size()
    xg: float | None = bounded(None)
    yaw_gyradius: float | None = _size()
    block_coefficient: float | None = bounded(None, above=0.0, below=1.0)
    speed: float | None = bounded(
        None, above=0.0, below=50.0, hint="in m/s; a knot is 0.514 m/s"
    )
    rudder_area: float | None = _size()
    propeller_diameter: float | None = _size()
    rudder_aspect_ratio: float | None = bounded(None, above=0.0, below=10.0)
    propeller_pitch_ratio: float | None = bounded(None, above=0.0, below=3.0)
    rudders: float | None = bounded(None, above=0.0, below=9.0)
    propellers: float | None = bounded(None, above=0.0, below=9.0)
    length_overall: float | None = _size()
    frontal_area: float | None = _size()
    lateral_area: float | None = _size()
    lateral_centroid: float | None = bounded(None)
    lateral_centroid_height: float | None = _size()
    metacentric_height: float | None = _size()
    roll_period: float | None = bounded(None, above=0.0, below=200.0)
    water_density: float | None = bounded(
        None,
        above=500.0,
        below=1500.0,
        hint="in kg/m3; fresh water has 1000, sea water 1025",
    )
    X_udot: float | None = _added_mass(0.0)
    Y_vdot: float | None = _added_mass(0.0)
    Y_rdot: float | None = _added_mass(1.0)
    N_vdot: float | None = _added_mass(1.0)
    N_rdot: float | None = _added_mass(0.0)
    estimated: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        check_text(self.name, "name")
        keep_numbers(self)
        names = self.estimated
        listed = isinstance(names, list | tuple | set | frozenset)
        if not listed or not all(name in NAMES for name in names):
            raise unexpected("estimated", "a list of names of values", names)
        object.__setattr__(self, "estimated", frozenset(names))
        # what was given is held against what was given alone
        given = {
            name: value
            for name, value in self.items()
            if value is not None and (name == "length" or name not in names)
        }
        check_together(given)

    def __getitem__(self, name: str) -> Any:
        if name not in NAMES:
            raise KeyError(name)
        return getattr(self, name)

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)

    @classmethod
    def from_mapping(
        cls, mapping: Mapping[str, Any], where: str = "particulars"
    ) -> Self:
        """Make particulars from the keys of the ship file's ``[ship]``.

        Added masses are there or in a table ``added_mass``; ``estimated`` is as
        :meth:`to_dict` writes it; None stands for a value that is not known. Raises
        InputError, beginning with `where`, for an unknown key, a missing length, a
        wrong type or a value that no ship has.
        """
        known = (*NAMES, "added_mass", "estimated")
        table = dict(check_table(mapping, where, known, ("length",)))
        added = table.pop("added_mass", None) or {}
        check_table(added, f"{where} added_mass", ADDED_MASSES)
        twice = table.keys() & added.keys()
        if twice:
            raise InputError(
                f"{where} added_mass: expected each value in one place, got"
                f" {quoted(sorted(twice))} twice"
            )
        with placed(where, " "):
            return cls(**(table | added))

    def to_dict(self) -> dict[str, Any]:
        """Values by name, ready for JSON; :meth:`from_mapping` reads them."""
        # left out where not known: other hashes of a model are those of another ship
        later = {
            "rudder_aspect_ratio",
            "propeller_pitch_ratio",
            "rudders",
            "propellers",
        }
        found = {
            name: value
            for name, value in self.items()
            if value is not None or name not in later
        }
        return {**found, "estimated": sorted(self.estimated)}

    def require(self, name: str) -> float:
        """Return a value that must be known; InputError where it is None."""
        value = self[name]
        if value is None:
            raise InputError(
                f"particulars of {self.name}: {name} is needed and not known; give it"
                " in [ship]"
            )
        return float(value)

    @property
    def mass_prime(self) -> float:
        """Mass by rho L^3 / 2."""
        mass = self.require("mass")
        unit = 0.5 * self.require("water_density") * self.length**3
        return mass / unit

    @property
    def xg_prime(self) -> float:
        """Centre of gravity forward of midship by L."""
        return self.require("xg") / self.length

    @property
    def inertia_prime(self) -> float:
        """Yaw inertia about MIDSHIP by rho L^5 / 2, m xg^2 included."""
        gyradius = self.require("yaw_gyradius") / self.length
        return self.mass_prime * (gyradius**2 + self.xg_prime**2)

    def completed(self) -> Particulars:
        """Return particulars with absent mass, inertia and added masses estimated.

        Water density 1025 kg/m3, centre of gravity at midship, yaw gyradius L/4, mass
        from the block coefficient, X_udot five per cent of the mass, the other added
        masses by the regressions of Clarke, Gedling and Hine 1983 (The application of
        manoeuvring criteria in hull design using linear theory, Transactions of RINA
        125). Raises InputError, naming what is missing, where not even that is
        possible.
        """
        return with_estimates(self, _ESTIMATES)


#: Names of all values, in the order of the ship file.
NAMES: tuple[str, ...] = tuple(
    item.name for item in fields(Particulars) if item.name != "estimated"
)

#: Largest part of the length that a value has, of areas of the length squared.
SHARES = {
    "beam": 1.0,
    "draught": 0.5,
    "xg": 0.5,
    "yaw_gyradius": 0.7,
    "propeller_diameter": 0.5,
    "length_overall": 2.0,
    "frontal_area": 0.5,
    "lateral_area": 0.5,
    "lateral_centroid": 0.5,
    "lateral_centroid_height": 0.5,
    "metacentric_height": 0.2,
}

Estimates = Mapping[str, Callable[[Particulars], float | None]]


def with_estimates(ship: Particulars, estimates: Estimates) -> Particulars:
    """Particulars with absent values estimated in turn, and marked so."""
    for name, estimate in estimates.items():
        if ship[name] is not None:
            continue
        value = estimate(ship)
        if value is not None:
            marked = ship.estimated | {name}
            fields: dict[str, Any] = {name: value, "estimated": marked}
            ship = replace(ship, **fields)
    return ship


class MainDimensions(NamedTuple):
    """Main dimensions of a ship in the symbols of formulas, m."""

    L: float  # length between perpendiculars
    B: float  # beam
    T: float  # draught
    CB: float  # block coefficient


def main_dimensions(ship: Particulars) -> MainDimensions:
    """Main dimensions of a ship; InputError where one of them is not known."""
    return MainDimensions(
        L=ship.length,
        B=ship.require("beam"),
        T=ship.require("draught"),
        CB=ship.require("block_coefficient"),
    )


def clarke_added_masses(
    length: float, beam: float, draught: float, block_coefficient: float
) -> dict[str, float]:
    """Added masses in sway and yaw from a hull's proportions, prime system, midship.

    Regressions of Clarke, Gedling and Hine 1983, by pi (T/L)^2. Dimensions in m; the
    block coefficient is the displaced volume by length * beam * draught.
    """
    B_L = beam / length
    B_T = beam / draught
    cB_B_T = block_coefficient * B_T
    Y_vdot = 1.0 + 0.16 * cB_B_T - 5.1 * B_L**2
    Y_rdot = 0.67 * B_L - 0.0033 * B_T**2
    N_vdot = 1.1 * B_L - 0.041 * B_T
    N_rdot = 1.0 / 12.0 + 0.017 * cB_B_T - 0.33 * B_L
    unit = -math.pi * (draught / length) ** 2
    return {
        "Y_vdot": unit * Y_vdot,
        "Y_rdot": unit * Y_rdot,
        "N_vdot": unit * N_vdot,
        "N_rdot": unit * N_rdot,
    }


def _box_mass(ship: Particulars) -> float:
    """Mass of water in the box around the hull, kg."""
    box = ship.length * ship.require("beam") * ship.require("draught")
    return ship.require("water_density") * box


def _block_coefficient(ship: Particulars) -> float | None:
    if ship.mass is None or ship.beam is None or ship.draught is None:
        return None
    return ship.mass / _box_mass(ship)


def _mass(ship: Particulars) -> float:
    remedy = "give mass (kg), or beam, draught and block_coefficient, in [ship]"
    _check_known(ship, "mass", remedy)
    return ship.require("block_coefficient") * _box_mass(ship)


def _clarke(name: str, ship: Particulars) -> float:
    """Estimate one added mass."""
    remedy = (
        "give beam, draught and block_coefficient (or mass) in [ship], or all of"
        f" {', '.join(ADDED_MASSES)} in [ship.added_mass]"
    )
    _check_known(ship, name, remedy)
    beam = ship.require("beam")
    draught = ship.require("draught")
    estimates = clarke_added_masses(
        ship.length,
        beam,
        draught,
        ship.require("block_coefficient"),
    )
    value = estimates[name]
    if name in ("Y_vdot", "N_rdot") and value >= 0.0:
        raise InputError(
            f"particulars of {ship.name}: expected a {name} < 0, got {value:.3g} by"
            f" regression for length/beam {ship.length / beam:.2f} and beam/draught"
            f" {beam / draught:.2f}: the proportions are outside its range; check them,"
            " or give [ship.added_mass]"
        )
    return value


def _check_known(ship: Particulars, name: str, remedy: str) -> None:
    """Refuse to estimate `name` from proportions of the hull that are not all known."""
    absent = [
        other
        for other in ("beam", "draught", "block_coefficient")
        if ship[other] is None
    ]
    if absent:
        raise InputError(
            f"particulars of {ship.name}: {name} is not given and cannot be estimated"
            f" without {', '.join(absent)}; {remedy}"
        )


_ESTIMATES: Estimates = {  # in this order
    "water_density": lambda ship: SEA_WATER,
    "xg": lambda ship: 0.0,
    "yaw_gyradius": lambda ship: 0.25 * ship.length,
    "block_coefficient": _block_coefficient,
    "mass": _mass,
    "X_udot": lambda ship: -0.05 * ship.mass_prime,
    "Y_vdot": partial(_clarke, "Y_vdot"),
    "Y_rdot": partial(_clarke, "Y_rdot"),
    "N_vdot": partial(_clarke, "N_vdot"),
    "N_rdot": partial(_clarke, "N_rdot"),
}


# ---- limits: a value beyond them is mostly in a wrong unit ----------


def check_together(values: Mapping[str, float]) -> None:
    """Refuse values, the length among them, that do not fit each other."""
    length = values["length"]
    for name, share in SHARES.items():
        power = 2 if name.endswith("_area") else 1
        if abs(values.get(name, 0.0)) > share * length**power:
            raise InputError(
                f"{name}: expected at most {share:g} of the length"
                f"{' squared' * (power - 1)}, got {values[name]:g} with length"
                f" {length:g}; check the units (m{'2' * (power - 1)})"
            )
    if "mass" in values:
        _check_mass(values)


def _check_mass(values: Mapping[str, float]) -> None:
    """Refuse a mass, kg, that does not fit the dimensions."""
    mass = values["mass"]
    density = values.get("water_density", SEA_WATER)
    unit = density * values["length"] ** 3
    low, high = 2e-4, 0.2
    reason = "0.0002 to 0.2 times water_density * length^3"
    if "beam" in values and "draught" in values:
        unit = density * values["length"] * values["beam"] * values["draught"]
        low, high = 0.2, 1.0
        reason = "a block coefficient of 0.2 to 1"

    if not low * unit <= mass <= high * unit:
        raise InputError(
            f"mass: expected {low * unit:.4g} to {high * unit:.4g} kg ({reason}), got"
            f" {mass:g}; check the units (kg, not tonnes)"
        )


# ---- inertia about midship ------------------------------


def prime_inertia(particulars: Particulars) -> Floats:
    """Inertia of surge, sway and yaw by the particulars, prime system, shape (3, 3).

    Raises InputError if it is not positive.
    """
    p = particulars
    derivatives = [
        [p.require("X_udot"), 0.0, 0.0],
        [0.0, p.require("Y_vdot"), p.require("Y_rdot")],
        [0.0, p.require("N_vdot"), p.require("N_rdot")],
    ]
    return total_inertia(
        particulars,
        np.array(derivatives),
        "inertia of the ship: expected a positive one, got mass, xg, yaw_gyradius and"
        " added masses that do not belong together; added masses are in the prime"
        " system and negative (X_udot, Y_vdot, N_rdot)",
    )


def total_inertia(
    particulars: Particulars, derivatives: Floats, problem: str
) -> Floats:
    """Inertia less the derivatives of (X, Y, N) by the accelerations, (3, 3).

    Raises InputError with the `problem` if it is not positive.
    """
    m = particulars.mass_prime
    m_xG = m * particulars.xg_prime
    I_z = particulars.inertia_prime
    rigid = [
        [m, 0.0, 0.0],
        [0.0, m, m_xG],
        [0.0, m_xG, I_z],
    ]
    total = np.array(rigid) - derivatives
    surge = total[0, 0]
    sway_and_yaw = total[1:, 1:]
    if surge <= 0.0 or np.linalg.det(sway_and_yaw) <= 0.0:
        raise InputError(problem)
    return total
