"""The loop in which a policy steers ships through episodes of a task, side by side."""

from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.interface import Policy, read_commands
from shipgym import InputError, ShipModel
from shipgym.arrays import Flags, Floats
from shipgym.envs.engine import Engine, episode_keys
from shipgym.python_files import told
from shipgym.tasks.task import Task

Histories = dict[str, Floats]


class Rollout(NamedTuple):
    """The course and results of some episodes of a task.

    Attributes
    ----------
    task : Task
        What was asked.
    model : ShipModel
        The ship, the first of several.
    dt : float
        Control interval, s.
    costs : array of shape (n,)
        Sum of the steering costs (`info["cost"]`), up to where the policy failed.
    sailing : bool array of shape (n_steps, n)
        Whether the episode was running in the interval; what is recorded of the others
        is meaningless.
    terminated, failed : bool array of shape (n,)
        Whether the episode ended before its time, and because the policy gave no
        command.
    failure : str
        How the policy failed first; empty if it did not.
    histories : dict of str to array of shape (n_steps + 1, n)
        Physical states and entries of `info` that were recorded, from the beginning on.
    """

    task: Task
    model: ShipModel
    dt: float
    costs: Floats
    sailing: Flags
    terminated: Flags
    failed: Flags
    failure: str
    histories: Histories

    @property
    def steps(self) -> Floats:
        """Intervals of each episode, shape (n,)."""
        return np.asarray(self.sailing.sum(axis=0, dtype=np.float64))


def rollout(
    policy: Policy,
    engine: Engine,
    seeds: ArrayLike,
    *,
    record: Collection[str] = (),
    tolerant: bool = False,
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
    record : collection of str
        Names of physical states and of entries of `info` to record.
    tolerant : bool
        Whether a policy that raises an error, or gives NaN or no command for each ship,
        ends the episodes that it fails in and the others go on; otherwise that is an
        error.
    """
    n = engine.num_envs
    helmsman = _Helmsman(policy, tolerant)
    observations = engine.begin(episode_keys(seeds), 0)
    looks = [_look(engine, record)]
    sailing = starts = np.ones(n, dtype=np.bool_)
    ended = failed = np.zeros(n, dtype=np.bool_)
    costs = np.zeros(n)
    sailed = []
    while sailing.any():
        commands, missing = helmsman.steer(
            observations, starts, sailing, len(engine.command)
        )
        failed = failed | missing
        sailing = sailing & ~missing
        if not sailing.any():  # the policy has failed in all episodes
            break
        observations, _, terminated, truncated = engine.step(commands)
        sailed.append(sailing)
        costs += np.where(sailing, engine.info("cost"), 0.0)
        ended = ended | (sailing & terminated)
        looks.append(_look(engine, record))
        sailing = sailing & ~(terminated | truncated)
        starts = np.zeros_like(starts)
    return Rollout(
        task=engine.task,
        model=engine.model,
        dt=engine.dt,
        costs=costs,
        sailing=np.array(sailed, dtype=np.bool_).reshape(-1, n),
        terminated=ended,
        failed=failed,
        failure=helmsman.failure,
        histories={name: np.array([one[name] for one in looks]) for name in looks[0]},
    )


def _look(engine: Engine, recorded: Collection[str]) -> Histories:
    """Physical states and entries of `info` that are recorded, now."""
    if not recorded:
        return {}
    states = engine.physical_state()
    infos = engine.task.info_names
    found = {}
    for name in recorded:
        if name in infos:
            found[name] = engine.info(name).copy()
        elif name in states:
            found[name] = np.array(states[name])
    return found


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
        self.n_calls = 0

    def steer(
        self, seen: Any, starts: Flags, sailing: Flags, n_commands: int
    ) -> tuple[NDArray[np.float32], Flags]:
        """Commands of shape (n, n_commands), and the ships that sail without one.

        They are 0 for ships that do not sail. Raises InputError for a failure that is
        not tolerated.
        """
        where = f"step {self.n_calls}"
        self.n_calls += 1
        values = np.zeros((len(sailing), n_commands), dtype=np.float32)
        missing = sailing
        fault = ""
        try:
            actions, self.memory = self.policy.predict(seen, self.memory, starts, True)
        except Exception as error:  # whatever a user's policy raises
            if not self.tolerant:
                raise
            fault = told(error)
        if not fault:
            given, fault = read_commands(actions, values.shape)
            missing = sailing & ~np.isfinite(given).all(axis=1)
            values = np.where((sailing & ~missing)[:, None], given, values)
            if missing.any() and not fault:
                ship = int(np.argmax(missing))
                fault = (
                    f"expected numbers in [-1, 1], got {given[ship]} for ship {ship};"
                    " look for a division by zero in the controller"
                )
            beyond = self.tolerant and np.abs(values).max(initial=0.0) > 1.0 + 1e-6
            if beyond and not fault:
                fault = "expected numbers in [-1, 1], got others, which are limited"

        if fault and not self.tolerant:
            raise InputError(f"{type(self.policy).__name__}.predict: {where}: {fault}")
        if fault and not self.failure:
            self.failure = f"{where}: {fault}"
        return values, missing
