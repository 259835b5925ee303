"""What the wind does to a ship in her trials: accelerations by measured wind, or constant ones by trial."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from identification.regression.samples import Samples
from identification.regression.velocities import CURRENT_COLUMNS
from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Floats
from shipgym.checks import check_flag, check_keys, check_text
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.sea.wind_coefficients import WindTable
from shipgym.ships.inertia import particulars_inertia
from shipgym.ships.simulate import WIND
from shipgym.ships.structures import MMG
from shipgym.trials.navigation import rotate_to_body


def check_wind(option: Any) -> None:
    """Refuse a wind that is neither a word nor a table of coefficients."""
    if not isinstance(option, Mapping):
        check_text(option, "wind")
        return
    check_keys(option, ("coefficients", "relative"), "wind")
    check_flag(option.get("relative", False), "wind relative")


def measured_wind(
    trial: Trial, particulars: Particulars, option: str | Mapping[str, Any]
) -> Trial:
    """The trial with the accelerations by the wind of its columns; itself where it has none.

    Velocities through the water are completed by a current in columns.

    Parameters
    ----------
    trial : Trial
        With wind_speed, wind_from, psi, u and v.
    particulars : Particulars
        Of the ship.
    option : str or mapping
        Coefficients as in `shipgym.sea.Wind`, or a table of ``coefficients``, by name
        or a table themselves, and ``relative``: whether speed and direction are those
        felt on board, the latter from the bow.
    """
    check_wind(option)
    table: dict[str, Any] = {"coefficients": option}
    if isinstance(option, Mapping):
        table = dict(option)
    if not {"wind_speed", "wind_from", "psi", "u", "v"} <= trial.channels.keys():
        return trial

    named = table.get("coefficients", "auto")
    if named == "auto":
        named = "blendermann"
    if isinstance(named, Mapping):
        named = WindTable.from_dict(named, "wind coefficients")
    curves = wind_curves(particulars, named)

    ahead, aside = _felt_wind(trial, relative=table.get("relative", False))
    pressure = 0.5 * AIR_DENSITY * (ahead**2 + aside**2)
    angle = np.arctan2(aside, ahead)
    coefficients = np.array(
        [
            np.interp(angle, curves.angle, row, period=2.0 * np.pi)
            for row in (curves.X, curves.Y, curves.N)
        ]
    )
    forces = pressure * coefficients
    # her resistance in still air is the model's own
    forces[0] -= 0.5 * AIR_DENSITY * curves.X[0] * trial["u"] ** 2

    inertia = particulars_inertia(particulars.completed())[:, :3]
    accelerations = np.linalg.solve(inertia, forces)
    return trial.with_channels(dict(zip(WIND.values(), accelerations, strict=True)))


def _felt_wind(trial: Trial, relative: bool) -> tuple[Floats, Floats]:
    """Wind felt on board, from ahead and from starboard, m/s."""
    speed, angle = trial["wind_speed"], trial["wind_from"]
    if relative:
        return speed * np.cos(angle), speed * np.sin(angle)

    north, east = speed * np.cos(angle), speed * np.sin(angle)
    has_current = trial.channels.keys() >= set(CURRENT_COLUMNS)
    if has_current and not trial.over_ground:
        north = north + trial["current_north"]
        east = east + trial["current_east"]
    ahead, aside = rotate_to_body(north, east, trial["psi"])
    return ahead + trial["u"], aside + trial["v"]


def constant_wind(
    trials: Sequence[Trial], samples: Samples, structure: Any
) -> dict[str, dict[str, float]]:
    """The constant sway and yaw acceleration that the regression of each trial asks for, by its name.

    A constant of the structure's own takes their mean. The MMG form has no regression:
    InputError.
    """
    if structure == MMG:
        raise InputError(
            "wind: expected a structure that is linear in its coefficients with"
            " 'constant', or columns wind_speed and wind_from, got structure 'mmg'"
        )
    of_trial = samples.trial[:, None] == np.arange(len(trials))
    constants = of_trial * samples.duration[:, None]

    found: dict[str, dict[str, float]] = {trial.name: {} for trial in trials}
    for q in ("v", "r"):
        if q not in samples.targets:
            continue
        known = samples.features[q]
        columns = np.hstack([known, constants])
        solution = np.linalg.lstsq(columns, samples.targets[q])[0]
        values = solution[known.shape[1] :]
        if _explains(known, samples.duration):
            values = values - values.mean()
        for trial, value in zip(trials, values.tolist(), strict=True):
            found[trial.name][WIND[q]] = value
    return found


def _explains(features: Floats, target: Floats, rounding: float = 1e-6) -> bool:
    """Tell whether features explain a target but for rounding."""
    left = target - features @ np.linalg.lstsq(features, target)[0]
    return bool(np.linalg.norm(left) < rounding * np.linalg.norm(target))


def with_constant_wind(
    trial: Trial, constants: Mapping[str, Mapping[str, float]]
) -> Trial:
    """The trial with its constants of all, by name; itself where it has none."""
    own = {
        name: np.full(len(trial), value)
        for name, value in constants.get(trial.name, {}).items()
    }
    return trial.with_channels(own) if own else trial
