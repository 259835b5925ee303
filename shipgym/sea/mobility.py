"""Inverse inertia: how the forces of wind and waves become accelerations of a model."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.sea.estimates import GRAVITY, weather_particulars
from shipgym.ships.inertia import inertia
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.term_table import Structure

_AXES = "uvrp"


def mobility_matrix(model: ManoeuvringModel, water_depth: float = np.inf) -> Floats:
    """Inverse of mass and added mass, from X, Y, N, K to accelerations, SI units, shape (4, 4).

    The accelerations are those in surge, sway, yaw and roll. An identified model divides by the inertia of
    its particulars, given or estimated, a reference ship by that of its own equations (the tanker's depends
    on the depth, m). A structure without an equation of surge keeps its speed, one without sway or yaw does
    not drift or turn: their rows and columns are 0. So is roll where the model has none; a structure with an
    equation of roll, or a ship of the user's that rolls, has that inertia which the roll period and the
    metacentric height tell. Raises InputError that names what mass and added mass lack.
    """
    mass = np.zeros((4, 4))
    mass[:3] = _inertia(model, water_depth)
    axes = [0, 1, 2, 3] if "phi" in model.state_names else [0, 1, 2]
    if isinstance(model.dynamics, Structure):
        axes = [_AXES.index(equation) for equation in model.dynamics.equations if equation in _AXES]
    if model.structure == "container":
        mass[3] = _container_roll(model, mass)
    elif 3 in axes:
        mass[3, 3] = roll_inertia(model)
    matrix = np.zeros((4, 4))
    matrix[np.ix_(axes, axes)] = np.linalg.inv(mass[np.ix_(axes, axes)])
    return matrix


def _inertia(model: ManoeuvringModel, water_depth: float) -> Floats:
    if isinstance(model.dynamics, Structure):
        weather_particulars(model.particulars)  # says what is missing
    try:
        return inertia(model, water_depth)
    except InputError as error:
        raise InputError(f"weather without the particulars it needs: {error}") from None


def roll_inertia(model: ManoeuvringModel) -> float:
    """Inertia in roll of the ship and the water that rolls with it, kg m2: m g GM (T / 2 pi)^2."""
    ship = weather_particulars(model.particulars)
    stiffness = ship.require("mass") * GRAVITY * ship.require("metacentric_height")
    return stiffness * (ship.require("roll_period") / (2.0 * np.pi)) ** 2


def _container_roll(model: ManoeuvringModel, mass: Floats) -> Floats:
    """Row of roll in Son & Nomoto's equations, whose inertia is symmetric."""
    numbers, p = model.coefficients, model.particulars
    unit = 0.5 * p.require("water_density") * p.length**5
    return np.array([0.0, mass[1, 3], 0.0, (numbers["Ix"] + numbers["Jx"]) * unit])
