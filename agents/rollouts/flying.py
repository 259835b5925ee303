"""The episodes of a task, flown side by side in the batch engine, whatever the controller does."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import Policy
from agents.policies.shield import ShieldState, interventions
from agents.rollouts.metrics import Recording, metrics
from agents.suites.suite import BenchmarkTask
from shipgym.envs.engine import Engine
from shipgym.envs.path_following_task import PathFollowingTask
from shipgym.kernels import layout
from shipgym.kernels import voyage_rows as rows
from shipgym.ships import ShipModel

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: What is recorded of the outcome of an interval.
COMMON_SERIES = ("heading_error", "extrapolating")
PATH_SERIES = ("cross_track", "distance_made_good", "in_corridor", "grounded", "success")


@dataclass(frozen=True, eq=False)
class Flown:
    """What became of the episodes of one task.

    Attributes
    ----------
    episodes : dict of str to array of shape (n,)
        Figures of each episode (`metrics`).
    seeds : int array of shape (n,)
    failure : str
        How the controller failed first; empty if it did not.
    seconds_per_action : float
        Process time of `predict` over the number of commands it gave; in a batch.
    recording : Recording
        All that was recorded.
    """

    episodes: dict[str, Floats]
    seeds: NDArray[np.int64]
    failure: str
    seconds_per_action: float
    recording: Recording


def fly_task(
    controller: Policy,
    task: BenchmarkTask,
    seeds: ArrayLike | None = None,
    model: ShipModel | None = None,
) -> Flown:
    """Fly the episodes of a task, all at once.

    A controller that hands back NaN, another shape than one command for each ship, or raises an error, has
    failed: in the episodes concerned from then on, costed as if control were lost, and the others go on.

    Parameters
    ----------
    controller : Policy
        Anything with `predict`; it is given the observations of all ships together.
    task : BenchmarkTask
        Of a suite.
    seeds : array-like of int, shape (n,), optional
        By default those that are scored.
    model : ShipModel, optional
        Another ship than the task's own.

    Returns
    -------
    Flown
        The same for the same arguments; only the time differs.
    """
    numbers = np.asarray(task.seeds if seeds is None else seeds, dtype=np.int64)
    engine = task.engine(len(numbers), model)
    log = _Log(engine)
    observations, state = engine.reset(numbers), None
    log.begin()
    starts = np.ones(len(numbers), dtype=np.bool_)
    spent, asked, failure = 0.0, 0, ""
    while log.sailing.any():
        began = time.process_time()
        try:
            answer: Any = controller.predict(observations, state, starts, True)
            actions, state = answer
            wrong = ""
        except Exception as error:  # whatever a user's controller raises is its own failure
            actions, wrong = None, f"{type(error).__name__}: {error}"
        spent, asked = spent + time.process_time() - began, asked + int(log.sailing.sum())
        command, bad, why = commands(actions, engine, log.sailing)
        if bad.any():
            failure = failure or f"step {len(log.counts)}: {wrong or why}"
            log.fail(bad)
            if not log.sailing.any():
                break
        observations, _, terminated, truncated = engine.step(command)
        log.note(_shielded(state, len(numbers)), terminated, truncated)
        starts = np.zeros(len(numbers), dtype=np.bool_)
    recording = log.recording()
    return Flown(metrics(recording), numbers, failure, spent / max(asked, 1), recording)


def episode_costs(policy: Policy, engine: Engine, seeds: NDArray[np.int64]) -> Floats:
    """Cost of each episode: minus the sum of its rewards.

    Parameters
    ----------
    policy : Policy
        Anything with `predict`; it is given the observations of all ships together.
    engine : Engine
        With a lane for each seed.
    seeds : int array of shape (n,)

    Returns
    -------
    array of shape (n,)

    Raises
    ------
    InputError
        If the policy answers with something that is not a finite command for each ship.
    """
    observations = engine.reset(seeds)
    total, sailing = np.zeros(len(seeds)), np.ones(len(seeds), dtype=np.bool_)
    starts, state = sailing.copy(), None
    while sailing.any():
        actions, state = policy.predict(observations, state, starts, True)
        commands = np.array(actions, dtype=np.float32)
        commands[~sailing] = 0.0  # of no effect any more
        observations, rewards, terminated, truncated = engine.step(commands)
        total += rewards
        sailing &= ~(terminated | truncated)
        starts[:] = False
    return -total


def commands(actions: Any, engine: Engine, sailing: Flags) -> tuple[NDArray[np.float32], Flags, str]:
    """What is commanded, of which of the ships that sail it is no command, and why.

    Parameters
    ----------
    actions
        What the controller handed back.
    engine : Engine
        Tells the shape that is expected.
    sailing : bool array of shape (n,)
        Ships whose episode is not over; the command of the others is 0.
    """
    expected = (engine.num_envs, len(engine.command))
    none = np.zeros(expected, dtype=np.float32)
    try:
        with np.errstate(over="ignore"):
            found = np.array(actions, dtype=np.float32)
    except (TypeError, ValueError):
        return none, sailing.copy(), f"action of type {type(actions).__name__} found, expected numbers"
    if found.shape != expected:
        return none, sailing.copy(), f"actions of shape {found.shape} found, expected {expected}"
    bad = sailing & ~np.isfinite(found).all(axis=1)
    found[bad | ~sailing] = 0.0
    return (
        found,
        bad,
        f"no finite number for {int(bad.sum())} of {int(sailing.sum())} ships" if bad.any() else "",
    )


def _shielded(state: Any, n: int) -> Floats:
    """Where a safety shield steers."""
    if not isinstance(state, ShieldState):
        return np.zeros(n)
    return interventions(state).steering.astype(np.float64)


class _Log:
    """Gathers what a recording holds."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.path = isinstance(engine.task, PathFollowingTask)
        self.names = (*COMMON_SERIES, *(PATH_SERIES if self.path else ()))
        self.motions = {} if self.path else {"u": layout.U, "v": layout.V}
        if "n" in engine.model.state_names:
            self.motions["n"] = layout.N
        self.sailing = np.ones(engine.num_envs, dtype=np.bool_)
        self.lost, self.failed = ~self.sailing, ~self.sailing
        self.counts: list[Flags] = []
        self.parts: list[Floats] = []
        self.infos: list[Floats] = []
        self.series: dict[str, list[Floats]] = {name: [] for name in (*self.motions, "shielded")}
        self.rudder: list[Floats] = []
        self.set_point: list[Floats] = []
        self.heading: list[Floats] = []

    def begin(self) -> None:
        """Note where the ships begin."""
        for values, row in (
            (self.rudder, layout.DELTA), (self.set_point, rows.COURSE), (self.heading, layout.PSI),
        ):  # fmt: skip
            values.append(self.engine.outcome(row))

    def fail(self, which: Flags) -> None:
        """End episodes whose controller failed."""
        self.failed |= which
        self.sailing &= ~which

    def note(self, shielded: Floats, terminated: Flags, truncated: Flags) -> None:
        """Note what came of an interval."""
        engine = self.engine
        self.counts.append(self.sailing.copy())
        self.parts.append(engine.reward_parts)
        self.infos.append(np.stack([engine.info(name) for name in self.names]))
        for name, row in self.motions.items():
            self.series[name].append(engine.outcome(row))
        self.series["shielded"].append(shielded)
        self.begin()
        arrived = engine.info("success") > 0.0 if self.path else np.zeros_like(terminated)
        self.lost |= self.sailing & terminated & ~arrived
        self.sailing = self.sailing & ~(terminated | truncated)

    def recording(self) -> Recording:
        """All that was gathered."""
        engine, n = self.engine, self.engine.num_envs
        steps = len(self.counts)
        sailing = np.array(self.counts, dtype=np.bool_).reshape(steps, n)
        shown = np.array(self.infos).reshape(steps, len(self.names), n)
        infos = {name: shown[:, k] for k, name in enumerate(self.names)}
        series = {name: np.array(values).reshape(steps, n) for name, values in self.series.items()}
        return Recording(
            task=engine.task,
            dt=engine.dt,
            service_speed=engine.model.particulars["speed"],
            service_shaft=engine.model.service_shaft_speed if "n" in engine.model.state_names else 0.0,
            sailing=sailing,
            parts=-np.array(self.parts).reshape(steps, n, len(engine.task.reward_parts)) * sailing[..., None],
            series={**infos, **series},
            rudder=np.array(self.rudder),
            set_point=np.array(self.set_point),
            heading=np.array(self.heading),
            lost=self.lost,
            failed=self.failed,
        )
