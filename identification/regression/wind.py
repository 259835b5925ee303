"""What the wind does to a ship in her trials: accelerations by measured wind, or constant ones by trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from identification.regression.samples import Samples
from shipgym.arrays import Floats
from shipgym.checks import check_flag, check_keys
from shipgym.errors import InputError
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.sea.wind_tables import WindTable
from shipgym.ships import ShipModel, get_structure
from shipgym.ships.mmg import MMG
from shipgym.ships.particulars import Particulars
from shipgym.ships.steering import SteeringGear
from shipgym.trials.trial import Trial
from shipgym.trials.trial_import import rotate_to_body

ACCELERATIONS = ("wind_udot", "wind_vdot", "wind_rdot")
COLLINEAR = 1e-6  # share of a constant that no term explains, below which the structure has one itself


def measured_wind(trial: Trial, particulars: Particulars, option: str | Mapping[str, Any]) -> Trial:
    """The trial with the accelerations by the wind of its columns; itself where it has none.

    Parameters
    ----------
    trial : Trial
        With wind_speed and wind_from, psi, u and v; those through the water with a current in columns, if
        known.
    particulars : Particulars
        From which areas and inertia are estimated where they do not tell them.
    option : str or mapping
        Coefficients as in `shipgym.sea.Wind`, or a table of ``coefficients``, by name or as a table of them,
        and ``relative``: whether speed and direction are those felt on board, the latter from the bow.

    Raises
    ------
    InputError
        For particulars from which no areas follow, and for an option that is not known.
    """
    table = dict(option) if isinstance(option, Mapping) else {"coefficients": option}
    check_keys(table, ("coefficients", "relative"), "wind")
    if not {"wind_speed", "wind_from", "psi", "u", "v"} <= trial.channels.keys():
        return trial
    coefficients = table.get("coefficients", "auto")
    if isinstance(coefficients, Mapping):
        coefficients = WindTable.from_dict(coefficients, "wind coefficients")
    curves = wind_curves(particulars, "blendermann" if coefficients == "auto" else coefficients)
    speed, angle = trial["wind_speed"], trial["wind_from"]
    ahead, aside = speed * np.cos(angle), speed * np.sin(angle)
    if not check_flag(table.get("relative", False), "wind relative"):
        ahead, aside = rotate_to_body(ahead, aside, trial["psi"])
        ahead, aside = ahead + trial["u"], aside + trial["v"]
        if not trial.over_ground and {"current_north", "current_east"} <= trial.channels.keys():
            drift = rotate_to_body(trial["current_north"], trial["current_east"], trial["psi"])
            ahead, aside = ahead + drift[0], aside + drift[1]
    pressure, angle = 0.5 * AIR_DENSITY * (ahead**2 + aside**2), np.arctan2(aside, ahead)
    forces = [
        pressure * np.interp(angle, curves.angle, row, period=2.0 * np.pi)
        for row in (curves.X, curves.Y, curves.N)
    ]
    forces[0] = forces[0] - 0.5 * AIR_DENSITY * curves.X[0] * trial["u"] ** 2  # hers in still air
    return trial.with_channels(dict(zip(ACCELERATIONS, _mobility(particulars) @ forces, strict=True)))


def accelerations(trial: Trial) -> Floats:
    """Those in surge, sway and yaw by the wind of a trial, shape (3, n_samples)."""
    return np.array([trial[name] if name in trial else np.zeros(len(trial)) for name in ACCELERATIONS])


def _mobility(particulars: Particulars) -> Floats:
    """Inverse inertia in surge, sway and yaw, shape (3, 3)."""
    names = get_structure("abkowitz").coefficient_names
    ship = ShipModel(
        name=particulars.name,
        structure="abkowitz",
        particulars=particulars.completed(),
        steering=SteeringGear(),
        coefficients=dict.fromkeys(names, 0.0),
    )
    return mobility_matrix(ship)[:3, :3]


def constant_wind(trials: Sequence[Trial], samples: Samples, structure: str) -> dict[str, dict[str, float]]:
    """The constant sway and yaw acceleration that the regression of each trial asks for, by its name.

    `samples` are those of the trials; a constant of the structure's own takes their mean. Raises InputError
    for the MMG form, which has no regression.
    """
    if structure == MMG:
        raise InputError(
            "wind: 'constant' found with structure 'mmg', expected a structure that is linear in its "
            "coefficients, or columns wind_speed and wind_from"
        )
    own = (samples.trial[:, None] == np.arange(len(trials))) * samples.duration[:, None]
    found: dict[str, dict[str, float]] = {trial.name: {} for trial in trials}
    for q in [q for q in "vr" if q in samples.targets]:
        known = samples.features[q]
        values = np.linalg.lstsq(np.hstack([known, own]), samples.targets[q])[0][known.shape[1] :]
        left = samples.duration - known @ np.linalg.lstsq(known, samples.duration)[0]
        if np.linalg.norm(left) < COLLINEAR * np.linalg.norm(samples.duration):
            values = values - values.mean()
        for trial, value in zip(trials, values.tolist(), strict=True):
            found[trial.name][f"wind_{q}dot"] = value
    return found


def with_constant_wind(trial: Trial, constants: Mapping[str, Mapping[str, float]]) -> Trial:
    """The trial with its constants of all, by name; itself where it has none."""
    own = constants.get(trial.name)
    if own is None:
        return trial
    return trial.with_channels({name: np.full(len(trial), value) for name, value in own.items()})
