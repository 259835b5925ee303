"""The one loop in which a policy steers ships through episodes of a task, side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Policy
from agents.policies.shield import ShieldState, interventions
from shipgym.envs.engine import Engine
from shipgym.envs.task import Task
from shipgym.errors import InputError
from shipgym.ships import ShipModel

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Rollout:
    """What became of some episodes of a task.

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
        Whether the episode was going on in the interval; what is recorded of the others means nothing.
    terminated, truncated, failed : bool array of shape (n,)
        How the episode ended; the last: because the policy gave no command.
    failure : str
        How the policy failed first; empty if it did not.
    seconds_per_action : float
        Process time of `predict` over the number of commands it gave, in a batch.
    actions, rewards, shielded : array of shape (n_steps, n, n_commands), and twice (n_steps, n)
        Of each interval, the last whether a safety shield steered; without steps if nothing was recorded.
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
    shielded: Flags
    states: dict[str, Floats]
    infos: dict[str, Floats]

    @property
    def steps(self) -> Floats:
        """Intervals of each episode, shape (n,)."""
        steps: Floats = self.sailing.sum(axis=0, dtype=np.float64)
        return steps


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
        Whether a policy that raises an error, or gives NaN or no command for each ship, ends the episodes
        that it fails in and the others go on; otherwise that is an error.
    show : callable, optional
        What the policy is shown in place of the observations; asked before each command.

    Returns
    -------
    Rollout
        The same for the same arguments; only the time differs.

    Raises
    ------
    InputError
        If the policy gives no finite command for each ship, unless `tolerant`.
    """
    log, n = _Log(engine, record), engine.num_envs
    sailing, terminated, truncated, failed = (np.full(n, begun) for begun in (True, False, False, False))
    seen, memory, starts = engine.reset(seeds), None, sailing
    costs, spent, asked, failure = np.zeros(n), 0.0, 0, ""
    log.look()
    while sailing.any():
        shown, error = seen if show is None else show(seen), ""
        began = time.process_time()
        try:
            actions, memory = policy.predict(shown, memory, starts, True)
        except Exception as raised:  # whatever a user's policy raises is its own failure
            if not tolerant:
                raise
            actions, error = None, f"{type(raised).__name__}: {raised} (at step {len(log.sailing)})"
        spent, asked = spent + time.process_time() - began, asked + int(sailing.sum())
        command, bad, why = commands(actions, engine, sailing, len(log.sailing))
        if bad.any():
            if not tolerant:
                raise InputError(f"{type(policy).__name__}.predict: {why}")
            failure, failed, sailing = failure or error or why, failed | bad, sailing & ~bad
            if not sailing.any():
                break
        seen, rewards, lost, over = engine.step(command)
        costs -= np.where(sailing, rewards, 0.0)
        log.note(sailing, command, rewards, memory)
        terminated, truncated = terminated | sailing & lost, truncated | sailing & over
        sailing, starts = sailing & ~(lost | over), np.zeros(n, dtype=np.bool_)
    return Rollout(
        task=engine.task,
        model=engine.model,
        dt=engine.dt,
        seeds=np.asarray(seeds),
        costs=costs,
        sailing=np.array(log.sailing, dtype=np.bool_).reshape(-1, n),
        terminated=terminated,
        truncated=truncated,
        failed=failed,
        failure=failure,
        seconds_per_action=spent / max(asked, 1),
        **log.arrays(),
    )


def episode_costs(policy: Policy, engine: Engine, seeds: NDArray[np.int64]) -> Floats:
    """Cost of each episode: minus the sum of its rewards (see `rollout`).

    Returns
    -------
    array of shape (n,)

    Raises
    ------
    InputError
        If the policy answers with something that is not a finite command for each ship.
    """
    return rollout(policy, engine, seeds).costs


def commands(
    actions: Any, engine: Engine, sailing: Flags, step: int
) -> tuple[NDArray[np.float32], Flags, str]:
    """What is commanded, of which of the ships that sail it is no command, and why.

    Parameters
    ----------
    actions
        What the policy handed back.
    engine : Engine
        Tells the shape that is expected.
    sailing : bool array of shape (n,)
        Ships whose episode is not over; the command of the others is 0.
    step : int
        For the message.
    """
    expected = (engine.num_envs, len(engine.command))
    nothing = np.zeros(expected, dtype=np.float32)
    try:
        with np.errstate(over="ignore"):
            found = np.array(actions, dtype=np.float32)
    except (TypeError, ValueError):
        said = f"actions of type {type(actions).__name__} found at step {step}, expected numbers"
        return nothing, sailing.copy(), said
    if found.shape != expected:
        said = (
            f"actions of shape {found.shape} found at step {step}, expected {expected} "
            f"for observations of shape {engine.observations.shape}"
        )
        return nothing, sailing.copy(), said
    bad = sailing & ~np.isfinite(found).all(axis=1)
    said = ""
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        number = found[first][~np.isfinite(found[first])][0]
        said = (
            f"action {number} found at step {step} for ship {first}: no finite number for {int(bad.sum())} "
            f"of {int(sailing.sum())} ships, expected numbers in [-1, 1], the command over its limit; look "
            f"for a division by zero in the controller"
        )
    found[bad | ~sailing] = 0.0
    return found, bad, said


def check_fits(policy: Any, task: Task, ship: ShipModel, where: str) -> None:
    """Refuse a policy made for other observations than a task shows of a ship.

    Parameters
    ----------
    policy : Policy
        Without a method `check_fits` it steers by anything.
    task : Task
    ship : ShipModel
    where : str
        Start of the message.

    Raises
    ------
    InputError
        Naming the first difference.
    """
    check = getattr(policy, "check_fits", None)
    if check is not None:
        shown = task.observed(ship)
        check([one.name for one in shown], [one.scale for one in shown], where)


class _Log:
    """Gathers what is recorded of an engine's ships."""

    def __init__(self, engine: Engine, record: bool | Collection[str]) -> None:
        self.engine, self.record = engine, record
        self.names = [name for name in engine.task.info_names if self._keeps(name)]
        self.sailing: list[Flags] = []
        self.actions: list[NDArray[np.float32]] = []
        self.rewards: list[Floats] = []
        self.shielded: list[Flags] = []
        self.states: list[dict[str, Floats]] = []
        self.infos: list[list[Floats]] = []

    def _keeps(self, name: str) -> bool:
        return self.record if isinstance(self.record, bool) else name in self.record

    def look(self) -> None:
        """Note where the ships are."""
        if self.record:
            state = self.engine.physical_state()
            self.states.append({name: values for name, values in state.items() if self._keeps(name)})
            self.infos.append([self.engine.info(name).copy() for name in self.names])

    def note(self, sailing: Flags, action: NDArray[np.float32], rewards: Floats, memory: Any) -> None:
        """Note what came of an interval."""
        self.sailing.append(sailing)
        if self.record:
            steers = (
                interventions(memory).steering if isinstance(memory, ShieldState) else np.zeros_like(sailing)
            )
            self.actions.append(action)
            self.rewards.append(rewards)
            self.shielded.append(steers)
        self.look()

    def arrays(self) -> dict[str, Any]:
        """All that was gathered, by the names of `Rollout`."""
        n, states = self.engine.num_envs, self.states
        return {
            "actions": np.array(self.actions, dtype=np.float32).reshape(-1, n, len(self.engine.command)),
            "rewards": np.array(self.rewards).reshape(-1, n),
            "shielded": np.array(self.shielded, dtype=np.bool_).reshape(-1, n),
            "states": {name: np.array([one[name] for one in states]) for name in (states or [{}])[0]},
            "infos": {name: np.array([one[k] for one in self.infos]) for k, name in enumerate(self.names)},
        }
