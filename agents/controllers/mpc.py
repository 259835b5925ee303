"""Linear model predictive control: LQ that knows how far and how fast the rudder goes.

With the regulator's cost of what is left after the horizon, and commands written as
LQ's plus a correction v, the cost of a plan is that of LQ plus the sum of (R + B'PB)
v[k]^2: the best plan is the one nearest to LQ's that keeps to the limits. Where LQ's
own does, it is LQ's, and nothing has to be solved.

Sources: Rawlings, Mayne & Diehl 2017, Model Predictive Control, 1.3 and 2.5 (terminal
cost); Rossiter, Kouvaritakis & Rice 1998, A numerically robust state-space approach to
stable-predictive control strategies, Automatica 34 (corrections of a stabilising
feedback); Stellato et al. 2020, OSQP, Mathematical Programming Computation 12.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import Controller, Range
from agents.controllers.linear_loop import RUDDER, SIGNALS, check_stable, sample_ship
from agents.controllers.lq import LQ, Weights, without_yaw_memory
from agents.controllers.memory import Flags, Floats, deviations
from shipgym import ShipModel
from shipgym.checks import check_number
from shipgym.extras import library
from shipgym.tasks.steering import RATE_WEIGHT, RUDDER_WEIGHT

ACCURACY = 1e-4  # of the solver, rad
MOST_ITERATIONS = 20_000
# of a horizon: 20 ship lengths with any control interval that environments take
MOST_STEPS = 640
# of the solver (its rho), fixed so that an answer depends on the question alone
STEP_SIZE = 2.0


class Plan(NamedTuple):
    """Plans over the horizon, deviations from straight running: the numbers that are limited."""

    #: commands, then changes of the rudder in an interval, of LQ's own plan, per state,
    #: shape (2 * horizon, 5)
    by_state: Floats
    by_correction: (
        Floats  # the same per correction of LQ's commands, shape (2 * horizon, horizon)
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class MPC(Controller):
    """Plans the rudder over a horizon within its limit and rate; needs the extra `mpc` (OSQP).

    Attributes
    ----------
    transition : array of shape (5, 5)
    effect : array of shape (5,)
        The sampled ship, x[k + 1] = transition x[k] + effect order[k]
        (`agents.controllers.linear_loop`).
    """

    kind: ClassVar[str] = "mpc"
    feedback: ClassVar[Mapping[str, tuple[str, float]]] = LQ.feedback
    arrays: ClassVar[Mapping[str, tuple[str | int, ...]]] = {
        "transition": (len(SIGNALS), len(SIGNALS)),
        "effect": (len(SIGNALS),),
    }
    ranges: ClassVar[Mapping[str, Range]] = {
        **Controller.ranges,
        "horizon_steps": Range(2, MOST_STEPS),
        "rudder_rate_rad_s": Range(1e-6, 1e3),
    }

    transition: Floats
    effect: Floats

    def __post_init__(self) -> None:
        steps = self.design["horizon_steps"]
        check_number(
            steps,
            "horizon_steps",
            at_most=MOST_STEPS,
            hint="a shorter horizon or longer interval",
        )
        stays, moves = self.transition[RUDDER, RUDDER], self.effect[RUDDER]
        check_number(
            stays,
            "arrays.transition: share of the rudder that stays",
            at_least=0.0,
            at_most=1.0,
        )
        check_number(
            moves,
            "arrays.effect: share of an order that is followed",
            at_least=1e-6,
            at_most=1.0,
        )
        check_stable(
            self.transition + np.outer(self.effect, self.row), "arrays.transition"
        )

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        dt: float | None = None,
        integral_lengths: float = 20.0,
        horizon_lengths: float = 2.0,
        rudder_weight: float = RUDDER_WEIGHT,
        rate_weight_s2: float | None = None,
    ) -> Self:
        """Design on a model, about straight running.

        Raises InputError if OSQP is not installed, the model has no straight course, or
        an argument is out of its range.

        Parameters
        ----------
        model, dt, integral_lengths, rudder_weight
            As in `LQ.from_model`.
        horizon_lengths : float
            How far it plans within the limits, in times to travel one ship length;
            beyond, LQ's cost without limits is taken.
        rate_weight_s2 : float, optional
            Weight of the rudder rate, s^2; by default the environment's own. LQ's is
            higher (`linear_loop.rate_weight`), because LQ's model has no slow gear.
        """
        library("osqp", "mpc", "MPC needs it")
        check_number(horizon_lengths, "horizon_lengths", above=0.0, at_most=20.0)
        weight = (
            RATE_WEIGHT * model.travel_time**2
            if rate_weight_s2 is None
            else rate_weight_s2
        )
        weights = Weights.of(model, dt, integral_lengths, rudder_weight, weight)
        interval, time = weights.dt, model.travel_time
        reduced = without_yaw_memory(model, interval)
        limits = {
            "horizon_steps": float(max(2, round(horizon_lengths * time / interval))),
            "rudder_rate_rad_s": model.steering.rate,
        }
        gains, design = weights.gains(reduced, time), weights.design | limits
        ship = {"transition": reduced.A, "effect": reduced.B[:, 0]}
        return cls.designed(model, sample_ship(model, interval), gains, design, **ship)

    def steer(
        self, seen: dict[str, Floats], memory: Floats, begins: Flags
    ) -> tuple[Floats, Floats]:
        """LQ's command where its plan keeps to the limits, else the first of the nearest plan that does."""
        change = self.design["rudder_rate_rad_s"] * self.design["dt"]
        low, high = (
            -self.rudder_limit - self.neutral_rudder,
            self.rudder_limit - self.neutral_rudder,
        )
        state = deviations(seen, self.neutral_rudder, self.neutral_sway)
        rudder = state[:, RUDDER] = np.clip(state[:, RUDDER], low, high)
        orders: Floats = np.einsum("ij,j->i", state, self.row)
        steps = int(self.design["horizon_steps"])
        lowest, highest = (
            np.repeat((low, -change), steps),
            np.repeat((high, change), steps),
        )
        planned = np.einsum("ij,kj->ik", state, self.plan.by_state)
        stays, moves = self.transition[RUDDER, RUDDER], self.effect[RUDDER]
        for ship in np.flatnonzero(
            np.any((planned < lowest) | (planned > highest), axis=1)
        ):
            self._solver.update(l=lowest - planned[ship], u=highest - planned[ship])
            order = (
                orders[ship] + self._solver.solve(raise_error=False).x[0]
            )  # the smallest correction
            least, most = (
                (rudder[ship] * (1.0 - stays) + way) / moves
                for way in (-change, change)
            )
            orders[ship] = min(max(order, least, low), most, high)  # to the last bit
        return self.neutral_rudder + orders, memory

    @cached_property
    def plan(self) -> Plan:
        """How commands and rudder follow from the state and from corrections of LQ's commands."""
        steps, row = int(self.design["horizon_steps"]), self.row
        closed = self.transition + np.outer(self.effect, row)
        limited = np.stack(
            [row, closed[RUDDER] - np.eye(len(SIGNALS))[RUDDER]]
        )  # command, rudder's change
        by_state = np.empty((2, steps, len(SIGNALS)))
        answer = np.empty((2, steps))  # to a correction of 1 at the first step
        power = np.eye(len(SIGNALS))
        answer[:, 0] = 1.0, self.effect[RUDDER]
        for k in range(steps):
            by_state[:, k] = limited @ power
            if k + 1 < steps:
                answer[:, k + 1] = limited @ power @ self.effect
            power = closed @ power
        later = np.subtract.outer(np.arange(steps), np.arange(steps))
        by_correction = np.where(later >= 0, answer[:, np.maximum(later, 0)], 0.0)
        return Plan(
            by_state.reshape(2 * steps, -1), by_correction.reshape(2 * steps, steps)
        )

    @cached_property
    def _solver(self) -> Any:
        """OSQP with the corrections as unknowns; only its bounds change."""
        from scipy import sparse

        matrix = sparse.csc_matrix(self.plan.by_correction)
        rows, steps = matrix.shape
        solver = library("osqp", "mpc", "MPC needs it").OSQP()
        solver.setup(
            sparse.identity(steps, format="csc"),
            np.zeros(steps),
            matrix,
            -np.ones(rows),
            np.ones(rows),
            verbose=False,
            eps_abs=ACCURACY,
            eps_rel=ACCURACY,
            max_iter=MOST_ITERATIONS,
            rho=STEP_SIZE,
            adaptive_rho=False,
            warm_starting=False,
        )
        return solver

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the solver, which another process sets up again."""
        return {
            name: value for name, value in self.__dict__.items() if name != "_solver"
        }
