"""LQG autopilot: LQ feedback of a Kalman filter on noisy heading and yaw rate.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 11.3
(Kalman filter and wave model for heading autopilots) and 13.1 (separation); Anderson &
Moore 1990, Optimal Control, chapter 8.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import POSITIVE, Bounds, Controller
from agents.controllers.helm import known, logged_noise, noise_setting
from agents.controllers.kalman import OUTPUT, course_filter, kalman_gain
from agents.controllers.law import (
    HelmMemory,
    LinearFeedback,
    Number,
    Signals,
    known_rudder,
    linear_law,
    wrapped,
)
from agents.controllers.linear_loop import checked_interval, sample_ship
from agents.controllers.lq import LQ, SteeringCost
from agents.controllers.margins import check_stable
from agents.controllers.memory import from_columns
from agents.settings import Step, setting
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.engine.records import Record
from shipgym.models.by_name import takes_name

# least jump of the heading error that is a new course, rad, and the same in standard
# deviations of what noise explains
NEW_COURSE, GATE = np.radians(1.0), 6.0


class Motions(NamedTuple):
    """States of the filter, or what belongs to each of them."""

    sway: Number  # m/s
    yaw_rate: Number  # rad/s
    heading_error: Number  # rad


class Measured(NamedTuple):
    """Measurements of the filter, or what belongs to each of them."""

    yaw_rate: Number  # rad/s
    heading_error: Number  # rad


class Transition(NamedTuple):
    """Rows of the matrix from one measurement to the next."""

    sway: Motions
    yaw_rate: Motions
    heading_error: Motions


class KalmanGains(NamedTuple):
    """Rows of the gain on the innovations."""

    sway: Measured
    yaw_rate: Measured
    heading_error: Measured


class Observer(NamedTuple):
    """Parameters of `lqg_law`."""

    transition: Transition
    effect: Motions  # of the mean rudder between two measurements, per rad
    kalman: KalmanGains
    new_course: float  # rad, least jump of the heading error that is one
    feedback: LinearFeedback


class LQGMemory(NamedTuple):
    """Memory of `lqg_law`."""

    motions: Motions
    helm: HelmMemory


def lqg_law(seen: Signals, memory: LQGMemory, p: Observer) -> tuple[Number, LQGMemory]:
    """Correct the estimate by what is measured and feed it back."""
    rudder = known_rudder(seen, memory.helm, p.feedback)
    mean_rudder = 0.5 * (memory.helm.rudder + rudder)
    now = updated(seen, predicted(seen, memory, mean_rudder, p), p)
    estimated = seen._replace(
        sway=p.feedback.neutral_sway + now.sway,
        yaw_rate=now.yaw_rate,
        heading_error=now.heading_error,
    )
    order, helm = linear_law(estimated, memory.helm, p.feedback)
    return order, LQGMemory(now, helm)


def predicted(
    seen: Signals, memory: LQGMemory, mean_rudder: Number, p: Observer
) -> Motions:
    """States expected at this measurement; where an episode begins, those measured."""
    began = memory.helm.started > 0.0
    measured = Motions(0.0, seen.yaw_rate, seen.heading_error)
    expected = [
        np.where(began, product(row, memory.motions) + effect * mean_rudder, first)
        for row, effect, first in zip(p.transition, p.effect, measured, strict=True)
    ]
    return Motions(*expected)


def updated(seen: Signals, expected: Motions, p: Observer) -> Motions:
    """States expected at this measurement, corrected by it."""
    off_heading = wrapped(seen.heading_error - expected.heading_error)
    # a jump that neither noise nor the ship can make is a new course
    jump = np.where(np.abs(off_heading) > p.new_course, off_heading, 0.0)
    off_rate = seen.yaw_rate - expected.yaw_rate
    innovation = Measured(off_rate, off_heading - jump)
    states = expected._replace(heading_error=expected.heading_error + jump)
    pairs = zip(p.kalman, states, strict=True)
    now = Motions(*[state + product(row, innovation) for row, state in pairs])
    return now._replace(heading_error=wrapped(now.heading_error))


def product(row: Any, states: Any) -> Number:
    """Row of a matrix times the states."""
    pairs = zip(row[1:], states[1:], strict=True)
    return sum([a * b for a, b in pairs], row[0] * states[0])


@dataclass(frozen=True)
class LQGSettings(SteeringCost):
    """Settings of LQG: the weights of LQ, and what its filter expects."""

    noise: float | None = noise_setting(search=Step(1.0))
    disturbance_deg: float | None = setting(
        "how much the sea pushes the ship: standard deviation of a rudder angle, drawn"
        " in each interval, that would do the same; more makes the filter trust what"
        " is measured; by default 2, and more where the loop's margins need it",
        None,
        above=0.0,
        search=Step(1.0),
    )

    def completed(self, model: ShipModel, dt: float) -> Self:
        """Fill in what follows from a model; `dt`: control interval, s.

        Noise at the rudder is raised until the loop has 6 dB and 30 degrees, towards
        the margins of LQ (loop transfer recovery).
        """
        own = super().completed(model, dt)
        if own.noise is None:
            own = replace(own, noise=logged_noise(model))
        if own.disturbance_deg is not None:
            return own
        for deviation in (2.0, 4.0, 8.0, 16.0, 32.0, 64.0):
            own = replace(own, disturbance_deg=deviation)
            design = LQG.of_settings(model, dt, own)
            if design.margins.is_enough:
                break
        return own


@dataclass(frozen=True, eq=False, kw_only=True)
class LQG(Controller):
    """LQ feedback of motions that a Kalman filter estimates.

    The filter is stationary and reads noisy heading and yaw rate; the measured sway
    speed is not used. Its states are sway, yaw rate and heading error. Its input is the
    rudder of a model of the gear, which knows its limits. A jump of the heading error
    that neither noise nor the ship can make is taken as a new course.

    Attributes
    ----------
    transition : array of shape (3, 3)
        From one measurement to the next.
    input : array of shape (3,)
        Effect of the mean rudder in between.
    kalman : array of shape (3, 2)
        Gain on the innovations of yaw rate and heading error, estimate at the time of
        the measurement.
    """

    kind = "lqg"
    settings_type = LQGSettings
    feedback = LQ.feedback
    law = staticmethod(lqg_law)
    memory_record = LQGMemory
    reads = ("yaw_rate", "surge")
    arrays: ClassVar[Mapping[str, int]] = {"transition": 2, "input": 1, "kalman": 2}
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Controller.bounds,
        "new_course_rad": POSITIVE,
    }

    transition: Floats
    input: Floats
    kalman: Floats

    def __post_init__(self) -> None:
        shapes = [(3, 3), (3,), (3, 2)]
        found = [getattr(self, name).shape for name in self.arrays]
        if found != shapes:
            raise InputError(
                f"arrays: expected {', '.join(self.arrays)} of shapes {shapes}, got"
                f" {found}"
            )
        trusted = np.eye(3) - self.kalman @ OUTPUT
        of_errors = trusted @ self.transition
        check_stable(of_errors, "arrays: transition of the Kalman filter")

    @classmethod
    @takes_name
    def from_model(
        cls, model: ShipModel, *, dt: float | None = None, **settings: Any
    ) -> Self:
        """Design on a model, about straight running: LQ's gains and a Kalman filter.

        Raises InputError if the model has no straight course, or a setting is out of
        its range.

        Parameters
        ----------
        model, dt
            As in `LQ.from_model`.
        **settings
            Fields of `LQGSettings`: the weights of `LQ`, `noise`, `disturbance_deg`,
            `wave_period`.
        """
        interval = checked_interval(model, dt)
        own = LQGSettings(**settings).completed(model, interval)
        return cls.of_settings(model, interval, own)

    @classmethod
    def of_settings(cls, model: ShipModel, interval: float, own: LQGSettings) -> Self:
        """Design by whole settings; `interval`: between two commands, s."""
        ship = sample_ship(model, interval)
        given: Any = own
        disturbance = float(np.radians(given.disturbance_deg))
        states = course_filter(model, interval, disturbance)
        gain, deviations = kalman_gain(states, given.noise)
        new_course = max(NEW_COURSE, GATE * deviations[1])

        return cls.designed(
            model,
            ship,
            {**own.gains(ship, model.travel_time), **own.helm(model, interval)},
            {**known(own), "new_course_rad": new_course},
            transition=states.transition,
            input=states.effect,
            kalman=gain,
        )

    @cached_property
    def parameters(self) -> Observer:
        """Parameters of its law."""
        return Observer(
            transition=_by_rows(Transition, self.transition),
            effect=_by_rows(Motions, self.input),
            kalman=_by_rows(KalmanGains, self.kalman),
            new_course=self.design["new_course_rad"],
            feedback=self.linear_feedback,
        )


def _by_rows(record: Record, numbers: Floats) -> Any:
    """Record of an array, row by row."""
    return from_columns(record, iter(numbers.ravel().tolist()))
