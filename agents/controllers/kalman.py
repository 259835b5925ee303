"""Kalman filter for the course: its models and its stationary gain.

Source: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 8.2.6
(wave model) and 11.3 (Kalman filter).
"""

from dataclasses import dataclass

import numpy as np

from agents.controllers.linear_loop import ERROR, RUDDER, YAW_RATE, sampled
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.instruments.noise import SEA_TRIAL
from shipgym.models.linear import StraightRunning, linearise


@dataclass(frozen=True, eq=False)
class KalmanFilter:
    """Model of a ship from one measurement to the next, for a Kalman filter.

    Attributes
    ----------
    transition : array of shape (n, n)
    effect : array of shape (n,)
        Of the mean rudder in between, per rad.
    process : array of shape (n, n)
        Covariance of what disturbs the states in an interval.
    output : array of shape (2, n)
        Yaw rate and heading error as they are measured of the states.
    """

    transition: Floats
    effect: Floats
    process: Floats
    output: Floats


def course_filter(
    model: ShipModel, about: StraightRunning, dt: float, disturbance: float
) -> KalmanFilter:
    """Filter of sway, yaw rate and heading error.

    Parameters
    ----------
    model : ShipModel
    about : StraightRunning
        The state about which motions are small.
    dt : float
        Between two measurements, s.
    disturbance : float
        By the sea: standard deviation of a rudder angle that would do the same, rad.
    """
    transition, effect = rudder_response(model, about, dt)
    pushed = disturbance * effect
    # how much the course to steer may move between two measurements, rad
    course_noise = np.radians(0.02)
    pushed[ERROR] = np.hypot(pushed[ERROR], course_noise)
    states = np.eye(len(effect))
    return KalmanFilter(
        transition=transition,
        effect=effect,
        process=np.diag(pushed**2),
        output=states[[YAW_RATE, ERROR]],
    )


def with_waves(
    course: KalmanFilter, period: float, deviation: float, dt: float
) -> KalmanFilter:
    """Filter with heading and yaw rate of the first-order motion as further states.

    `period`: s; `deviation`: standard deviation of the heading, rad; `dt`: s.
    """
    from scipy.linalg import block_diag

    motion, drive = wave_model(period, deviation, dt)
    # the yaw rate is measured with that of the wave, the heading error less its heading
    of_wave = np.array([[0.0, 1.0], [-1.0, 0.0]])
    return KalmanFilter(
        transition=block_diag(course.transition, motion),
        effect=np.append(course.effect, [0.0, 0.0]),
        process=block_diag(course.process, drive),
        output=np.hstack([course.output, of_wave]),
    )


def rudder_response(
    model: ShipModel, about: StraightRunning, dt: float
) -> tuple[Floats, Floats]:
    """Sway, yaw rate and heading error with the rudder held over an interval.

    `dt`: length of the interval, s. Returns their transition, shape (3, 3), and the
    effect of the rudder angle, per rad, shape (3,).
    """
    linear = np.column_stack(linearise(model, about))
    A, B = sampled(linear, lag=0.0, dt=dt)
    motions = slice(RUDDER)  # without rudder and integral
    transition = A[motions, motions]
    return transition, B[motions]


def wave_model(period: float, deviation: float, dt: float) -> tuple[Floats, Floats]:
    """First-order heading in waves as a lightly damped oscillator driven by noise.

    Source: Fossen 2011, 8.2.6.

    Parameters
    ----------
    period : float
        s.
    deviation : float
        Standard deviation of the heading, rad.
    dt : float
        Interval, s.

    Returns
    -------
    transition : array of shape (2, 2)
        Of heading and its rate.
    covariance : array of shape (2, 2)
        Of what drives them in an interval, which keeps the deviation as it is.
    """
    from scipy.linalg import expm

    frequency = 2.0 * np.pi / period
    spring = frequency**2
    wave_damping = 0.1  # of the model of first-order motion
    damping = 2.0 * wave_damping * frequency
    flow = np.array(
        [
            [0.0, 1.0],
            [-spring, -damping],
        ]
    )
    transition: Floats = np.asarray(expm(flow * dt), dtype=np.float64)

    variances = [1.0, spring]  # of heading and rate, by that of the heading
    steady = deviation**2 * np.diag(variances)
    left = transition @ steady @ transition.T
    driven = steady - left
    return transition, driven


def kalman_gain(states: KalmanFilter, noise: float) -> tuple[Floats, Floats]:
    """Stationary Kalman gain for the estimate at the time of the measurement.

    Parameters
    ----------
    states : KalmanFilter
    noise : float
        Of the measurements, in multiples of a sea trial's sensors.

    Returns
    -------
    gain : array of shape (n, m)
        That of `control.dlqe` times the inverse transition.
    deviations : array of shape (m,)
        Standard deviations of the innovations.
    """
    import control

    sensors = np.array([SEA_TRIAL["yaw_rate"], SEA_TRIAL["heading"]])
    measured = noise * sensors
    of_noise = np.diag(measured**2)
    n = len(states.transition)
    disturbed = np.eye(n)  # each state by its own disturbance
    _, covariance, _ = control.dlqe(
        states.transition,
        disturbed,
        states.output,
        states.process,
        of_noise,
    )
    output = states.output
    of_output = output @ covariance
    innovation = of_output @ output.T + of_noise
    solved = np.linalg.solve(innovation, of_output)
    gain: Floats = solved.T
    variances = np.diag(innovation)
    deviations = np.sqrt(variances)
    return gain, deviations
