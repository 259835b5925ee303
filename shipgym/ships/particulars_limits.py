"""Limits of a ship's particulars; a value beyond them is mostly in a wrong unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from shipgym.checks import check_number
from shipgym.constants import SEA_WATER
from shipgym.errors import InputError

#: Added masses, in the prime system; in a ship file under ``[ship.added_mass]``.
ADDED_MASSES = ("X_udot", "Y_vdot", "Y_rdot", "N_vdot", "N_rdot")


@dataclass(frozen=True)
class ParticularLimits:
    """Limits of one value, and how it changes from a ship to a similar one."""

    above: float | None = None
    below: float | None = None
    hint: str = ""  # unit or meaning, for messages
    growth: float = 0.0  # power of the length with which the value grows
    share: float | None = None  # largest part of that power of the length


_IN_PRIME_SYSTEM = (
    "in the prime system (mass by rho L^3 / 2), as a derivative: Y_vdot is minus the"
    " added mass"
)
_ADDED_MASS = ParticularLimits(-1.0, 0.0, _IN_PRIME_SYSTEM)
_COUPLING = ParticularLimits(-1.0, 1.0, _IN_PRIME_SYSTEM)

LIMITS = {
    "length": ParticularLimits(0.01, 2000.0, "between perpendiculars, in m"),
    "beam": ParticularLimits(above=0.0, growth=1.0, share=1.0),
    "draught": ParticularLimits(above=0.0, growth=1.0, share=0.5),
    "mass": ParticularLimits(above=0.0),
    "xg": ParticularLimits(growth=1.0, share=0.5),
    "yaw_gyradius": ParticularLimits(above=0.0, growth=1.0, share=0.7),
    "block_coefficient": ParticularLimits(above=0.0, below=1.0),
    "speed": ParticularLimits(0.0, 50.0, "in m/s; a knot is 0.514 m/s"),
    "rudder_area": ParticularLimits(above=0.0, growth=2.0),
    "propeller_diameter": ParticularLimits(above=0.0, growth=1.0, share=0.5),
    "rudder_aspect_ratio": ParticularLimits(above=0.0, below=10.0),
    "propeller_pitch_ratio": ParticularLimits(above=0.0, below=3.0),
    "rudders": ParticularLimits(above=0.0, below=9.0),
    "propellers": ParticularLimits(above=0.0, below=9.0),
    "length_overall": ParticularLimits(above=0.0, growth=1.0, share=2.0),
    "frontal_area": ParticularLimits(above=0.0, growth=2.0, share=0.5),
    "lateral_area": ParticularLimits(above=0.0, growth=2.0, share=0.5),
    "lateral_centroid": ParticularLimits(growth=1.0, share=0.5),
    "lateral_centroid_height": ParticularLimits(above=0.0, growth=1.0, share=0.5),
    "metacentric_height": ParticularLimits(above=0.0, growth=1.0, share=0.2),
    "roll_period": ParticularLimits(above=0.0, below=200.0, growth=0.5),
    "water_density": ParticularLimits(
        500.0, 1500.0, "in kg/m3; fresh water has 1000, sea water 1025"
    ),
    "X_udot": _ADDED_MASS,
    "Y_vdot": _ADDED_MASS,
    "Y_rdot": _COUPLING,
    "N_vdot": _COUPLING,
    "N_rdot": _ADDED_MASS,
}


def check_value(name: str, value: Any) -> float:
    """Return one value as float; InputError, naming it, for what no ship has."""
    limits = LIMITS[name]
    place = f"added_mass {name}" if name in ADDED_MASSES else name
    return check_number(
        value,
        place,
        above=limits.above,
        below=limits.below,
        hint=limits.hint,
    )


def check_together(values: Mapping[str, float]) -> None:
    """Refuse values, the length among them, that do not fit each other."""
    length = values["length"]
    for name, value in values.items():
        limits = LIMITS[name]
        if limits.share is None:
            continue
        largest = limits.share * length**limits.growth
        if abs(value) > largest:
            is_area = limits.growth == 2.0
            squared = " squared" if is_area else ""
            unit = "m2" if is_area else "m"
            raise InputError(
                f"{name}: expected at most {limits.share:g} of the length{squared}, got"
                f" {value:g} with length {length:g}; check the units ({unit})"
            )
    if "mass" in values:
        _check_mass(values)


def _check_mass(values: Mapping[str, float]) -> None:
    """Refuse a mass, kg, that does not fit the dimensions."""
    mass = values["mass"]
    length = values["length"]
    beam = values.get("beam")
    draught = values.get("draught")
    density = values.get("water_density", SEA_WATER)
    if beam is None or draught is None:
        cube = density * length**3
        low = 2e-4 * cube
        high = 0.2 * cube
        reason = "0.0002 to 0.2 times water_density * length^3"
    else:
        box = density * length * beam * draught
        low = 0.2 * box
        high = box
        reason = "a block coefficient of 0.2 to 1"
        if "block_coefficient" in values:
            displaced = box * values["block_coefficient"]
            low = 0.5 * displaced
            high = 2.0 * displaced
            reason = "half to twice what block_coefficient gives"

    if not low <= mass <= high:
        raise InputError(
            f"mass: expected {low:.4g} to {high:.4g} kg ({reason}), got {mass:g};"
            " check the units (kg, not tonnes)"
        )
