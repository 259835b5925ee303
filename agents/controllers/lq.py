"""LQ autopilot: the feedback that minimises the environment's cost on a linear ship.

Source: Norrbin 1972, On the added resistance due to steering on a straight course (the
cost); van Amerongen 1982, Adaptive steering of ships, chapter 3; Anderson & Moore 1990,
Optimal Control, chapters 2 and 3 (cross terms).
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import Controller
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
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.engine.compiling import tell_who_waits
from shipgym.models.by_name import takes_name
from shipgym.tasks.scales import RUDDER_WEIGHT


class SteeringCost(NamedTuple):
    """Weights of an LQ design; that of the squared heading error is 1."""

    rudder_weight: float  # of the squared rudder
    rate_weight_s2: float  # of the squared rudder rate, s^2
    integral_time: float  # for an offset to decay, s

    @property
    def weights(self) -> dict[str, float]:
        """The two weights by name, as a controller's file has them."""
        return {
            "rudder_weight": self.rudder_weight,
            "rate_weight_s2": self.rate_weight_s2,
        }


@dataclass(frozen=True, eq=False)
class LQ(Controller):
    """Linear quadratic autopilot with integral action and neutral rudder.

    order = neutral rudder + sum of gain times deviation of sway, yaw rate, heading
    error, rudder and the integral of the heading error.
    """

    kind: ClassVar[str] = "lq"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = {
        signal: (signal, 1.0) for signal in SIGNALS
    }

    @classmethod
    @takes_name
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
    ) -> Self:
        """Design on a model, about straight running.

        The weights are those of the environment's reward, with that of the rudder rate
        raised for the gear's limit (`rate_weight`). A ship with a memory of yaw, which
        nothing measures, is designed for as one of first order. The reward has none on
        the integral of the error; it is given the one with which an offset decays over
        about `integral_lengths` ship lengths, at hardly any cost.

        Raises InputError if the model has no straight course, or an argument is out of
        its range.

        Parameters
        ----------
        model : ShipModel
            Stable or unstable on its course.
        dt : float, optional
            Control interval, s; by default that of the environment.
        integral_lengths : float
            Time for an offset to decay, in times to travel one ship length. The rest
            follows the cost.
        rudder_weight : float
            Weight of the squared rudder beside that of the heading error; by default
            the environment's.
        rate_weight_s2 : float, optional
            Weight of the squared rudder rate, s^2; by default `rate_weight`.
        """
        made = lq_design(
            model,
            dt=dt,
            integral_lengths=integral_lengths,
            rudder_weight=rudder_weight,
            rate_weight_s2=rate_weight_s2,
        )
        return cls.designed(model, made.ship, made.gains, made.design)


class LQDesign(NamedTuple):
    """Gains of LQ on a ship, and how they were found."""

    ship: SampledShip
    gains: dict[str, float]
    design: dict[str, float]


def lq_design(
    model: ShipModel,
    dt: float | None,
    integral_lengths: float,
    rudder_weight: float,
    rate_weight_s2: float | None,
) -> LQDesign:
    """Design LQ with the arguments of `LQ.from_model`."""
    interval = checked_interval(model, dt)
    cost = steering_cost(
        model,
        integral_lengths=integral_lengths,
        rudder_weight=rudder_weight,
        rate_weight_s2=rate_weight_s2,
    )
    ship = measured = sample_ship(model, interval)
    if "q" in model.state_names:
        measured = sample_ship(model, interval, first_order=True)
    return LQDesign(
        ship=ship,
        gains=lq_gains(measured, cost),
        design={"integral_lengths": float(integral_lengths), **cost.weights},
    )


def steering_cost(
    model: ShipModel,
    integral_lengths: float,
    rudder_weight: float,
    rate_weight_s2: float | None,
) -> SteeringCost:
    """Cost from the arguments of `LQ.from_model`; InputError if one is out of range."""
    check_number(integral_lengths, "integral_lengths", above=0.0)
    check_number(rudder_weight, "rudder_weight", above=0.0)
    if rate_weight_s2 is None:
        rate_weight_s2 = rate_weight(model)
    check_number(rate_weight_s2, "rate_weight_s2", above=0.0)
    return SteeringCost(
        rudder_weight=float(rudder_weight),
        rate_weight_s2=float(rate_weight_s2),
        integral_time=integral_lengths * model.travel_time,
    )


def lq_gains(ship: SampledShip, cost: SteeringCost) -> dict[str, float]:
    """Gains on the deviations of a sampled ship, by signal."""
    gains = (-lq_gain(ship, cost)).tolist()
    return dict(zip(SIGNALS, gains, strict=True))


def lq_gain(ship: SampledShip, cost: SteeringCost) -> Floats:
    """Gain G of order = -G x that minimises the steering cost on a ship, shape (5,)."""
    if "control" not in sys.modules:
        tell_who_waits("shipgym: importing python-control, about a second")
    import control  # here, because it takes a second to import

    measured = np.eye(len(SIGNALS))
    plant = control.ss(ship.A, ship.B, measured, 0.0, ship.dt)
    C, D = cost_outputs(ship, cost)
    Q = C.T @ C
    R = D.T @ D
    N = C.T @ D
    gain, _, _ = control.lqr(plant, Q, R, N)
    row: Floats = np.ravel(gain)
    return row


def cost_outputs(ship: SampledShip, cost: SteeringCost) -> tuple[Floats, Floats]:
    """Outputs z[k] = C x[k] + D order[k] whose squares add up to the steering cost.

    The reward of an interval is on the state at its end, z[k] = (error, weighted
    rudder, weighted rudder rate, weighted integral)[k + 1], which couples state and
    input (Anderson & Moore 1990, chapter 3).
    """
    of_rudder = np.sqrt(cost.rudder_weight)
    of_rate = np.sqrt(cost.rate_weight_s2) / ship.dt
    of_integral = 1.0 / cost.integral_time
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
