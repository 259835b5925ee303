"""Accelerations of a ship by the wind that was logged on her trials."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from identification.samples.velocities import CURRENT_COLUMNS
from shipgym import Particulars, Trial
from shipgym.arrays import Floats
from shipgym.models.simulate import WIND
from shipgym.sea.harmonics import Curves, circle
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.inertia import particulars_inertia
from shipgym.trials.navigation import rotate_to_body


def measured_wind(
    trial: Trial,
    particulars: Particulars,
    option: str | Mapping[str, Any],
) -> Trial:
    """The trial with the accelerations by the wind of its columns.

    The trial itself where it has none. Velocities through the water are completed by a
    current in columns.

    Parameters
    ----------
    trial : Trial
        With wind_speed, wind_from, psi, u and v.
    particulars : Particulars
        Of the ship.
    option : str or mapping
        Coefficients as in `shipgym.sea.Wind`, or a table of ``coefficients`` and
        ``relative``: whether speed and direction are those felt on board, the latter
        from the bow.
    """
    table = option if isinstance(option, Mapping) else {"coefficients": option}
    if not {"wind_speed", "wind_from", "psi", "u", "v"} <= trial.channels.keys():
        return trial
    coefficients = table.get("coefficients", "auto")
    if coefficients == "auto":
        coefficients = "blendermann"
    curves = wind_curves(particulars, coefficients)
    forces = _forces_on(
        trial,
        curves,
        bool(table.get("relative", False)),
    )
    inertia = particulars_inertia(particulars.completed())[:3, :3]
    accelerations = np.linalg.solve(inertia, forces)
    return trial.with_channels(dict(zip(WIND.values(), accelerations, strict=True)))


def _forces_on(trial: Trial, curves: Curves, relative: bool) -> Floats:
    """X, Y and N by the wind of a trial, shape (3, n_samples)."""
    ahead, aside = _felt_wind(trial, relative)
    forces = _forces(
        curves,
        ahead,
        aside,
    )
    # her resistance in still air is the model's own
    still_ahead, *_ = curves.X
    u = trial["u"]
    forces[0] -= 0.5 * AIR_DENSITY * still_ahead * u**2
    return forces


def _forces(curves: Curves, ahead: Floats, aside: Floats) -> Floats:
    """X, Y and N by a wind felt from ahead and starboard, shape (3, n_samples)."""
    angle = np.arctan2(aside, ahead)
    coefficients = [
        np.interp(angle, circle(), row, period=2.0 * np.pi)
        for row in (curves.X, curves.Y, curves.N)
    ]
    return 0.5 * AIR_DENSITY * (ahead**2 + aside**2) * np.array(coefficients)


def _felt_wind(trial: Trial, relative: bool) -> tuple[Floats, Floats]:
    """Wind felt on board, from ahead and from starboard, m/s."""
    speed = trial["wind_speed"]
    direction = trial["wind_from"]
    along = speed * np.cos(direction)
    across = speed * np.sin(direction)
    if relative:
        return along, across

    north = along
    east = across
    has_current = trial.channels.keys() >= set(CURRENT_COLUMNS)
    if has_current and not trial.over_ground:
        north = north + trial["current_north"]
        east = east + trial["current_east"]
    ahead, aside = rotate_to_body(north, east, trial["psi"])
    return ahead + trial["u"], aside + trial["v"]
