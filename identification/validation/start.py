"""The state at which a prediction starts, where the record has velocities only as derivatives."""

import numpy as np

from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.ships.simulate import open_loop

WINDOW = 1.5  # time over which the start is estimated, of that to sail one ship length
ROUNDS = 3  # of Gauss-Newton; what is simulated is nearly linear in its start
STEP = 1e-4  # of finite differences, by U0 and U0 / L
#: Errors that count as one at least: heading, rad, track by ship length, velocities by
#: U0.
FLOORS = {"psi": np.radians(0.1), "x": 0.005, "y": 0.005, "u": 0.02, "v": 0.02}


def with_start(model: ShipModel, trial: Trial) -> Trial:
    """The trial with the first surge speed, sway speed and yaw rate estimated, as far as they were derived.

    At the end of a record a derivative is least certain, the more so as the rudder
    moves there. Instead the start is that from which the model comes nearest to the
    measured heading and track (velocities where there is no track) over the first 1.5
    ship lengths (output error with the initial state among the unknowns, Maine & Iliff
    1985, NASA RP-1138). A trial whose velocities were measured stays as it is.
    """
    names = [
        name for name in "uvr" if name in trial.derived and name in model.state_names
    ]
    length, speed = model.particulars["length"], model.particulars["speed"]
    rows = trial.t <= trial.t[0] + WINDOW * length / speed
    if not names or "psi" not in trial or np.sum(rows) < 3:
        return trial
    units = np.array([speed / length if name == "r" else speed for name in names])
    track = "xy" if {"x", "y"} <= trial.channels.keys() - trial.derived else "uv"
    floors = np.array(
        [[FLOORS[name] * (length if name in "xy" else 1.0)] for name in track]
    )
    floors = np.vstack([[[FLOORS["psi"]]], floors * (speed if track == "uv" else 1.0)])
    channels = ["psi", *track]
    opening = Trial(
        trial.t[rows], {name: values[rows] for name, values in trial.channels.items()}
    )
    start, scales = np.array([trial[name][0] for name in names]), floors

    def errors(start: Floats) -> Floats:
        run = open_loop(model, _begun(opening, names, start))
        return np.array([run[name] - opening[name] for name in channels])[:, 1:]

    try:
        for _ in range(ROUNDS):
            error = errors(start)
            moved = [errors(start + step) - error for step in np.diag(STEP * units)]
            slopes = np.array([(move / scales).ravel() for move in moved]).T / STEP
            start = (
                start
                - units
                * np.linalg.lstsq(slopes, (error / scales).ravel(), rcond=1e-6)[0]
            )
            scales = np.maximum(
                np.sqrt(np.mean(errors(start) ** 2, axis=1, keepdims=True)), floors
            )
    except UnstableModelError:
        return trial
    return _begun(trial, names, start)


def _begun(trial: Trial, names: list[str], start: Floats) -> Trial:
    """The trial with other first samples of some channels."""
    first = {
        name: np.append(value, trial[name][1:])
        for name, value in zip(names, start, strict=True)
    }
    return trial.with_channels(first)
