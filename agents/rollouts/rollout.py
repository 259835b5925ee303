"""The loop in which a policy steers ships through episodes of a task, side by side."""

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.interface import Policy
from shipgym import InputError, ShipModel
from shipgym.arrays import Flags, Floats
from shipgym.envs.engine import Engine, episode_keys
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
        Sum of the steering costs (`info["cost"]`), up to where the policy failed.
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
        Of each interval; without steps if nothing was recorded. The rewards are those
        of an environment made with `bounded=False`, minus the costs.
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
    number: int = 0,
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
    number : int
        Number of the episodes under their seeds: a lane that sails on has them one
        after another.
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
    log = _Log(engine, record)
    helmsman = _Helmsman(policy, tolerant)
    observations = engine.begin(episode_keys(seeds), number)
    log.look()

    starts = log.sailing
    while log.sailing.any():
        seen = observations
        if show is not None:
            seen = show(observations)
        command = helmsman.steer(seen, starts, log.sailing, engine)
        log.give_up(command.missing)
        if not log.sailing.any():  # the policy has failed in all episodes
            break
        observations, _, terminated, truncated = engine.step(command.values)
        log.note(command.values, terminated, truncated)
        starts = np.zeros_like(starts)
    return log.rollout(np.asarray(seeds), helmsman)


def episode_costs(policy: Policy, engine: Engine, seeds: NDArray[np.int64]) -> Floats:
    """Steering cost of each episode, shape (n,); see `rollout`."""
    return rollout(policy, engine, seeds).costs


class _Command(NamedTuple):
    """Answer of a policy for all ships."""

    values: NDArray[np.float32]  # shape (n, n_commands); 0 for ships that do not sail
    missing: Flags  # ships that sail without a command
    fault: str  # what is wrong with the answer; empty if nothing


class _Helmsman:
    """Asks a policy for commands; keeps its memory, its first failure and its time."""

    def __init__(self, policy: Policy, tolerant: bool) -> None:
        self.policy = policy
        self.tolerant = tolerant
        self.memory: Any = None
        self.failure = ""
        self.seconds = 0.0
        self.n_calls = 0
        self.n_commands = 0

    def steer(
        self, seen: Any, starts: Flags, sailing: Flags, engine: Engine
    ) -> _Command:
        """Commands for what is seen; InputError for a failure that is not tolerated."""
        where = f"step {self.n_calls}"
        self.n_calls += 1
        self.n_commands += int(sailing.sum())

        actions, error = self._answer(seen, starts)
        shape = (engine.num_envs, len(engine.command))
        command = _checked_command(actions, shape, sailing)
        if not command.fault:
            return command

        if not self.tolerant:
            name = type(self.policy).__name__
            raise InputError(f"{name}.predict: {where}: {command.fault}")
        if not self.failure:
            self.failure = f"{where}: {error or command.fault}"
        return command

    def _answer(self, seen: Any, starts: Flags) -> tuple[Any, str]:
        """Actions, None after an error that is tolerated, and this error."""
        actions = None
        failure = ""
        began = time.process_time()
        try:
            actions, self.memory = self.policy.predict(seen, self.memory, starts, True)
        except Exception as error:  # whatever a user's policy raises
            if not self.tolerant:
                raise
            failure = f"{type(error).__name__}: {error}"
        self.seconds += time.process_time() - began
        return actions, failure


def _checked_command(actions: Any, shape: tuple[int, int], sailing: Flags) -> _Command:
    """Command from what a policy returned."""
    nothing = _Command(np.zeros(shape, dtype=np.float32), sailing, "")
    try:
        with np.errstate(over="ignore"):
            values = np.array(actions, dtype=np.float32)
    except (TypeError, ValueError):
        fault = f"expected an array of numbers, got {type(actions).__name__}"
        return nothing._replace(fault=fault)
    if values.shape != shape:
        fault = f"expected actions of shape {shape}, got {values.shape}"
        return nothing._replace(fault=fault)

    is_finite = np.isfinite(values).all(axis=1)
    missing = sailing & ~is_finite
    fault = ""
    if missing.any():
        first = int(np.argmax(missing))
        n_missing = missing.sum()
        n_sailing = sailing.sum()
        fault = (
            f"expected numbers in [-1, 1], got {values[first]} for ship {first}: no"
            f" finite number for {n_missing} of {n_sailing} ships; look for a"
            " division by zero in the controller"
        )
    values[missing | ~sailing] = 0.0
    return _Command(values, missing, fault)


class _Log:
    """Record of the episodes so far."""

    def __init__(self, engine: Engine, record: bool | Collection[str]) -> None:
        self.engine = engine
        self.record = record

        none: Flags = np.zeros(engine.num_envs, dtype=np.bool_)
        self.sailing = ~none
        self.terminated = none
        self.truncated = none
        self.failed = none
        self.costs = np.zeros(engine.num_envs)

        self.sailed: list[Flags] = []
        self.actions: list[NDArray[np.float32]] = []
        self.rewards: list[Floats] = []
        self.states: list[dict[str, Floats]] = []
        self.infos: list[dict[str, Floats]] = []

    def _keeps(self, name: str) -> bool:
        return self.record if isinstance(self.record, bool) else name in self.record

    def look(self) -> None:
        """Record where the ships are."""
        if not self.record:
            return
        states = {}
        for name, values in self.engine.physical_state().items():
            if self._keeps(name):
                states[name] = values
        self.states.append(states)

        infos = {}
        for name in self.engine.task.info_names:
            if self._keeps(name):
                infos[name] = self.engine.info(name).copy()
        self.infos.append(infos)

    def give_up(self, missing: Flags) -> None:
        """End episodes whose ships got no command."""
        self.failed = self.failed | missing
        self.sailing = self.sailing & ~missing

    def note(
        self,
        command: NDArray[np.float32],
        terminated: Flags,
        truncated: Flags,
    ) -> None:
        """Note what came of an interval."""
        rewards = -self.engine.info("cost")
        self.sailed.append(self.sailing)
        self.costs -= np.where(self.sailing, rewards, 0.0)
        self.terminated = self.terminated | (self.sailing & terminated)
        self.truncated = self.truncated | (self.sailing & truncated)
        if self.record:
            self.actions.append(command)
            self.rewards.append(rewards)
        self.look()
        self.sailing = self.sailing & ~(terminated | truncated)

    def rollout(self, seeds: NDArray[np.int64], helmsman: _Helmsman) -> Rollout:
        """All that was noted."""
        engine = self.engine
        n = engine.num_envs
        n_commands = len(engine.command)
        actions = np.array(self.actions, dtype=np.float32)
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
            failure=helmsman.failure,
            seconds_per_action=helmsman.seconds / max(helmsman.n_commands, 1),
            actions=actions.reshape(-1, n, n_commands),
            rewards=np.array(self.rewards).reshape(-1, n),
            states=_stacked(self.states),
            infos=_stacked(self.infos),
        )


def _stacked(records: list[dict[str, Floats]]) -> dict[str, Floats]:
    """Histories by name, each of shape (n_records, n)."""
    if not records:
        return {}
    histories = {}
    for name in records[0]:
        values = [record[name] for record in records]
        histories[name] = np.array(values)
    return histories
