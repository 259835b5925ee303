"""Velocities of a ship over ground and through the water, which a current parts."""

from typing import Any

import numpy as np

from shipgym import Trial
from shipgym.arrays import Floats, integral
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import rotate_to_body

#: Probability of a current as large by chance below which it differs from zero.
SIGNIFICANT = 0.01
CURRENT_COLUMNS = ("current_north", "current_east")


def over_ground(trial: Trial) -> tuple[Floats, Floats]:
    """Velocity of midship over ground, ahead and to starboard, m/s.

    The trial has velocities over ground, or one of them derived from its track.
    """
    derived = {"u", "v"} & trial.derived
    if len(derived) != 1:
        return trial["u"], trial["v"]

    # the other one was logged, and is through the water
    north = time_derivative(trial.t, trial["x"])
    east = time_derivative(trial.t, trial["y"])
    return rotate_to_body(north, east, trial["psi"])


def through_water(trial: Trial, north: Any, east: Any) -> Trial:
    """The trial without a current, m/s, each a number or of shape (n_samples,).

    Its track starts where it did; velocities over ground, but for one logged, become
    those through the water.
    """
    t = trial.t
    north = np.full(len(t), north, dtype=float)
    east = np.full(len(t), east, dtype=float)
    channels = {"current_north": north, "current_east": east}
    if "x" in trial:
        channels["x"] = trial["x"] - integral(t, north)
    if "y" in trial:
        channels["y"] = trial["y"] - integral(t, east)

    if trial.over_ground and trial.channels.keys() >= {"u", "v", "psi"}:
        ahead, aside = over_ground(trial)
        drift_ahead, drift_aside = rotate_to_body(north, east, trial["psi"])
        derived = trial.derived & {"u", "v"}
        over = derived or {"u", "v"}  # one derived alone: the other was logged
        if "u" in over:
            channels["u"] = ahead - drift_ahead
        if "v" in over:
            channels["v"] = aside - drift_aside
    still = trial.with_channels(channels)
    return still.with_(over_ground=False)
