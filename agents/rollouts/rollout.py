"""The one loop in which a policy steers ships through episodes of a task, side by side."""

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Policy
from shipgym import InputError, ShipModel
from shipgym.arrays import Flags, Floats
from shipgym.envs.engine import Engine
from shipgym.tasks.task import Task


@dataclass(frozen=True, eq=False)
class Rollout:
    """The course and results of some episodes of a task.

    Attributes
    ----------
    task : Task
        What was asked.
    model : ShipModel
        The ship, the first of several.
    dt : float
        Control interval, s.
    seeds : int array of shape (n,)
    costs : array of shape (n,)
        Minus the sum of the rewards, up to where the policy failed.
    sailing : bool array of shape (n_steps, n)
        Whether the episode was running in the interval; what is recorded of the others
        is meaningless.
    terminated, truncated, failed : bool array of shape (n,)
        How the episode ended; the last: because the policy gave no command.
    failure : str
        How the policy failed first; empty if it did not.
    seconds_per_action : float
        Process time of `predict` over the number of commands it gave, in a batch.
    actions, rewards : array of shape (n_steps, n, n_commands), and (n_steps, n)
        Of each interval; without steps if nothing was recorded.
    states, infos : dict of str to array of shape (n_steps + 1, n)
        Physical states and entries of `info` that were recorded, from the beginning on.
    """

    task: Task
    model: ShipModel
    dt: float
    seeds: NDArray[np.int64]
    costs: Floats
    sailing: Flags
    terminated: Flags
    truncated: Flags
    failed: Flags
    failure: str
    seconds_per_action: float
    actions: NDArray[np.float32]
    rewards: Floats
    states: dict[str, Floats]
    infos: dict[str, Floats]

    @property
    def steps(self) -> Floats:
        """Intervals of each episode, shape (n,)."""
        return np.asarray(self.sailing.sum(axis=0, dtype=np.float64))


def rollout(
    policy: Policy,
    engine: Engine,
    seeds: ArrayLike,
    *,
    record: bool | Collection[str] = False,
    tolerant: bool = False,
    show: Callable[[NDArray[np.float32]], NDArray[np.float32]] | None = None,
) -> Rollout:
    """Steer the ships of an engine through one episode each.

    Returns the same for the same arguments; only the time differs. Raises InputError if
    the policy gives no finite command for each ship, unless `tolerant`.

    Parameters
    ----------
    policy : Policy
        Anything with `predict`; it is given the observations of all ships together.
    engine : Engine
        With a lane for each seed.
    seeds : array-like of int, shape (n,)
        Of the episodes.
    record : bool or collection of str
        Names of physical states and of entries of `info` to record; True for all.
    tolerant : bool
        Whether a policy that raises an error, or gives NaN or no command for each ship,
        ends the episodes that it fails in and the others go on; otherwise that is an
        error.
    show : callable, optional
        What the policy is shown in place of the observations; asked before each
        command.
    """
    log = _Log(engine, record, tolerant)
    seen, memory, starts = engine.reset(seeds), None, log.sailing
    log.look()
    while log.sailing.any():
        command, memory = log.ask(
            policy, seen if show is None else show(seen), memory, starts
        )
        if not log.sailing.any():  # the policy has failed in all episodes
            break
        seen, rewards, terminated, truncated = engine.step(command)
        log.note(command, rewards, terminated, truncated)
        starts = np.zeros(engine.num_envs, dtype=np.bool_)
    return log.rollout(np.asarray(seeds))


def episode_costs(policy: Policy, engine: Engine, seeds: NDArray[np.int64]) -> Floats:
    """Cost of each episode, minus the sum of its rewards, shape (n,); see `rollout`."""
    return rollout(policy, engine, seeds).costs


def check_fits(policy: Any, task: Task, ship: ShipModel, where: str) -> None:
    """Refuse a policy made for other observations than a task shows of a ship.

    `policy`: without a method `check_fits` it steers by anything; `where`: start of the
    message. Raises InputError naming the first difference.
    """
    check = getattr(policy, "check_fits", None)
    if check is not None:
        shown = task.observed(ship)
        check([one.name for one in shown], [one.scale for one in shown], where)


class _Log:
    """What has become of the episodes so far."""

    def __init__(
        self, engine: Engine, record: bool | Collection[str], tolerant: bool
    ) -> None:
        self.engine, self.record, self.tolerant = engine, record, tolerant
        self.names = [name for name in engine.task.info_names if self._keeps(name)]
        self.sailing = np.ones(engine.num_envs, dtype=np.bool_)
        self.terminated = self.truncated = self.failed = ~self.sailing
        self.costs = np.zeros(engine.num_envs)
        self.failure, self.seconds, self.asked = "", 0.0, 0
        self.sailed: list[Flags] = []
        self.intervals: list[tuple[NDArray[np.float32], Floats]] = []
        self.states: list[dict[str, Floats]] = []
        self.infos: list[list[Floats]] = []

    def _keeps(self, name: str) -> bool:
        return self.record if isinstance(self.record, bool) else name in self.record

    def look(self) -> None:
        """Record where the ships are."""
        if self.record:
            state = self.engine.physical_state()
            self.states.append(
                {name: values for name, values in state.items() if self._keeps(name)}
            )
            self.infos.append([self.engine.info(name).copy() for name in self.names])

    def ask(
        self, policy: Policy, shown: Any, memory: Any, starts: Flags
    ) -> tuple[NDArray[np.float32], Any]:
        """A policy's commands, 0 for ships that do not sail; episodes without a command have failed."""
        began, why = time.process_time(), ""
        try:
            actions, memory = policy.predict(shown, memory, starts, True)
        except Exception as error:  # whatever a user's policy raises
            if not self.tolerant:
                raise
            actions, why = (
                None,
                f"{type(error).__name__}: {error} (at step {len(self.sailed)})",
            )
        self.seconds += time.process_time() - began
        self.asked += int(self.sailing.sum())
        command, bad, found = self._commands(actions)
        if bad.any():
            if not self.tolerant:
                raise InputError(f"{type(policy).__name__}.predict: {found}")
            self.failure = self.failure or why or found
            self.failed, self.sailing = self.failed | bad, self.sailing & ~bad
        command[~self.sailing] = 0.0
        return command, memory

    def _commands(self, actions: Any) -> tuple[NDArray[np.float32], Flags, str]:
        """Commands, of which ships that sail there is none, and why."""
        expected, at = (
            (self.engine.num_envs, len(self.engine.command)),
            f"found at step {len(self.sailed)}",
        )
        nothing = np.zeros(expected, dtype=np.float32)
        try:
            with np.errstate(over="ignore"):
                found = np.array(actions, dtype=np.float32)
        except (TypeError, ValueError):
            return (
                nothing,
                self.sailing,
                f"actions of type {type(actions).__name__} {at}, expected numbers",
            )
        if found.shape != expected:
            seen = f"for observations of shape {self.engine.observations.shape}"
            return (
                nothing,
                self.sailing,
                f"actions of shape {found.shape} {at}, expected {expected} {seen}",
            )
        wrong = self.sailing[:, None] & ~np.isfinite(found)
        bad: Flags = np.any(wrong, axis=1)
        if not bad.any():
            return found, bad, ""
        said = (
            f"action {found[wrong][0]} {at} for ship {np.argmax(bad)}: no finite number"
            f" for {bad.sum()} of {self.sailing.sum()} ships, expected numbers in [-1,"
            " 1], the command over its limit; look for a division by zero in the"
            " controller"
        )
        return found, bad, said

    def note(
        self,
        command: NDArray[np.float32],
        rewards: Floats,
        terminated: Flags,
        truncated: Flags,
    ) -> None:
        """Note what came of an interval."""
        self.sailed.append(self.sailing)
        self.costs -= np.where(self.sailing, rewards, 0.0)
        self.terminated = self.terminated | self.sailing & terminated
        self.truncated = self.truncated | self.sailing & truncated
        if self.record:
            self.intervals.append((command, rewards))
        self.look()
        self.sailing = self.sailing & ~(terminated | truncated)

    def rollout(self, seeds: NDArray[np.int64]) -> Rollout:
        """All that was noted."""
        engine, n = self.engine, self.engine.num_envs
        actions, rewards = (
            zip(*self.intervals, strict=True) if self.intervals else ((), ())
        )
        return Rollout(
            task=engine.task,
            model=engine.model,
            dt=engine.dt,
            seeds=seeds,
            costs=self.costs,
            sailing=np.array(self.sailed, dtype=np.bool_).reshape(-1, n),
            terminated=self.terminated,
            truncated=self.truncated,
            failed=self.failed,
            failure=self.failure,
            seconds_per_action=self.seconds / max(self.asked, 1),
            actions=np.array(actions, dtype=np.float32).reshape(
                -1, n, len(engine.command)
            ),
            rewards=np.array(rewards).reshape(-1, n),
            states={
                name: np.array([one[name] for one in self.states])
                for name in (self.states or [{}])[0]
            },
            infos={
                name: np.array([one[k] for one in self.infos])
                for k, name in enumerate(self.names)
            },
        )
