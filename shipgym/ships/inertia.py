"""Mass and added mass that turn a ship's accelerations into forces."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.particulars import Particulars, prime_inertia, total_inertia
from shipgym.ships.term_table import Structure


def inertia(model: ManoeuvringModel, water_depth: float = np.inf) -> Floats:
    """Mass and added mass by which a model divides its forces, shape (4, 4), SI units.

    From the accelerations in surge, sway, yaw and roll to surge force, sway force, yaw
    moment about midship and roll moment, which only the container ship has. A
    reference ship has them in its own numbers (the tanker's grow in shallow water,
    depth in m), an identified structure in its particulars, estimated where absent.
    Raises InputError if these do not tell the mass.
    """
    if model.structure == "container":
        return _container(model)
    if model.structure == "tanker":
        return _tanker(model, water_depth)
    if model.structure == "mmg":
        return _mmg(model)

    p = model.particulars.completed()
    if isinstance(model.dynamics, Structure):
        prime = model.dynamics.prime_inertia(model.coefficients, p)
        return _in_si(prime, p)
    return particulars_inertia(p)


def _mass_unit(p: Particulars) -> float:
    """Unit of mass in the prime system, kg."""
    return 0.5 * p.require("water_density") * p.length**3


def particulars_inertia(p: Particulars) -> Floats:
    """Mass and added mass by complete particulars, nothing in roll; as `inertia`."""
    return _in_si(prime_inertia(p), p)


def _in_si(prime: Floats, p: Particulars) -> Floats:
    """Matrix of the prime system in SI units, and nothing in roll."""
    arms = np.array([1.0, 1.0, p.length])
    return _mass_unit(p) * np.pad(prime * arms * arms[:, None], (0, 1))


def _container(model: ManoeuvringModel) -> Floats:
    """Son & Nomoto 1981; the added mass in sway acts above the centre (roll)."""
    c = model.coefficients
    p = model.particulars.completed()
    mass = particulars_inertia(p)
    unit = _mass_unit(p)
    mass[1, 3] = mass[3, 1] = -c["my"] * c["ly"] * p.length * unit
    mass[3, 3] = (c["Ix"] + c["Jx"]) * p.length**2 * unit
    return mass


def _mmg(model: ManoeuvringModel) -> Floats:
    """Yasukawa & Yoshimura 2015: by rho L^2 d / 2, yaw inertia by rho L^4 d / 2."""
    c = model.coefficients
    p = model.particulars.completed()
    slender = p.require("draught") / p.length
    added = [
        c["mx"],
        c["my"],
        c["Jz"],
    ]
    derivatives = -slender * np.diag(added)
    problem = "added masses mx, my, Jz: expected a positive inertia, got none"
    prime = total_inertia(p, derivatives, problem)
    return _in_si(prime, p)


def _tanker(model: ManoeuvringModel, water_depth: float) -> Floats:
    """Van Berlekom & Goddard 1972, bis system: by mass, and by mass length^2."""
    c = model.coefficients
    p = model.particulars
    T = p["draught"]
    z = 0.0 if np.isposinf(water_depth) else T / (water_depth - T)
    surge = c["m11"] - c["X_udotz"] * z
    sway = c["m22"] - c["Y_vdotz"] * z
    yaw = (c["m33"] - c["N_rdotz"] * z) * p["length"] ** 2
    return float(p["mass"]) * np.diag([surge, sway, yaw, 0.0])
