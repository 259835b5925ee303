"""LQ autopilot: the feedback that minimises the environment's own cost on the linearised ship.

Source: Norrbin 1972, On the added resistance due to steering on a straight course (the
cost); van Amerongen 1982, Adaptive steering of ships, chapter 3; Anderson & Moore 1990,
Optimal Control, chapters 2 and 3 (cross terms).
"""

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
    rate_weight,
    sample_ship,
)
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.tasks.task import control_interval


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
        weights = Weights.of(model, dt, integral_lengths, rudder_weight, rate_weight_s2)
        gains = weights.gains(without_yaw_memory(model, weights.dt), model.travel_time)
        return cls.designed(
            model, sample_ship(model, weights.dt), gains, weights.design
        )


class Weights(NamedTuple):
    """What an LQ design weighs beside the squared heading error."""

    dt: float  # control interval, s
    integral_lengths: (
        float  # time for an offset to decay, in times to travel one ship length
    )
    rudder_weight: float  # of the squared rudder
    rate_weight_s2: float  # of the squared rudder rate, s^2

    @classmethod
    def of(
        cls,
        model: ShipModel,
        dt: float | None,
        integral_lengths: float,
        rudder_weight: float,
        rate_weight_s2: float | None,
    ) -> Self:
        """Those of a ship, as in `LQ.from_model`; raises InputError if one is out of its range."""
        check_number(integral_lengths, "integral_lengths", above=0.0)
        check_number(rudder_weight, "rudder_weight", above=0.0)
        interval = (
            control_interval(model) if dt is None else check_number(dt, "dt", above=0.0)
        )
        weight = rate_weight(model) if rate_weight_s2 is None else rate_weight_s2
        weight = check_number(weight, "rate_weight_s2", above=0.0)
        return cls(interval, float(integral_lengths), float(rudder_weight), weight)

    def gains(self, ship: SampledShip, length_time: float) -> dict[str, float]:
        """Gains of a sampled ship that travels her length in so many seconds, by signal."""
        gain = lq_gain(
            ship,
            self.rate_weight_s2,
            self.integral_lengths * length_time,
            self.rudder_weight,
        )
        return dict(zip(SIGNALS, (-gain).tolist(), strict=True))

    @property
    def design(self) -> dict[str, float]:
        """What a controller's file says of them."""
        return {name: value for name, value in self._asdict().items() if name != "dt"}


def without_yaw_memory(
    model: ShipModel, dt: float, speed: float | None = None
) -> SampledShip:
    """The ship that gains are computed for: in first order if she has a memory of yaw, never measured."""
    return sample_ship(model, dt, first_order="q" in model.state_names, speed=speed)


def lq_gain(
    ship: SampledShip,
    rate_weight: float,
    integral_time: float,
    rudder_weight: float = RUDDER_WEIGHT,
) -> Floats:
    """Gain G of order = -G x that minimises the environment's cost on the sampled linear ship, shape (5,).

    `rate_weight`: of the rudder rate, s^2; `integral_time`: for an offset to decay, s.
    """
    import control  # here, because it takes a second to import

    (C,), (D,) = _outputs(
        ship.A[None], ship.B.T, ship.dt, rate_weight, integral_time, rudder_weight
    )
    plant = control.ss(ship.A, ship.B, np.eye(len(SIGNALS)), 0.0, ship.dt)
    gain, _, _ = control.lqr(plant, C.T @ C, D.T @ D, C.T @ D)
    return np.asarray(gain, dtype=np.float64).reshape(-1)


def _outputs(
    A: Floats,
    B: Floats,
    dt: float,
    rate_weight: float,
    integral_time: float,
    rudder_weight: float,
) -> tuple[Floats, Floats]:
    """C, shape (n, 4, 5), and D, shape (n, 4, 1), of the outputs whose squares the cost adds up.

    The reward of an interval is on the state at its end: z[k] = C x[k] + D order[k] =
    (error, weighted rudder, weighted rudder rate, weighted integral)[k + 1], which
    couples state and input.
    """
    weights = np.array(
        [1.0, np.sqrt(rudder_weight), np.sqrt(rate_weight) / dt, 1.0 / integral_time]
    )
    rows = [ERROR, RUDDER, RUDDER, INTEGRAL]
    C, D = A[:, rows].copy(), B[:, rows]
    C[:, 2, RUDDER] -= 1.0
    return weights[:, None] * C, (weights * D)[:, :, None]
