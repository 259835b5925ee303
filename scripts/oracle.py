"""What a task leaves to gain: rudder sequences found by sampling on the true ship in the weather to come.

Nobody can fly it. It knows the state without noise and every gust before it blows, tries hundreds of rudder
sequences on copies of the ship, and takes the best: the cross-entropy method over a receding horizon, started
from what a classical autopilot did. It does not know course changes before they are ordered.

A candidate is the autopilot's own sequence plus a smooth change, written as what is added to LQ's feedback of
the true state, so that ships unstable on their course are held while the change is tried.

Sources: Rubinstein & Kroese 2004, The Cross-Entropy Method; Williams, Aldrich & Theodorou 2017, Model
predictive path integral control, Journal of Guidance, Control, and Dynamics 40 (sampling on the model in
parallel); Bertsekas 2019, Reinforcement Learning and Optimal Control, 2.4 (rollout: improving a base policy).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Controller, Policy
from agents.controllers.lq import LQ
from agents.controllers.pid import PID
from shipgym.checks import check_number, check_whole
from shipgym.envs.course_keeping_task import CourseKeepingTask
from shipgym.envs.engine import Engine
from shipgym.envs.task import Task
from shipgym.envs.variety import Variety
from shipgym.errors import InputError
from shipgym.kernels import course_keeping, layout
from shipgym.kernels import voyage_rows as rows
from shipgym.ships import ShipModel
from shipgym.tasks.guidance import wrapped

Floats = NDArray[np.float64]

LEAST_SCALE = 0.1  # candidates differ by this part of the spread to all of it: coarse and fine ones at once
LEARNING = 0.8  # share of the elites in the new mean and spread
LEAST_SPREAD = 0.002  # parts of the rudder limit


@dataclass(frozen=True)
class OracleSettings:
    """How hard is searched.

    Attributes
    ----------
    candidates : int
        Rudder sequences tried at once.
    elites : int
        Of which the best are learned from.
    iterations : int
        Rounds of trying and learning at each planning.
    horizon_steps : int
        Control intervals that a candidate is judged by.
    plan_steps : int
        Of which the first are changed; on the others the plan stays and LQ brings the ship back to it.
    knot_steps : int
        Between two knots of a change, which is linear between them.
    replan_steps : int
        Flown before planning again.
    passes : int
        Times that the whole episode is gone through, each beginning with the best plan so far.
    spread : float
        Standard deviation of a knot at first, parts of the rudder limit; half of it in each further pass.
    group : int
        Episodes planned side by side; the results do not depend on it.
    """

    candidates: int = 64
    elites: int = 8
    iterations: int = 3
    horizon_steps: int = 160
    plan_steps: int = 120
    knot_steps: int = 10
    replan_steps: int = 20
    passes: int = 2
    spread: float = 0.3
    group: int = 32

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name != "spread":
                check_whole(getattr(self, item.name), item.name, at_least=1)
        check_number(self.spread, "spread", above=0.0)
        check_number(self.elites, "elites", at_most=self.candidates // 2, hint="half of the candidates")
        check_number(self.plan_steps, "plan_steps", at_least=self.knot_steps, at_most=self.horizon_steps)
        check_number(self.replan_steps, "replan_steps", at_most=self.plan_steps)


@dataclass(frozen=True, eq=False)
class OracleFlight:
    """Episodes as the oracle steered them.

    Attributes
    ----------
    costs : array of shape (n_episodes,)
        Minus the sum of rewards; never more than `start_costs`.
    start_costs : array of shape (n_episodes,)
        Of the autopilot that it began with.
    actions : float32 array of shape (n_episodes, episode_steps)
        Commanded rudder, parts of the limit.
    """

    costs: Floats
    start_costs: Floats
    actions: NDArray[np.float32]


def fly_oracle(
    model: ShipModel,
    task: Task,
    seeds: ArrayLike,
    start: Policy | None = None,
    settings: OracleSettings | None = None,
    variety: Variety | None = None,
) -> OracleFlight:
    """Steer episodes as well as sampling on the true ship can.

    Parameters
    ----------
    model : ShipModel
        The ship.
    task : Task
        Steered by the rudder alone.
    seeds : array-like of int, shape (n_episodes,)
        Of the episodes.
    start : Policy, optional
        What each plan begins with; by default `LQ.from_model(model)`.
    settings : OracleSettings, optional
        How hard is searched.
    variety : Variety, optional
        What differs from episode to episode beside the task's own.

    Returns
    -------
    OracleFlight
        The same for the same arguments, whatever else is in the batch.

    Raises
    ------
    InputError
        For another action than the rudder.
    """
    if task.action != "rudder":
        raise InputError(f"action: '{task.action}' found, expected 'rudder': the oracle steers by it alone")
    asked = settings or OracleSettings()
    numbers = np.atleast_1d(np.asarray(seeds))
    holder = _holder(start, model, task)
    flights = [
        _Search(model, task, numbers[first : first + asked.group], holder, asked, variety).fly(
            start or holder
        )
        for first in range(0, len(numbers), asked.group)
    ]
    joined = (np.concatenate([getattr(one, item.name) for one in flights]) for item in fields(OracleFlight))
    return OracleFlight(*joined)


class _Search:
    """A group of episodes and the copies on which their candidates are tried."""

    def __init__(
        self, model: ShipModel, task: Task, seeds: NDArray[Any], holder: Controller, settings: OracleSettings,
        variety: Variety | None,
    ) -> None:  # fmt: skip
        self.task, self.seeds, self.holder, self.settings = task, seeds, holder, settings
        self.n = len(seeds)
        self.ships = Engine(model, self.n, task, variety)
        self.model, self.variety = model, variety
        self._sizes: dict[int, Engine] = {}
        self._changes_course = isinstance(task, CourseKeepingTask)
        self._ordered = np.zeros((self.n, task.episode_steps), dtype=np.bool_)  # a new course at this step

    def fly(self, start: Policy) -> OracleFlight:
        """Start from an autopilot's sequence and improve it in passes."""
        costs, added, actions = self._flown_by(start)
        best = OracleFlight(costs.copy(), costs, actions)
        self._keep_better(best, added, *self._sailed(np.zeros_like(added)))
        for number in range(self.settings.passes):
            self._keep_better(best, added, *self._pass(added, number))
        return best

    def _keep_better(
        self, best: OracleFlight, added: Floats, costs: Floats, plan: Floats, actions: NDArray[np.float32]
    ) -> None:
        """Put a plan in the place of a dearer one."""
        better = costs < best.costs
        added[better] = plan[better]
        best.costs[better], best.actions[better] = costs[better], actions[better]

    def _flown_by(self, policy: Policy) -> tuple[Floats, Floats, NDArray[np.float32]]:
        """Cost of an autopilot, what it adds to the holder's rudder, and its rudder."""
        costs, added, actions = self._nothing_yet()
        seen, state, starts = self.ships.reset(self.seeds), None, np.ones(self.n, dtype=np.bool_)
        course = np.full(self.n, np.nan)
        for step in self._steps():
            self._ordered[:, step] = course != self.ships.outcome(rows.COURSE)
            course = self.ships.outcome(rows.COURSE)
            action, state = policy.predict(seen, state, starts, True)
            actions[:, step] = action[:, 0]
            added[:, step] = action[:, 0] - self._held(self.ships)
            seen, rewards, _, _ = self.ships.step(action)
            costs -= rewards
            starts = np.zeros(self.n, dtype=np.bool_)
        return costs, added, actions

    def _sailed(self, added: Floats) -> tuple[Floats, Floats, NDArray[np.float32]]:
        """Cost, plan and rudder of a plan that is kept to."""
        costs, _, actions = self._nothing_yet()
        self.ships.reset(self.seeds)
        for step in self._steps():
            self._steer(self.ships, added[:, step])
            actions[:, step] = self.ships.command[0]
            costs -= self.ships.shown.outcomes[0]
        return costs, added, actions

    def _steps(self) -> Iterator[int]:
        """Control intervals until all episodes are over."""
        for step in range(self.task.episode_steps):
            if self.ships.outcome(rows.ENDED).all():
                return
            yield step

    def _nothing_yet(self) -> tuple[Floats, Floats, NDArray[np.float32]]:
        shape = (self.n, self.task.episode_steps)
        return np.zeros(self.n), np.zeros(shape), np.zeros(shape, dtype=np.float32)

    def _pass(self, last: Floats, number: int) -> tuple[Floats, Floats, NDArray[np.float32]]:
        """Go through the episodes once, planning anew as they go on; begins with the `last` plan."""
        costs, added, actions = self._nothing_yet()
        self.ships.reset(self.seeds)
        next_plan = np.zeros(self.n, dtype=np.int64)
        for step in self._steps():
            for lane in np.flatnonzero(self._ordered[:, step]) if self._changes_course or step == 0 else ():
                added[lane, step:] = 0.0
                end = self._next_order(int(lane), step)
                added[lane, step:end] = last[lane, step:end]
                next_plan[lane] = step
            due = np.flatnonzero((next_plan <= step) & (self.ships.outcome(rows.ENDED) == 0.0))
            if len(due):
                self._plan(added, due, step, number)
                next_plan[due] = step + self.settings.replan_steps
            self._steer(self.ships, added[:, step])
            actions[:, step] = self.ships.command[0]
            costs -= self.ships.shown.outcomes[0]
        return costs, added, actions

    def _next_order(self, lane: int, step: int) -> int:
        """Step of the next course change, beyond which there is no plan yet."""
        if not self._changes_course:
            return self.task.episode_steps
        later = np.flatnonzero(self._ordered[lane, step + 1 :])
        return step + 1 + int(later[0]) if len(later) else self.task.episode_steps

    def _plan(self, added: Floats, which: NDArray[np.int64], step: int, number: int) -> None:
        """Improve the plan of some episodes from a step on by the cross-entropy method."""
        asked, episodes = self.settings, np.arange(len(which))
        shape = self._shape(step)
        random = np.random.default_rng((number, step))
        mean = np.zeros((len(which), len(shape)))
        spread = np.full_like(mean, asked.spread * 0.5**number)
        least, change = np.full(len(which), np.inf), np.zeros_like(mean)
        for _ in range(asked.iterations):
            knots = mean[:, None] + spread[:, None] * _drawn(random, asked.candidates, len(shape))
            knots[:, 0] = change
            costs = self._tried(added[which], which, knots, shape, step)
            order = np.argsort(costs, axis=1, kind="stable")
            best = order[:, 0]
            better = costs[episodes, best] < least
            least[better] = costs[episodes, best][better]
            change[better] = knots[episodes, best][better]
            elites = np.take_along_axis(knots, order[:, : asked.elites, None], axis=1)
            mean += LEARNING * (elites.mean(axis=1) - mean)
            spread += LEARNING * (np.maximum(elites.std(axis=1), LEAST_SPREAD) - spread)
        added[which, step : step + shape.shape[1]] += (change[:, None] @ shape)[:, 0]

    def _shape(self, step: int) -> Floats:
        """Change of the plan per knot, shape (n_knots, n_steps): straight between knots, 0 at the end."""
        count = min(self.settings.plan_steps, self.task.episode_steps - step)
        at = np.arange(count) / self.settings.knot_steps
        n_knots = -(-self.settings.plan_steps // self.settings.knot_steps)
        return np.maximum(0.0, 1.0 - np.abs(at - np.arange(n_knots)[:, None]))

    def _tried(
        self, added: Floats, which: NDArray[np.int64], knots: Floats, shape: Floats, step: int
    ) -> Floats:
        """Costs of candidates over the horizon, shape (n_episodes, n_candidates)."""
        copies = self._copies(len(which))
        copies.copy_lanes(self.ships, np.repeat(which, knots.shape[1]))
        if self._changes_course:
            copies.write(course_keeping.NEXT_CHANGE, np.inf)
        changes = (knots @ shape).reshape(copies.num_envs, -1)
        costs = np.zeros(copies.num_envs)
        last = min(step + self.settings.horizon_steps, self.task.episode_steps)
        for now in range(step, last):
            asked = np.repeat(added[:, now], knots.shape[1])
            if now - step < shape.shape[1]:
                asked += changes[:, now - step]
            self._steer(copies, asked)
            costs -= copies.shown.outcomes[0]
        return costs.reshape(knots.shape[:2])

    def _copies(self, episodes: int) -> Engine:
        """Ships for the candidates of so many episodes."""
        if episodes not in self._sizes:
            n = episodes * self.settings.candidates
            self._sizes[episodes] = Engine(self.model, n, self.task, self.variety)
        return self._sizes[episodes]

    def _steer(self, engine: Engine, added: Floats) -> None:
        """One control interval of holding the ship, with something added to the rudder."""
        np.clip(self._held(engine) + added, -1.0, 1.0, out=engine.command[0], casting="same_kind")
        engine.advance()

    def _held(self, engine: Engine) -> Floats:
        """The holder's rudder for the true state, parts of the limit, shape (num_envs,)."""
        holder = self.holder
        deviations = {
            "heading_error": wrapped(engine.outcome(rows.COURSE) - engine.outcome(layout.PSI)),
            "yaw_rate": engine.outcome(layout.R),
            "sway": engine.outcome(layout.V) - holder.neutral_sway,
            "rudder": engine.outcome(layout.DELTA) - holder.neutral_rudder,
            "heading_error_integral": engine.outcome(rows.INTEGRAL),
        }
        order = np.full(engine.num_envs, holder.neutral_rudder)
        for gain, (signal, sign) in holder.feedback.items():
            order += sign * holder.gains[gain] * deviations[signal]
        limit = holder.observation_scales[holder.observation_names.index("rudder")]
        return np.clip(order / limit, -1.0, 1.0)


def _holder(start: Policy | None, model: ShipModel, task: Task) -> Controller:
    """The start itself, or the autopilot it leads, if it is plain feedback; else LQ."""
    inner = getattr(start, "autopilot", start)
    return inner if isinstance(inner, PID | LQ) else LQ.from_model(model, dt=task.interval(model))


def _drawn(random: np.random.Generator, candidates: int, n_knots: int) -> Floats:
    """Changes of unit spread, coarse and fine, each with its mirror image, shape (candidates, n_knots)."""
    half = -(-candidates // 2)
    drawn = random.standard_normal((half, n_knots))
    drawn *= np.geomspace(LEAST_SCALE, 1.0, half)[:, None]
    return np.concatenate([drawn, -drawn])[:candidates]
