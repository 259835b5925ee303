"""What a task leaves to gain: rudder sequences found by sampling on the true ship in the weather to come.

    from oracle import run_oracle                     # `scripts/best_known.py --search`
    uses it

No autopilot can steer like it. It knows the state without noise and every gust before
it blows, tries hundreds of rudder sequences on copies of the ship, and takes the best:
the cross-entropy method over a receding horizon, started from what a classical
autopilot did. It does not know course changes before they are ordered.

A candidate is the autopilot's own sequence plus a smooth change, written as what is
added to LQ's feedback of the true state, so that ships unstable on their course are
held while the change is tried.

Sources: Rubinstein & Kroese 2004, The Cross-Entropy Method; Williams, Aldrich &
Theodorou 2017, Model predictive path integral control, Journal of Guidance, Control,
and Dynamics 40 (sampling on the model in parallel); Bertsekas 2019, Reinforcement
Learning and Optimal Control, 2.4 (rollout: improving a base policy).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from lane_copies import copy_lanes
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Controller, Policy
from agents.controllers.lq import LQ
from agents.controllers.pid import PID
from agents.rollouts.rollout import rollout
from shipgym.checks import check_number, check_whole
from shipgym.envs.engine import Engine
from shipgym.envs.randomisation import Randomisation
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.scales import observation_scales
from shipgym.tasks.steering import INTEGRAL_ZONE
from shipgym.tasks.task import Task

Floats = NDArray[np.float64]
Rudder = NDArray[np.float32]

ORACLE_EPISODES = 100
# candidates differ by this part of the deviation to all of it: coarse and fine ones at
# once
LEAST_SCALE = 0.1
LEARNING = 0.8  # share of the elites in the new mean and deviation
LEAST_DEVIATION = 0.002  # parts of the rudder limit


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
        Control intervals over which a candidate is compared.
    plan_steps : int
        Of which the first are changed; on the others the plan stays and LQ brings the
        ship back to it.
    knot_steps : int
        Between two knots of a change, which is linear between them.
    replan_steps : int
        Sailed before planning again.
    passes : int
        Times that the whole episode is gone through, each beginning with the best plan
        so far.
    deviation : float
        Standard deviation of a knot at first, parts of the rudder limit; half of it in
        each further pass.
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
    deviation: float = 0.3
    group: int = 32

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name != "deviation":
                check_whole(getattr(self, item.name), item.name, at_least=1)
        check_number(self.deviation, "deviation", above=0.0)
        check_number(
            self.elites,
            "elites",
            at_most=self.candidates // 2,
            hint="half of the candidates",
        )
        check_number(
            self.plan_steps,
            "plan_steps",
            at_least=self.knot_steps,
            at_most=self.horizon_steps,
        )
        check_number(self.replan_steps, "replan_steps", at_most=self.plan_steps)


@dataclass(frozen=True, eq=False)
class OracleRun:
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
    actions: Rudder


def run_oracle(
    model: ShipModel,
    task: Task,
    seeds: ArrayLike,
    start: Policy | Sequence[Policy] | None = None,
    settings: OracleSettings | None = None,
    randomisation: Randomisation | None = None,
) -> OracleRun:
    """Steer episodes as well as sampling on the true ship can.

    Parameters
    ----------
    model : ShipModel
        The ship.
    task : Task
        Steered by the rudder alone.
    seeds : array-like of int, shape (n_episodes,)
        Of the episodes.
    start : Policy or sequence of Policy, optional
        What each plan begins with, of several that which costs least in the episode; by
        default `LQ.from_model(model)`.
    settings : OracleSettings, optional
        How hard is searched.
    randomisation : Randomisation, optional
        What differs from episode to episode beside the task's own.

    Returns
    -------
    OracleRun
        The same for the same arguments, whatever else is in the batch.

    Raises
    ------
    InputError
        For another action than the rudder.
    """
    if task.action != "rudder":
        raise InputError(
            f"action: '{task.action}' found, expected 'rudder': the oracle steers by it"
            " alone"
        )
    asked = settings or OracleSettings()
    numbers = np.atleast_1d(np.asarray(seeds))
    starts = (
        list(start) if isinstance(start, Sequence) else [] if start is None else [start]
    )
    feedback = _feedback(starts[0] if len(starts) == 1 else None, model, task)
    groups = np.split(numbers, range(asked.group, len(numbers), asked.group))
    runs = [
        _Search(
            Engine(model, len(one), task, randomisation),
            one,
            feedback,
            asked,
            randomisation,
        ).run(starts or [feedback])
        for one in groups
    ]
    joined = (
        np.concatenate([getattr(one, item.name) for one in runs])
        for item in fields(OracleRun)
    )
    return OracleRun(*joined)


class _Ships:
    """Ships under plain feedback of their true state, with something added to their rudder."""

    def __init__(self, engine: Engine, feedback: Controller) -> None:
        self.engine, self.feedback = engine, feedback
        self.reach = observation_scales(engine.model)[-1]
        self.rudder = np.zeros(engine.num_envs, dtype=np.float32)
        self.begin()

    def begin(self) -> None:
        """Note that episodes begin."""
        self.integral = np.zeros(
            self.engine.num_envs
        )  # of the heading error by the task's rule, rad s
        self.over = np.zeros(self.engine.num_envs, dtype=np.bool_)

    def steer(self, added: Floats) -> Floats:
        """One control interval; the rewards."""
        self.rudder = np.clip(self.held() + added, -1.0, 1.0).astype(np.float32)
        _, rewards, terminated, truncated = self.engine.step(self.rudder[:, None])
        self.gather()
        self.over |= terminated | truncated
        return rewards

    def gather(self) -> None:
        """Add the heading error of the last interval to its integral."""
        error = self.engine.info("heading_error")
        gathered = np.where(
            self.over | (np.abs(error) > INTEGRAL_ZONE), 0.0, error * self.engine.dt
        )
        self.integral = np.clip(self.integral + gathered, -self.reach, self.reach)

    def held(self) -> Floats:
        """Rudder by feedback of the true state, parts of the limit, shape (num_envs,)."""
        known, state = self.feedback, self.engine.physical_state()
        deviations = {
            "heading_error": wrapped(state["set_point"] - state["psi"]),
            "yaw_rate": state["r"],
            "sway": state["v"] - known.neutral_sway,
            "rudder": state["delta"] - known.neutral_rudder,
            "heading_error_integral": self.integral,
        }
        order = np.full(self.engine.num_envs, known.neutral_rudder)
        for gain, (signal, sign) in known.feedback.items():
            order += sign * known.gains[gain] * deviations[signal]
        limit = known.observation_scales[known.observation_names.index("rudder")]
        return np.clip(order / limit, -1.0, 1.0)

    def copy(self, source: _Ships, lanes: NDArray[np.int64], keep_course: bool) -> None:
        """Become copies of other ships, which are not ordered another course if they shall keep theirs."""
        copy_lanes(self.engine, source.engine, lanes)
        self.integral, self.over = source.integral[lanes], source.over[lanes]
        if keep_course:
            self.engine.write("next_change", np.inf)


class _Search:
    """A group of episodes and the copies on which their candidates are tried."""

    def __init__(
        self,
        engine: Engine,
        seeds: NDArray[Any],
        feedback: Controller,
        settings: OracleSettings,
        randomisation: Randomisation | None,
    ) -> None:
        self.task, self.seeds, self.settings, self.randomisation = (
            engine.task,
            seeds,
            settings,
            randomisation,
        )
        self.n = len(seeds)
        self.ships = _Ships(engine, feedback)
        self._sizes: dict[int, _Ships] = {}
        self._changes_course = not engine.task.follows_path
        self._ordered = np.zeros(
            (self.n, engine.task.episode_steps), dtype=np.bool_
        )  # a new course at this step

    def run(self, starts: Sequence[Policy]) -> OracleRun:
        """Start from the best of some autopilots' sequences and improve it in passes."""
        costs, added, actions = self._steered_by(starts[0])
        best = OracleRun(costs, costs.copy(), actions)
        for start in starts[1:]:
            found, plan, rudder = self._steered_by(start)
            self._keep_better(best, added, found, plan, rudder)
        best.start_costs[:] = best.costs
        self._keep_better(best, added, *self._sailed(np.zeros_like(added)))
        for number in range(self.settings.passes):
            self._keep_better(best, added, *self._pass(added, number))
        return best

    def _keep_better(
        self,
        best: OracleRun,
        added: Floats,
        costs: Floats,
        plan: Floats,
        actions: Rudder,
    ) -> None:
        """Put a plan in the place of one that costs more."""
        better = costs < best.costs
        added[better] = plan[better]
        best.costs[better], best.actions[better] = costs[better], actions[better]

    def _steered_by(self, policy: Policy) -> tuple[Floats, Floats, Rudder]:
        """Cost of an autopilot, what it adds to the feedback's rudder, and its rudder."""
        held: list[Floats] = []

        def look(observations: NDArray[np.float32]) -> NDArray[np.float32]:
            self.ships.gather() if held else self.ships.begin()
            held.append(self.ships.held())
            return observations

        run = rollout(
            policy, self.ships.engine, self.seeds, record=("set_point",), show=look
        )
        _, added, actions = self._nothing_yet()
        steps = len(held)
        actions[:, :steps] = run.actions[:, :, 0].T
        added[:, :steps] = actions[:, :steps] - np.array(held).T
        self._ordered[:, 0] = True
        self._ordered[:, 1:steps] = (
            np.diff(run.states["set_point"][:steps], axis=0) != 0.0
        ).T
        return run.costs, added, actions

    def _sailed(self, added: Floats) -> tuple[Floats, Floats, Rudder]:
        """Cost, plan and rudder of a plan that is kept to."""
        costs, _, actions = self._nothing_yet()
        for step in self._steps():
            costs -= self.ships.steer(added[:, step])
            actions[:, step] = self.ships.rudder
        return costs, added, actions

    def _steps(self) -> Iterator[int]:
        """Control intervals until all episodes are over, from their beginning on."""
        self.ships.engine.reset(self.seeds)
        self.ships.begin()
        for step in range(self.task.episode_steps):
            if self.ships.over.all():
                return
            yield step

    def _nothing_yet(self) -> tuple[Floats, Floats, Rudder]:
        shape = (self.n, self.task.episode_steps)
        return np.zeros(self.n), np.zeros(shape), np.zeros(shape, dtype=np.float32)

    def _pass(self, last: Floats, number: int) -> tuple[Floats, Floats, Rudder]:
        """Go through the episodes once, planning anew as they go on; begins with the `last` plan."""
        costs, added, actions = self._nothing_yet()
        next_plan = np.zeros(self.n, dtype=np.int64)
        for step in self._steps():
            for lane in (
                np.flatnonzero(self._ordered[:, step])
                if self._changes_course or step == 0
                else ()
            ):
                added[lane, step:] = 0.0
                end = self._next_order(int(lane), step)
                added[lane, step:end] = last[lane, step:end]
                next_plan[lane] = step
            due = np.flatnonzero((next_plan <= step) & ~self.ships.over)
            if len(due):
                self._plan(added, due, step, number)
                next_plan[due] = step + self.settings.replan_steps
            costs -= self.ships.steer(added[:, step])
            actions[:, step] = self.ships.rudder
        return costs, added, actions

    def _next_order(self, lane: int, step: int) -> int:
        """Step of the next course change, beyond which there is no plan yet."""
        if not self._changes_course:
            return self.task.episode_steps
        later = np.flatnonzero(self._ordered[lane, step + 1 :])
        return step + 1 + int(later[0]) if len(later) else self.task.episode_steps

    def _plan(
        self, added: Floats, which: NDArray[np.int64], step: int, number: int
    ) -> None:
        """Improve the plan of some episodes from a step on by the cross-entropy method."""
        asked, episodes = self.settings, np.arange(len(which))
        shape = self._shape(step)
        random = np.random.default_rng((number, step))
        mean = np.zeros((len(which), len(shape)))
        deviation = np.full_like(mean, asked.deviation * 0.5**number)
        least, change = np.full(len(which), np.inf), np.zeros_like(mean)
        for _ in range(asked.iterations):
            knots = mean[:, None] + deviation[:, None] * _drawn(
                random, asked.candidates, len(shape)
            )
            knots[:, 0] = change
            costs = self._tried(added[which], which, knots, shape, step)
            order = np.argsort(costs, axis=1, kind="stable")
            best = order[:, 0]
            better = costs[episodes, best] < least
            least[better] = costs[episodes, best][better]
            change[better] = knots[episodes, best][better]
            elites = np.take_along_axis(knots, order[:, : asked.elites, None], axis=1)
            mean += LEARNING * (elites.mean(axis=1) - mean)
            deviation += LEARNING * (
                np.maximum(elites.std(axis=1), LEAST_DEVIATION) - deviation
            )
        added[which, step : step + shape.shape[1]] += (change[:, None] @ shape)[:, 0]

    def _shape(self, step: int) -> Floats:
        """Change of the plan per knot, shape (n_knots, n_steps): straight between knots, 0 at the end."""
        count = min(self.settings.plan_steps, self.task.episode_steps - step)
        at = np.arange(count) / self.settings.knot_steps
        n_knots = -(-self.settings.plan_steps // self.settings.knot_steps)
        return np.maximum(0.0, 1.0 - np.abs(at - np.arange(n_knots)[:, None]))

    def _tried(
        self,
        added: Floats,
        which: NDArray[np.int64],
        knots: Floats,
        shape: Floats,
        step: int,
    ) -> Floats:
        """Costs of candidates over the horizon, shape (n_episodes, n_candidates)."""
        copies = self._copies(len(which))
        copies.copy(self.ships, np.repeat(which, knots.shape[1]), self._changes_course)
        changes = (knots @ shape).reshape(len(copies.over), -1)
        costs = np.zeros(len(copies.over))
        last = min(step + self.settings.horizon_steps, self.task.episode_steps)
        for now in range(step, last):
            asked = np.repeat(added[:, now], knots.shape[1])
            if now - step < shape.shape[1]:
                asked += changes[:, now - step]
            costs -= copies.steer(asked)
        return costs.reshape(knots.shape[:2])

    def _copies(self, episodes: int) -> _Ships:
        """Ships for the candidates of so many episodes."""
        if episodes not in self._sizes:
            own, n = self.ships.engine, episodes * self.settings.candidates
            self._sizes[episodes] = _Ships(
                Engine(own.model, n, self.task, self.randomisation), self.ships.feedback
            )
        return self._sizes[episodes]


def _feedback(start: Policy | None, model: ShipModel, task: Task) -> Controller:
    """The start itself, or the autopilot it leads, if it is plain feedback; else LQ."""
    inner = getattr(start, "autopilot", start)
    return (
        inner
        if isinstance(inner, PID | LQ)
        else LQ.from_model(model, dt=task.interval(model))
    )


def _drawn(random: np.random.Generator, candidates: int, n_knots: int) -> Floats:
    """Changes of unit deviation, coarse and fine, each with its mirror image, shape (candidates, n_knots)."""
    half = -(-candidates // 2)
    drawn = random.standard_normal((half, n_knots))
    drawn *= np.geomspace(LEAST_SCALE, 1.0, half)[:, None]
    return np.concatenate([drawn, -drawn])[:candidates]
