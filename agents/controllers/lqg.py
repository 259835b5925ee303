"""LQG autopilot: LQ feedback of what a Kalman filter makes of noisy heading and yaw rate.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 11.3
(Kalman filter and wave model for heading autopilots) and 13.1 (separation); Anderson &
Moore 1990, Optimal Control, chapter 8.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from agents.controllers.controller import Controller, Range
from agents.controllers.linear_loop import (
    ERROR,
    RUDDER,
    SIGNALS,
    YAW_RATE,
    Compensator,
    check_stable,
    sample_ship,
    sampled_ships,
)
from agents.controllers.lq import LQ, Weights
from agents.controllers.memory import Flags, Floats, heading_error
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.ships.linear import StraightRunning, linearise
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.trials.sensors import SEA_TRIAL

OUTPUTS = (YAW_RATE, ERROR)  # measured, columns of the first three states
STATES = (3, 5)  # how many: sway, yaw rate and heading error; in waves two more
COURSE_NOISE = np.radians(
    0.02
)  # how much the course to steer may move between two measurements, rad
NEW_COURSE = np.radians(
    1.0
)  # least jump of the heading error that is a new course, rad
GATE = 6.0  # such a jump in standard deviations of what noise explains
WAVE_DAMPING = 0.1  # of the model of first-order motion (Fossen 2011, 8.2.6)


@dataclass(frozen=True, eq=False, kw_only=True)
class LQG(Controller):
    """LQ feedback of estimated motions: a stationary Kalman filter on noisy heading and yaw rate.

    The measured sway speed is not used. The filter's states are sway, yaw rate and
    heading error and, where a wave period is given, heading and rate of the first-order
    motion, which is not answered with rudder. Its input is the measured rudder, so
    limits of the steering gear do not mislead it. A jump of the heading error that
    neither noise nor the ship can make is taken as a new course.

    Attributes
    ----------
    transition : array of shape (n_states, n_states)
        From one measurement to the next.
    input : array of shape (n_states,)
        Effect of the mean rudder in between.
    kalman : array of shape (n_states, 2)
        Gain on the innovations of yaw rate and heading error, estimate at the time of
        the measurement.
    output : array of shape (2, n_states)
        What is measured of the states.
    """

    kind: ClassVar[str] = "lqg"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = LQ.feedback
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {
        "transition": ("states", "states"),
        "input": ("states",),
        "kalman": ("states", len(OUTPUTS)),
        "output": (len(OUTPUTS), "states"),
    }
    reads: ClassVar[tuple[str, ...]] = ("yaw_rate", "rudder")
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges,
        "new_course_rad": Range(1e-6, 1e6),
    }

    transition: Floats
    input: Floats
    kalman: Floats
    output: Floats

    def __post_init__(self) -> None:
        if len(self.input) not in STATES:
            raise InputError(
                f"arrays.input: {len(self.input)} states found, expected one of"
                f" {STATES}"
            )
        trusted = np.eye(len(self.input)) - self.kalman @ self.output
        check_stable(
            trusted @ self.transition, "arrays: transition of the Kalman filter"
        )

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
        noise: float = 1.0,
        disturbance_deg: float = 2.0,
        wave_period: float | None = None,
        wave_heading_deg: float = 1.0,
    ) -> Self:
        """Design on a model, about straight running: LQ's gains and a Kalman filter (`control.dlqe`).

        Raises InputError if the model has no straight course, or an argument is out of
        its range.

        Parameters
        ----------
        model, dt, integral_lengths, rudder_weight, rate_weight_s2
            As in `LQ.from_model`.
        noise : float
            Of heading and yaw rate, in multiples of a sea trial's sensors
            (`SEA_TRIAL`).
        disturbance_deg : float
            How much the sea pushes the ship: standard deviation of a rudder angle,
            drawn anew each interval, that would do the same. More makes the filter
            trust what is measured.
        wave_period : float, optional
            Of the first-order motion, s, as it is met; by default it is not modelled.
        wave_heading_deg : float
            Standard deviation of the heading in it, degrees.
        """
        from scipy.linalg import block_diag

        check_number(noise, "noise", above=0.0)
        check_number(disturbance_deg, "disturbance_deg", above=0.0)
        weights = Weights.of(model, dt, integral_lengths, rudder_weight, rate_weight_s2)
        ship, interval = sample_ship(model, weights.dt), weights.dt
        transition, effect = rudder_response(model, ship.about, interval)
        pushed = np.radians(disturbance_deg) * effect  # by the sea
        pushed[2] = np.hypot(pushed[2], COURSE_NOISE)
        process, output = np.diag(pushed**2), np.eye(3)[list(OUTPUTS)]
        if wave_period is not None:
            check_number(
                wave_period,
                "wave_period",
                above=2.0 * interval,
                hint="two control intervals, in s",
            )
            motion, drive = wave_model(
                wave_period, np.radians(wave_heading_deg), interval
            )
            transition, process = (
                block_diag(transition, motion),
                block_diag(process, drive),
            )
            effect = np.append(effect, [0.0, 0.0])
            output = np.hstack([output, [[0.0, 1.0], [-1.0, 0.0]]])
        deviation = noise * np.array([SEA_TRIAL["r"].noise, SEA_TRIAL["psi"].noise])
        kalman, deviations = kalman_gain(
            transition, process, output, np.diag(deviation**2)
        )
        design = weights.design | {
            "noise": float(noise),
            "disturbance_deg": float(disturbance_deg),
            "new_course_rad": max(NEW_COURSE, GATE * deviations[1]),
            **({} if wave_period is None else {"wave_period": float(wave_period)}),
        }
        filters = {
            "transition": transition,
            "input": effect,
            "kalman": kalman,
            "output": output,
        }
        return cls.designed(
            model, ship, weights.gains(ship, model.travel_time), design, **filters
        )

    @property
    def memory_size(self) -> int:
        """The estimate, and the rudder at the last measurement."""
        return len(self.input) + 1

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """Correct the estimate by what is seen and feed it back."""
        rudder = seen["rudder"] - self.neutral_rudder
        measured = np.stack([seen["yaw_rate"], heading_error(seen)], axis=-1)
        estimate, before = memory[:, :-1], np.where(begins, rudder, memory[:, -1])
        expected = (
            _times(estimate, self.transition.T)
            + 0.5 * (before + rudder)[:, None] * self.input
        )
        expected[begins] = 0.0
        expected[begins, 1:3] = measured[begins]
        innovation = measured - _times(expected, self.output.T)
        innovation[:, 1] = wrapped(innovation[:, 1])
        jump = np.where(
            np.abs(innovation[:, 1]) > self.design["new_course_rad"],
            innovation[:, 1],
            0.0,
        )
        expected[:, ERROR] += jump
        innovation[:, 1] -= jump
        estimate = expected + _times(innovation, self.kalman.T)
        estimate[:, ERROR] = wrapped(estimate[:, ERROR])
        order = self.neutral_rudder + self.gains["rudder"] * rudder
        order = (
            order
            + self.gains["heading_error_integral"] * seen["heading_error_integral"]
        )
        for column, signal in enumerate(SIGNALS[: ERROR + 1]):
            order = order + self.gains[signal] * estimate[:, column]
        return order, np.column_stack([estimate, rudder])

    def loop(self) -> Compensator:
        """Filter and feedback together; the course does not jump."""
        return self.linearised()


def rudder_response(
    model: ShipModel, about: StraightRunning, dt: float
) -> tuple[Floats, Floats]:
    """Sway, yaw rate and heading error with the rudder held over an interval of `dt`, s.

    Returns their transition, shape (3, 3), and the effect of the rudder angle, per rad,
    shape (3,).
    """
    A, B = sampled_ships(np.column_stack(linearise(model, about))[None], 0.0, dt)
    return A[0, :RUDDER, :RUDDER], B[0, :RUDDER]


def wave_model(period: float, deviation: float, dt: float) -> tuple[Floats, Floats]:
    """First-order heading in waves as a lightly damped oscillator driven by noise (Fossen 2011, 8.2.6).

    `period`: s; `deviation`: standard deviation of the heading, rad; `dt`: interval, s.
    Returns `transition`: of heading and its rate, shape (2, 2); `covariance`: of what
    drives them in an interval, which keeps the deviation as it is, shape (2, 2).
    """
    from scipy.linalg import expm

    check_number(deviation, "wave_heading_deg", above=0.0)
    frequency = 2.0 * np.pi / period
    motion = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * WAVE_DAMPING * frequency]])
    transition: Floats = np.asarray(expm(motion * dt), dtype=np.float64)
    steady = deviation**2 * np.diag([1.0, frequency**2])
    return transition, steady - transition @ steady @ transition.T


def kalman_gain(
    transition: Floats, process: Floats, output: Floats, noise: Floats
) -> tuple[Floats, Floats]:
    """Stationary Kalman gain on the innovation, for the estimate at the time of the measurement.

    `transition`: shape (n, n); `process`: covariance of what disturbs the states in an
    interval; `output`: shape (m, n); `noise`: covariance of the measurements' noise.
    Returns `gain`, shape (n, m), which is that of `control.dlqe` times the inverse
    transition, and the standard deviation of the innovations.
    """
    import control

    _, covariance, _ = control.dlqe(
        transition, np.eye(len(transition)), output, process, noise
    )
    innovation = output @ covariance @ output.T + noise
    gain: Floats = np.linalg.solve(innovation, output @ covariance).T
    return gain, np.sqrt(np.diag(innovation))


def _times(rows: Floats, matrix: Floats) -> Floats:
    """Matrix product whose rows do not depend on how many there are."""
    return np.asarray(np.einsum("ij,jk->ik", rows, matrix))
