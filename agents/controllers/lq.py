"""LQ autopilot: the feedback that minimises the environment's own cost on the linearised ship.

Source: Norrbin 1972, On the added resistance due to steering on a straight course (the cost); van
Amerongen 1982, Adaptive steering of ships, chapter 3; Anderson & Moore 1990, Optimal Control, chapter 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.linear_loop import (
    ERROR,
    INTEGRAL,
    RUDDER,
    SIGNALS,
    SampledShip,
    length_time,
    rate_weight,
    sample_ship,
)
from shipgym.arrays import Floats
from shipgym.checks import check_number
from shipgym.ships import ShipModel
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.tasks.task import control_interval


@dataclass(frozen=True, eq=False)
class LQ(Controller):
    """Linear quadratic autopilot with integral action and neutral rudder.

    order = neutral rudder + sum of gain times deviation of sway, yaw rate, heading error, rudder and the
    integral of the heading error.
    """

    kind: ClassVar[str] = "lq"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = {signal: (signal, 1.0) for signal in SIGNALS}

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
    ) -> LQ:
        """Design on a model, about straight running.

        The weights are those of the environment's reward, with that of the rudder rate raised for the
        gear's limit (`rate_weight`). A ship with a memory of yaw, which nothing measures, is designed for as
        one of first order. The reward has none on the integral of the error; it is given the one
        with which an offset decays over about `integral_lengths` ship lengths, at hardly any cost.

        Parameters
        ----------
        model : ShipModel
            Stable or unstable on its course.
        dt : float, optional
            Control interval, s; by default that of the environment.
        integral_lengths : float
            Time for an offset to decay, in times to travel one ship length. The rest follows the cost.
        rudder_weight : float
            Weight of the squared rudder beside that of the heading error; by default the environment's.
        rate_weight_s2 : float, optional
            Weight of the squared rudder rate, s^2; by default `rate_weight`.

        Raises
        ------
        InputError
            If the model has no straight course, or an argument is out of its range.
        """
        interval, weight = lq_settings(model, dt, integral_lengths, rudder_weight, rate_weight_s2)
        ship = without_yaw_memory(model, interval)
        gain = lq_gain(ship, weight, integral_lengths * length_time(model), rudder_weight)
        return cls.designed(
            model,
            sample_ship(model, interval),
            gains=dict(zip(SIGNALS, (-gain).tolist(), strict=True)),
            design={
                "integral_lengths": float(integral_lengths),
                "rudder_weight": float(rudder_weight),
                "rate_weight_s2": weight,
            },
        )


def lq_settings(
    model: ShipModel,
    dt: float | None,
    integral_lengths: float,
    rudder_weight: float,
    rate_weight_s2: float | None,
) -> tuple[float, float]:
    """Control interval, s, and weight of the rudder rate, s^2, of a design; its arguments are checked.

    Raises InputError if an argument is out of its range.
    """
    check_number(integral_lengths, "integral_lengths", above=0.0)
    check_number(rudder_weight, "rudder_weight", above=0.0)
    interval = control_interval(model) if dt is None else check_number(dt, "dt", above=0.0)
    weight = rate_weight(model) if rate_weight_s2 is None else rate_weight_s2
    return interval, check_number(weight, "rate_weight_s2", above=0.0)


def without_yaw_memory(model: ShipModel, dt: float, speed: float | None = None) -> SampledShip:
    """The ship that gains are computed for: in first order if she has a memory of yaw, never measured."""
    return sample_ship(model, dt, first_order="q" in model.state_names, speed=speed)


def lq_gain(
    ship: SampledShip, rate_weight: float, integral_time: float, rudder_weight: float = RUDDER_WEIGHT
) -> Floats:
    """Gain G of order = -G x that minimises the environment's cost on the sampled linear ship.

    The reward of an interval is on the state at its end, so the cost is that of the outputs z[k] = C x[k] + D
    order[k] = (error, weighted rudder, weighted rudder rate, weighted integral)[k + 1], which couples state
    and input. `rate_weight`: weight of the rudder rate, s^2; `integral_time`: time for an offset to decay, s;
    `rudder_weight`: weight of the rudder; by default the environment's. Returns an array of shape (5,).
    """
    import control  # here, because it takes a second to import

    weights = np.array([1.0, np.sqrt(rudder_weight), np.sqrt(rate_weight) / ship.dt, 1.0 / integral_time])
    rows = [ERROR, RUDDER, RUDDER, INTEGRAL]
    C, D = ship.A[rows], ship.B[rows]
    C[2, RUDDER] -= 1.0
    C, D = weights[:, None] * C, weights[:, None] * D
    plant = control.ss(ship.A, ship.B, np.eye(len(SIGNALS)), 0.0, ship.dt)
    gain, _, _ = control.lqr(plant, C.T @ C, D.T @ D, C.T @ D)
    row: Floats = np.asarray(gain, dtype=np.float64)[0]
    return row
