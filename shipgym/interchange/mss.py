"""Parameter sets of the Marine Systems Simulator (MSS), of its functions `mariner` and `container`.

Source: Fossen & Perez, Marine Systems Simulator, `mariner.m` (Chislett & Strom-Tejsen
1965) and `container.m` (Son & Nomoto 1981). A set is a mapping of the names in these
files, all without unit but for the length `L` in m, the speed `U0` in m/s and the
rudder's `delta_max` and `Ddelta_max` in deg and deg/s; as JSON, MATLAB reads it with
`jsondecode`. MSS writes its Mariner for a rudder positive to port.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import sqrt
from typing import Any

from shipgym.checks import check_keys, check_number
from shipgym.errors import InputError
from shipgym.ships import ShipModel, get_structure, load_model
from shipgym.ships.particulars import ADDED_MASSES, Particulars
from shipgym.ships.steering import SteeringGear

MIRRORED = {"X_vr": "Xrv", "Y_uv": "Yvu", "Y_ur": "Yru", "N_uv": "Nvu", "N_ur": "Nru"}
RENAMED = {"kappa": "kk", "gamma": "ga"}
GEAR = {"delta_max": "rudder_limit_deg", "Ddelta_max": "rudder_rate_deg_s"}


def to_mss(model: ShipModel) -> dict[str, float]:
    """The parameters of a model of structure `abkowitz`, or of the container ship, as MSS names them.

    Raises InputError for another model, or one whose mass or added masses are not
    known.
    """
    p = model.particulars
    found = {"L": p.length} | {
        key: getattr(model.steering, own) for key, own in GEAR.items()
    }
    if model.structure == "container":
        return found | {
            _roll_name(name): value for name, value in model.coefficients.items()
        }
    if model.structure != "abkowitz":
        raise InputError(
            f"model '{model.name}': structure '{model.structure}' found, expected"
            " abkowitz or container, the ships of MSS that are sets of parameters"
        )
    found |= {
        "U0": p.require("speed"),
        "m": p.mass_prime,
        "xG": p.xg_prime,
        "Iz": p.inertia_prime,
    }
    found |= {name.replace("_", ""): p.require(name) for name in ADDED_MASSES}
    return found | {
        _name(name): _port(name) * value for name, value in model.coefficients.items()
    }


def from_mss(
    parameters: Mapping[str, Any], name: str = "mss", water_density: float = 1025.0
) -> ShipModel:
    """The model for a parameter set of MSS: structure `abkowitz` or, with `Xphiphi`, the container ship.

    Raises InputError for a parameter that is missing, unknown or no number, or a
    container ship of another length than hers, which is in her equations.
    """
    where = "MSS parameters"
    given: dict[str, Any] = {
        key: check_number(value, f"{where}: {key}") for key, value in parameters.items()
    }
    gear = {own: given[key] for key, own in GEAR.items() if key in given}
    if "Xphiphi" in given:
        ship = load_model("container")
        names = {_roll_name(own): own for own in ship.coefficients}
        known = ("L", *GEAR, *names)
        check_keys(given, known, where, known)
        if given["L"] != ship.particulars.length:
            raise InputError(
                f"{where}: L: {given['L']:g} found, expected"
                f" {ship.particulars.length:g}"
            )
        values = {own: given[key] for key, own in names.items()}
        return replace(
            ship,
            name=name,
            steering=replace(ship.steering, **gear),
            coefficients=values,
        )
    names = {_name(own): own for own in get_structure("abkowitz").coefficient_names}
    masses = {own.replace("_", ""): own for own in ADDED_MASSES}
    known = ("L", "U0", *GEAR, "m", "xG", "Iz", *masses, *names)
    check_keys(given, known, where, known)
    m, L, xg = given["m"], given["L"], given["xG"]
    particulars = Particulars(
        L,
        name,
        mass=m * 0.5 * water_density * L**3,
        xg=xg * L,
        speed=given["U0"],
        water_density=water_density,
        yaw_gyradius=L * sqrt(max(given["Iz"] / m - xg**2, 0.0)),
        **{own: given[key] for key, own in masses.items()},
    )
    values = {own: _port(own) * given[key] for key, own in names.items()}
    return ShipModel(
        name, "abkowitz", particulars, SteeringGear(**gear, time_constant=1.0), values
    )


def _name(name: str) -> str:
    return MIRRORED.get(name, name.replace("_", ""))


def _port(name: str) -> float:
    """What turns the sign of the rudder in a coefficient."""
    return (-1.0) ** name.partition("_")[2].count("d")


def _roll_name(name: str) -> str:
    """Of a coefficient of the container ship: heel is f here and phi there."""
    force, _, indices = name.partition("_")
    if force in "XYKN" and indices:
        return force + indices.replace("f", "phi")
    return RENAMED.get(name, name.replace("_", ""))
