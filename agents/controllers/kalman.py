"""Kalman filter for the course: its model and its stationary gain.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 11.3.
"""

from typing import NamedTuple

import numpy as np

from agents.controllers.linear_loop import ERROR, RUDDER, YAW_RATE, sampled
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.instruments.noise import SEA_TRIAL
from shipgym.models.linear import small_motions

MOTIONS = slice(RUDDER)  # sway, yaw rate and heading error
#: Yaw rate and heading error as they are measured of them.
OUTPUT = np.eye(RUDDER)[[YAW_RATE, ERROR]]


class KalmanFilter(NamedTuple):
    """Model of a ship from one measurement to the next, for a Kalman filter."""

    transition: Floats  # of sway, yaw rate and heading error, shape (3, 3)
    effect: Floats  # of the mean rudder in between, per rad, shape (3,)
    process: Floats  # covariance of what disturbs them in an interval, shape (3, 3)


def course_filter(model: ShipModel, dt: float, disturbance: float) -> KalmanFilter:
    """Filter of sway, yaw rate and heading error.

    Parameters
    ----------
    model : ShipModel
    dt : float
        Between two measurements, s.
    disturbance : float
        By the sea: standard deviation of a rudder angle that would do the same, rad.
    """
    _, *linear = small_motions(model)
    A, B = sampled(np.column_stack(linear), lag=0.0, dt=dt)
    effect = B[MOTIONS]
    pushed = disturbance * effect
    # how much the course to steer may move between two measurements, rad
    course_noise = np.radians(0.02)
    pushed[ERROR] = np.hypot(pushed[ERROR], course_noise)
    return KalmanFilter(A[MOTIONS, MOTIONS], effect, np.diag(pushed**2))


def kalman_gain(states: KalmanFilter, noise: float) -> tuple[Floats, Floats]:
    """Stationary Kalman gain for the estimate at the time of the measurement.

    Parameters
    ----------
    states : KalmanFilter
    noise : float
        Of the measurements, in multiples of a sea trial's sensors.

    Returns
    -------
    gain : array of shape (3, 2)
        That of `control.dlqe` times the inverse transition.
    deviations : array of shape (2,)
        Standard deviations of the innovations.
    """
    import control

    sensors = np.array([SEA_TRIAL["yaw_rate"], SEA_TRIAL["heading"]])
    measured = noise * sensors
    of_noise = np.diag(measured**2)
    disturbed = np.eye(RUDDER)  # each state by its own disturbance
    _, covariance, _ = control.dlqe(
        states.transition,
        disturbed,
        OUTPUT,
        states.process,
        of_noise,
    )
    of_output = OUTPUT @ covariance
    innovation = of_output @ OUTPUT.T + of_noise
    solved = np.linalg.solve(innovation, of_output)
    gain = solved.T
    variances = np.diag(innovation)
    deviations = np.sqrt(variances)
    return gain, deviations
