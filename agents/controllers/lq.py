"""LQ autopilot: the feedback that minimises the environment's cost on a linear ship.

A low-pass and a dead-band on its order keep the rudder quiet where they are asked for.

Source: Norrbin 1972, On the added resistance due to steering on a straight course (the
cost); van Amerongen 1982, Adaptive steering of ships, chapter 3; Anderson & Moore 1990,
Optimal Control, chapters 2 and 3 (cross terms); Fossen 2011, Handbook of Marine Craft
Hydrodynamics and Motion Control, 13.2 (dead-band and filters of autopilots).
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.helm import HelmSettings, known
from agents.controllers.linear_loop import (
    ERROR,
    INTEGRAL,
    RUDDER,
    SIGNALS,
    SampledShip,
    checked_interval,
    rate_weight,
    sample_ship,
)
from agents.settings import Step, setting
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.engine.compiling import tell_who_waits
from shipgym.models.by_name import takes_name
from shipgym.tasks.scales import RUDDER_WEIGHT


@dataclass(frozen=True)
class SteeringCost(HelmSettings):
    """Weights of an LQ design; that of the squared heading error is 1.

    They are those of the environment's reward, with that of the rudder rate raised for
    the gear's limit (`rate_weight`). The reward has none on the integral of the error;
    it is given the one with which an offset decays over about `integral_lengths` ship
    lengths, at hardly any cost.
    """

    rudder_weight: float = setting(
        "weight of the squared rudder", RUDDER_WEIGHT, above=0.0, search=Step(0.7)
    )
    rate_weight_s2: float | None = setting(
        "weight of the squared rudder rate, s^2; by default `rate_weight`",
        None,
        above=0.0,
        search=Step(1.0),
    )
    integral_lengths: float = setting(
        "time for an offset to decay, in times to travel one ship length; the rest"
        " follows the cost",
        20.0,
        above=0.0,
        search=Step(1.0),
    )

    def completed(self, model: ShipModel, dt: float) -> Self:
        """Fill in what follows from a model; `dt`: control interval, s."""
        if self.rate_weight_s2 is not None:
            return self
        return replace(self, rate_weight_s2=rate_weight(model))

    def gains(self, ship: SampledShip, travel_time: float) -> dict[str, float]:
        """Gains on the deviations of a sampled ship, by signal.

        `travel_time`: to travel one ship length, s.
        """
        gains = (-lq_gain(ship, self, travel_time)).tolist()
        return dict(zip(SIGNALS, gains, strict=True))


@dataclass(frozen=True)
class LQSettings(SteeringCost):
    """Settings of LQ."""

    rudder_time: float = setting(
        "time constant of a low-pass on the order, in times to travel one ship length",
        0.0,
        at_least=0.0,
        search=Step(1.2, start=0.01),
    )
    rudder_band_deg: float = setting(
        "by how much an order is to differ from the last one, degrees",
        0.0,
        at_least=0.0,
        at_most=90.0,
        search=Step(1.2, start=0.05),
    )


@dataclass(frozen=True, eq=False)
class LQ(Controller):
    """Linear quadratic autopilot with integral action and neutral rudder.

    order = neutral rudder + sum of gain times deviation of sway, yaw rate, heading
    error, the rudder of a model of the gear and the integral of the heading error,
    filtered where it is asked for.
    """

    kind = "lq"
    settings_type = LQSettings
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = {
        signal: (signal, 1.0) for signal in SIGNALS
    }

    @classmethod
    @takes_name
    def from_model(
        cls, model: ShipModel, *, dt: float | None = None, **settings: Any
    ) -> Self:
        """Design on a model, about straight running.

        A ship with a memory of yaw, which nothing measures, is designed for as one of
        first order.

        Raises InputError if the model has no straight course, a setting is out of its
        range, or a filter makes the loop unstable.

        Parameters
        ----------
        model : ShipModel
            Stable or unstable on its course.
        dt : float, optional
            Control interval, s; by default that of the environment.
        **settings
            Fields of `LQSettings`: `rudder_weight`, `rate_weight_s2`,
            `integral_lengths`, `rudder_time`, `rudder_band_deg`, `wave_period`,
            `schedule`.
        """
        interval = checked_interval(model, dt)
        own = LQSettings(**settings).completed(model, interval)
        ship = measured = sample_ship(model, interval)
        if "q" in model.state_names:
            measured = sample_ship(model, interval, first_order=True)
        low_pass = own.rudder_time * model.travel_time
        gains = {
            **own.gains(measured, model.travel_time),
            **own.helm(model, interval),
            "rudder_update": interval / (interval + low_pass),
            "rudder_band": float(np.radians(own.rudder_band_deg)),
        }
        return cls.designed(model, ship, gains, known(own))


def lq_gain(ship: SampledShip, cost: SteeringCost, travel_time: float) -> Floats:
    """Gain G of order = -G x that minimises the steering cost on a ship, shape (5,)."""
    if "control" not in sys.modules:
        tell_who_waits("shipgym: importing python-control, about a second")
    import control  # here, because it takes a second to import

    measured = np.eye(len(SIGNALS))
    plant = control.ss(ship.A, ship.B, measured, 0.0, ship.dt)
    C, D = cost_outputs(ship, cost, travel_time)
    Q = C.T @ C
    R = D.T @ D
    N = C.T @ D
    gain, _, _ = control.lqr(plant, Q, R, N)
    return np.ravel(gain)


def cost_outputs(
    ship: SampledShip, cost: SteeringCost, travel_time: float
) -> tuple[Floats, Floats]:
    """Outputs z[k] = C x[k] + D order[k] whose squares add up to the steering cost.

    The reward of an interval is on the state at its end, z[k] = (error, weighted
    rudder, weighted rudder rate, weighted integral)[k + 1], which couples state and
    input (Anderson & Moore 1990, chapter 3).
    """
    of_rudder = np.sqrt(cost.rudder_weight)
    rate_weight: Any = cost.rate_weight_s2
    of_rate = np.sqrt(rate_weight) / ship.dt
    of_integral = 1.0 / (cost.integral_lengths * travel_time)
    weights = np.array(
        [
            [1.0],
            [of_rudder],
            [of_rate],
            [of_integral],
        ]
    )

    rows = [ERROR, RUDDER, RUDDER, INTEGRAL]
    rate = 2  # row of the rudder rate
    by_state = ship.A[rows]
    by_state[rate, RUDDER] -= 1.0  # the change of the rudder
    by_order = ship.B[rows]
    return weights * by_state, weights * by_order
