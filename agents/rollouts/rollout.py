"""The loop in which a policy steers ships through episodes of a task, side by side."""

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

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
    log = _Log(engine, record)
    helmsman = _Helmsman(policy, tolerant)
    observations = engine.begin(episode_keys(seeds), 0)
    log.look()

    starts = log.sailing
    while log.sailing.any():
        seen = observations
        if show is not None:
            seen = show(observations)
        commands, missing = helmsman.steer(
            seen, starts, log.sailing, len(engine.command)
        )
        log.give_up(missing)
        if not log.sailing.any():  # the policy has failed in all episodes
            break
        observations, _, terminated, truncated = engine.step(commands)
        log.note(commands, terminated, truncated)
        starts = np.zeros_like(starts)
    return log.rollout(np.asarray(seeds), helmsman)


def episode_costs(policy: Policy, engine: Engine, seeds: NDArray[np.int64]) -> Floats:
    """Steering cost of each episode, shape (n,); see `rollout`."""
    return rollout(policy, engine, seeds).costs


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
        self, seen: Any, starts: Flags, sailing: Flags, n_commands: int
    ) -> tuple[NDArray[np.float32], Flags]:
        """Commands of shape (n, n_commands), and the ships that sail without one.

        They are 0 for ships that do not sail. Raises InputError for a failure that is
        not tolerated.
        """
        where = f"step {self.n_calls}"
        self.n_calls += 1
        self.n_commands += int(sailing.sum())
        values = np.zeros((len(sailing), n_commands), dtype=np.float32)
        missing = sailing
        fault = ""
        began = time.process_time()
        try:
            actions, self.memory = self.policy.predict(seen, self.memory, starts, True)
        except Exception as error:  # whatever a user's policy raises
            if not self.tolerant:
                raise
            fault = f"{type(error).__name__}: {error}"
        self.seconds += time.process_time() - began
        if not fault:
            given, fault = _numbers(actions, values.shape)
            missing = sailing & ~np.isfinite(given).all(axis=1)
            values = np.where((sailing & ~missing)[:, None], given, values)
            fault = fault or _no_number(given, missing, sailing)

        if fault and not self.tolerant:
            raise InputError(f"{type(self.policy).__name__}.predict: {where}: {fault}")
        if fault and not self.failure:
            self.failure = f"{where}: {fault}"
        return values, missing


def _numbers(actions: Any, shape: tuple[int, int]) -> tuple[NDArray[np.float32], str]:
    """What a policy returned as numbers, else NaN, and what is wrong with it."""
    nothing = np.full(shape, np.nan, dtype=np.float32)
    try:
        with np.errstate(over="ignore"):
            values = np.array(actions, dtype=np.float32)
    except (TypeError, ValueError):
        return nothing, f"expected an array of numbers, got {type(actions).__name__}"
    if values.shape != shape:
        return nothing, f"expected actions of shape {shape}, got {values.shape}"
    return values, ""


def _no_number(values: NDArray[np.float32], missing: Flags, sailing: Flags) -> str:
    """What is wrong with commands that are not finite; empty if all are."""
    if not missing.any():
        return ""
    first = int(np.argmax(missing))
    return (
        f"expected numbers in [-1, 1], got {values[first]} for ship {first}: no finite"
        f" number for {missing.sum()} of {sailing.sum()} ships; look for a division by"
        " zero in the controller"
    )


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
