"""What the wind does to a ship in her trials: accelerations by measured wind, or constant ones by trial."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from identification.regression.samples import Samples
from shipgym import InputError, Particulars, Trial
from shipgym.checks import check_flag, check_keys
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.sea.wind_coefficients import WindTable
from shipgym.ships.inertia import particulars_inertia
from shipgym.ships.mmg import MMG
from shipgym.ships.simulate import WIND
from shipgym.trials.navigation import rotate_to_body

# share of a constant that no term explains, below which the structure has one itself
COLLINEAR = 1e-6


def measured_wind(
    trial: Trial, particulars: Particulars, option: str | Mapping[str, Any]
) -> Trial:
    """The trial with the accelerations by the wind of its columns; itself where it has none.

    `option`: coefficients as in `shipgym.sea.Wind`, or a table of ``coefficients``, by
    name or a table themselves, and ``relative``: whether speed and direction are those
    felt on board, the latter from the bow. Velocities through the water are completed
    by a current in columns.
    """
    table = dict(option) if isinstance(option, Mapping) else {"coefficients": option}
    check_keys(table, ("coefficients", "relative"), "wind")
    if not {"wind_speed", "wind_from", "psi", "u", "v"} <= trial.channels.keys():
        return trial
    named = table.get("coefficients", "auto")
    named = (
        WindTable.from_dict(named, "wind coefficients")
        if isinstance(named, Mapping)
        else named
    )
    curves = wind_curves(particulars, "blendermann" if named == "auto" else named)
    speed, angle = trial["wind_speed"], trial["wind_from"]
    # where it comes from, north and east, or ahead and aside
    air = speed * np.cos(angle), speed * np.sin(angle)
    if not check_flag(table.get("relative", False), "wind relative"):
        if (
            not trial.over_ground
            and {"current_north", "current_east"} <= trial.channels.keys()
        ):
            air = air[0] + trial["current_north"], air[1] + trial["current_east"]
        ahead, aside = rotate_to_body(*air, trial["psi"])
        air = ahead + trial["u"], aside + trial["v"]
    pressure, angle = (
        0.5 * AIR_DENSITY * (air[0] ** 2 + air[1] ** 2),
        np.arctan2(air[1], air[0]),
    )
    rows = (
        np.interp(angle, curves.angle, row, period=2.0 * np.pi)
        for row in (curves.X, curves.Y, curves.N)
    )
    forces = pressure * np.array([*rows])
    forces[0] -= 0.5 * AIR_DENSITY * curves.X[0] * trial["u"] ** 2  # hers in still air
    found = np.linalg.solve(particulars_inertia(particulars.completed())[:, :3], forces)
    return trial.with_channels(dict(zip(WIND.values(), found, strict=True)))


def constant_wind(
    trials: Sequence[Trial], samples: Samples, structure: str
) -> dict[str, dict[str, float]]:
    """The constant sway and yaw acceleration that the regression of each trial asks for, by its name.

    A constant of the structure's own takes their mean. The MMG form has no regression:
    InputError.
    """
    if structure == MMG:
        raise InputError(
            "wind: 'constant' found with structure 'mmg', expected a structure that is"
            " linear in its coefficients, or columns wind_speed and wind_from"
        )
    own = (samples.trial[:, None] == np.arange(len(trials))) * samples.duration[:, None]
    found: dict[str, dict[str, float]] = {trial.name: {} for trial in trials}
    for q in [q for q in "vr" if q in samples.targets]:
        known = samples.features[q]
        values = np.linalg.lstsq(np.hstack([known, own]), samples.targets[q])[0][
            known.shape[1] :
        ]
        left = samples.duration - known @ np.linalg.lstsq(known, samples.duration)[0]
        if np.linalg.norm(left) < COLLINEAR * np.linalg.norm(samples.duration):
            values = values - values.mean()
        for trial, value in zip(trials, values.tolist(), strict=True):
            found[trial.name][WIND[q]] = value
    return found


def with_constant_wind(
    trial: Trial, constants: Mapping[str, Mapping[str, float]]
) -> Trial:
    """The trial with its constants of all, by name; itself where it has none."""
    own = {
        name: np.full(len(trial), value)
        for name, value in constants.get(trial.name, {}).items()
    }
    return trial.with_channels(own) if own else trial
