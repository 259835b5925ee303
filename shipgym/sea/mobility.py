"""Inverse of a ship's inertia, which makes accelerations of the forces of weather."""

from collections.abc import Collection

import numpy as np

from shipgym.arrays import Floats
from shipgym.constants import GRAVITY
from shipgym.errors import InputError
from shipgym.sea.estimates import weather_particulars
from shipgym.ships.inertia import inertia
from shipgym.ships.manoeuvring_model import ManoeuvringModel
from shipgym.ships.term_table import Structure


def mobility_matrix(model: ManoeuvringModel, water_depth: float = np.inf) -> Floats:
    """Inverse of mass and added mass, SI units, shape (4, 4).

    From X, Y, N, K it makes accelerations in surge, sway, yaw and roll. An identified
    model divides by the inertia of its particulars, given or estimated, a reference
    ship by that of its own equations (the tanker's depends on the depth, m). A
    structure without an equation of surge keeps its speed, one without sway or yaw does
    not drift or turn: their rows and columns are 0. So is roll where the model has
    none; a structure with an equation of roll, or a ship of the user's that rolls, has
    the inertia that follows from roll period and metacentric height. Raises InputError
    that names what mass and added mass lack.
    """
    axes = _axes(model)
    try:
        mass = inertia(model, water_depth)
    except InputError as error:
        raise InputError(f"weather without the particulars it needs: {error}") from None
    if 3 in axes and mass[3, 3] == 0.0:
        mass[3, 3] = roll_inertia(model)

    matrix = np.zeros((4, 4))
    among = np.ix_(axes, axes)
    matrix[among] = np.linalg.inv(mass[among])
    return matrix


def _axes(model: ManoeuvringModel) -> list[int]:
    """Axes in which a model moves: 0 surge, 1 sway, 2 yaw, 3 roll."""
    velocities = ("u", "v", "r", "p")
    moving: Collection[str] = model.state_names
    if isinstance(model.dynamics, Structure):
        weather_particulars(model.particulars)  # raises for those that are missing
        moving = model.dynamics.equations
    return [axis for axis, name in enumerate(velocities) if name in moving]


def roll_stiffness(model: ManoeuvringModel) -> float:
    """Righting moment by heel, m g GM, N m."""
    ship = weather_particulars(model.particulars)
    return ship.require("mass") * GRAVITY * ship.require("metacentric_height")


def roll_inertia(model: ManoeuvringModel) -> float:
    """Inertia in roll with that of the water, m g GM (T / 2 pi)^2, kg m2."""
    ship = weather_particulars(model.particulars)
    return roll_stiffness(model) * (ship.require("roll_period") / (2.0 * np.pi)) ** 2
