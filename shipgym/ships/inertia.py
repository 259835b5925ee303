"""Mass and added mass that belong to a ship's accelerations, so that these can be turned into forces."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.particulars import Particulars
from shipgym.ships.shared_structure import SharedStructure
from shipgym.ships.term_table import inertia as prime_inertia


def inertia(model: ManoeuvringModel, water_depth: float = np.inf) -> Floats:
    """Mass and added mass with which the model's equations divide its forces, shape (3, 4), SI units.

    From the accelerations in surge, sway, yaw and roll to surge force, sway force and
    yaw moment about midship. A reference ship has them in its own numbers (the tanker's
    grow in shallow water, depth in m), an identified structure in its particulars,
    estimated where absent. Raises InputError if these do not tell the mass.
    """
    own = {"container": _container, "kvlcc2": _mmg, "mmg": _mmg}
    if model.structure == "tanker":
        return _tanker(model, water_depth)
    return own.get(model.structure, _particulars)(model)


def rigid_inertia(model: ManoeuvringModel) -> tuple[float, float, float]:
    """Mass, kg, static moment, kg m, and yaw inertia, kg m2, of the ship alone, about midship."""
    numbers = model.coefficients
    if model.structure == "container":
        unit = _prime_mass(model)
        return (
            numbers["m"] * unit,
            0.0,
            numbers["Iz"] * unit * model.particulars["length"] ** 2,
        )
    if model.structure == "kvlcc2":
        mass = model.particulars["water_density"] * numbers["volume"]
        gyradius, xg = 0.25 * numbers["L"], numbers["xG"]
        return mass, mass * xg, mass * (gyradius**2 + xg**2)
    p = model.particulars.completed()
    mass, xg = p.require("mass"), p.require("xg")
    return mass, mass * xg, mass * (p.require("yaw_gyradius") ** 2 + xg**2)


def _prime_mass(model: ManoeuvringModel) -> float:
    """Unit of mass in the prime system, kg."""
    p = model.particulars.completed()
    return float(0.5 * p.require("water_density") * p.length**3)


def _particulars(model: ManoeuvringModel) -> Floats:
    p, table = model.particulars.completed(), model.dynamics
    if isinstance(table, SharedStructure):
        return _prime_mass(model) * _with_arms(table.inertia(model.coefficients, p), p)
    return particulars_inertia(p)


def particulars_inertia(p: Particulars) -> Floats:
    """The same, by the particulars of a ship, which are complete; nothing in roll."""
    return (
        0.5 * p.require("water_density") * p.length**3 * _with_arms(prime_inertia(p), p)
    )


def _with_arms(prime: Floats, p: Particulars) -> Floats:
    """A matrix of the prime system by its ship lengths, and nothing in roll."""
    arms = np.array([1.0, 1.0, p.length])
    return np.hstack([prime * arms * arms[:, None], np.zeros((3, 1))])


def _container(model: ManoeuvringModel) -> Floats:
    """Son & Nomoto 1981; the added mass in sway acts above the centre, so that roll couples to sway."""
    c, L = model.coefficients, model.particulars["length"]
    yaw = c["my"] * c["alpha_y"] * L
    prime = [
        [c["m"] + c["mx"], 0.0, 0.0, 0.0],
        [0.0, c["m"] + c["my"], yaw, -c["my"] * c["ly"] * L],
        [0.0, yaw, (c["Iz"] + c["Jz"]) * L * L, 0.0],
    ]
    return _prime_mass(model) * np.array(prime)


def _mmg(model: ManoeuvringModel) -> Floats:
    """Yasukawa & Yoshimura 2015, equations 6 and 7."""
    c, p = model.coefficients, model.particulars
    length, draught = c.get("L", p.length), c.get("d", p.draught)
    added = (
        0.5 * p.require("water_density") * length**2 * (draught or p.require("draught"))
    )
    mass, static, yaw = rigid_inertia(model)
    rows = [
        [mass + c["mx"] * added, 0.0, 0.0, 0.0],
        [0.0, mass + c["my"] * added, static, 0.0],
        [0.0, static, yaw + c["Jz"] * added * length**2, 0.0],
    ]
    return np.array(rows)


def _tanker(model: ManoeuvringModel, water_depth: float) -> Floats:
    """Van Berlekom & Goddard 1972, bis system: by the ship's mass, its yaw inertia by mass and length^2."""
    c, p = model.coefficients, model.particulars
    shallow = (
        0.0 if np.isposinf(water_depth) else p["draught"] / (water_depth - p["draught"])
    )
    masses = [c["m11"] - c["X_udotz"] * shallow, c["m22"] - c["Y_vdotz"] * shallow]
    yaw = (c["m33"] - c["N_rdotz"] * shallow) * p["length"] ** 2
    return float(p["mass"]) * np.diag([*masses, yaw, 0.0])[:3]
