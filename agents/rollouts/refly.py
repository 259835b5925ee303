"""Single episodes of a benchmark flown once more, with all that happened in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.contestants import Contestant, contestants
from agents.benchmarking.results import BenchmarkResult
from agents.controllers.controller import Policy
from agents.engines.jobs import run_jobs
from agents.rollouts.flying import commands
from agents.suites.suite import BenchmarkTask, load_suite
from shipgym.envs.episode import Episode
from shipgym.envs.recording import SUCCESS, plain
from shipgym.envs.screen import STEP_OUTCOME
from shipgym.errors import InputError

if TYPE_CHECKING:
    from agents.verification.chain import Progress

Floats = NDArray[np.float64]

SAMPLES = 300  # of a history at most
SAME_COST = 1e-9  # relative difference of the cost that is rounding

_suite = lru_cache(maxsize=4)(load_suite)


class Flight(NamedTuple):
    """An episode of one contestant: in which task, of which training run, with which seed."""

    contestant: str
    task: str
    run: int
    seed: int


@dataclass(frozen=True, eq=False)
class Reflown:
    """Episodes flown once more.

    Attributes
    ----------
    episodes : dict of Flight to Episode
        Those that could be flown; one whose controller failed at once has no step and is not among them.
    refused : dict of (contestant, task) to str
        Why others could not.
    different : tuple of Flight
        Whose cost is not the one in the results.
    """

    episodes: dict[Flight, Episode] = field(default_factory=dict)
    refused: dict[tuple[str, str], str] = field(default_factory=dict)
    different: tuple[Flight, ...] = ()


def refly(
    result: BenchmarkResult,
    flights: Sequence[Flight],
    controllers: Any = None,
    workers: int | None = 1,
    progress: Progress | None = None,
) -> Reflown:
    """Fly episodes of a benchmark again, from their seeds.

    Parameters
    ----------
    result : BenchmarkResult
        Whose contestants and tasks they are of.
    flights : sequence of Flight
    controllers : optional
        As `benchmark` was given them. Contestants that were given as objects are known from here only.
    workers : int or None
        Processes; None for as many as there are cores. Objects fly in this process.
    progress : callable, optional
        Told what is done, how many of it, and the total.

    Returns
    -------
    Reflown
    """
    given = {} if controllers is None else {one.name: one for one in contestants(controllers)}
    wanted: dict[tuple[str, str], dict[int, list[int]]] = {}
    for flight in flights:
        wanted.setdefault((flight.contestant, flight.task), {}).setdefault(flight.run, []).append(flight.seed)
    suite = result.summary["suite"]["name"]
    jobs, here = [], {}
    for (name, task), seeds in wanted.items():
        source = result.summary["contestants"][name]["source"]
        runs = [[run, *chosen] for run, chosen in seeds.items()]
        if source is not None:
            jobs.append({"suite": suite, "task": task, "contestant": name, "source": source, "runs": runs})
        elif name in given:
            here[name, task] = _flown(given[name], _suite(suite).task(task), suite, runs)
        else:
            here[name, task] = {"refused": f"'{name}' was given as an object, which results do not hold"}
    told = None if progress is None else lambda done, total: progress("episodes flown again", done, total)
    found = run_jobs(refly_job, jobs, workers=workers, progress=told)
    return _gathered(
        result,
        {**here, **{(job["contestant"], job["task"]): one for job, one in zip(jobs, found, strict=True)}},
    )


def refly_job(job: dict[str, Any]) -> dict[str, Any]:
    """Fly chosen episodes of one contestant and task, in any process; see `_flown`."""
    one = Contestant(job["contestant"], job["source"])
    return _flown(one, _suite(job["suite"]).task(job["task"]), job["suite"], job["runs"])


def _flown(one: Contestant, task: BenchmarkTask, suite: str, runs: Sequence[Sequence[int]]) -> dict[str, Any]:
    """Why it cannot be, or of each run, given with its seeds, the costs, and the fields of the episodes."""
    try:
        policies = one.policies(task, suite)
        flown = [(run, seeds, recorded(policies[run], task, seeds)) for run, *seeds in runs]
    except Exception as error:  # one that cannot be made again is no reason to have no page
        return {
            "refused": str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        }
    return {
        "refused": "",
        "runs": [
            {
                "run": run,
                "seeds": seeds,
                "costs": found.costs,
                "episodes": [_fields(each) for each in found.episodes],
            }
            for run, seeds, found in flown
        ],
    }


def _fields(episode: Episode | None) -> dict[str, Any] | None:
    return None if episode is None else {item.name: getattr(episode, item.name) for item in fields(episode)}


def _gathered(result: BenchmarkResult, found: Mapping[tuple[str, str], Mapping[str, Any]]) -> Reflown:
    episodes: dict[Flight, Episode] = {}
    different: list[Flight] = []
    for (name, task), one in found.items():
        for flown in one.get("runs", ()):
            flights = [Flight(name, task, flown["run"], seed) for seed in flown["seeds"]]
            for flight, cost, content in zip(flights, flown["costs"], flown["episodes"], strict=True):
                if content is not None:
                    episodes[flight] = Episode(**content)
                if np.isfinite(cost) and not np.isclose(cost, cost_of(result, flight), rtol=SAME_COST):
                    different.append(flight)
    refused = {pair: one["refused"] for pair, one in found.items() if one["refused"]}
    return Reflown(episodes, refused, tuple(different))


def cost_of(result: BenchmarkResult, flight: Flight) -> float:
    """What an episode cost in the results."""
    first = result.summary["seeds"]["first"]
    return float(result.figures(flight.contestant, flight.task)[flight.run, flight.seed - first])


class Recorded(NamedTuple):
    """Episodes of one controller: what happened, None where not even one sample, and what each cost.

    What an episode cost in which the controller failed is not known here: NaN.
    """

    episodes: list[Episode | None]
    costs: Floats


def recorded(
    controller: Policy, task: BenchmarkTask, seeds: Sequence[int], samples: int = SAMPLES
) -> Recorded:
    """Fly episodes of a task side by side as `fly_task` does, and keep their histories.

    Parameters
    ----------
    controller : Policy
    task : BenchmarkTask
    seeds : sequence of int
    samples : int
        Of an episode of full length at most: the histories have every so many control intervals, in which
        rewards are summed. The last one is filled up: the ship stays where her episode ended.

    Returns
    -------
    Recorded
    """
    stride = -(-task.task.episode_steps // samples)
    engine, states, outcomes, actions = task.engine(len(seeds)), [], [], []
    observations, memory = engine.reset(np.asarray(seeds)), None
    waypoints = [engine.waypoints(lane) for lane in range(len(seeds))]
    states.append(engine.physical_state())
    began = engine.shown.outcomes.copy()
    sailing = np.ones(len(seeds), dtype=np.bool_)
    starts, failed, steps = sailing.copy(), ~sailing, np.zeros(len(seeds), dtype=np.int64)
    while sailing.any():
        try:
            answer, memory = controller.predict(observations, memory, starts, True)
        except Exception:  # as in the benchmark: the controller's failure
            answer = None
        command, bad, _ = commands(answer, engine, sailing)
        failed, sailing = failed | bad, sailing & ~bad
        if not sailing.any():
            break
        observations, _, terminated, truncated = engine.step(command)
        outcomes.append(engine.shown.outcomes.copy())
        steps += sailing
        sailing, starts = sailing & ~(terminated | truncated), np.zeros_like(starts)
        actions.append(command)
        if len(outcomes) % stride == 0:
            states.append(engine.physical_state())
    states.append(engine.physical_state())  # of those whose last interval is not a whole one
    log = _Log(task, stride, states, np.array([began, *outcomes]), np.array(actions), failed, steps)
    episodes = [_episode(log, lane, int(seed), waypoints[lane]) for lane, seed in enumerate(seeds)]
    costs = -log.outcomes[1:, 0].sum(axis=0)
    return Recorded(episodes, np.where(failed, np.nan, costs))


class _Log(NamedTuple):
    """What was kept of all lanes: states at samples, outcomes at the beginning and after each interval."""

    task: BenchmarkTask
    stride: int
    states: list[dict[str, Floats]]
    outcomes: Floats
    actions: NDArray[np.float32]
    failed: NDArray[np.bool_]
    steps: NDArray[np.int64]


def _episode(log: _Log, lane: int, seed: int, waypoints: Floats | None) -> Episode | None:
    task, ship, failed, steps = log.task.task, log.task.ship, bool(log.failed[lane]), int(log.steps[lane])
    count = (
        steps // log.stride if failed else -(-steps // log.stride)
    )  # one that failed drifts on in the engine
    if not count:
        return None
    at = np.minimum(log.stride * np.arange(count + 1), steps)
    outcomes = log.outcomes[: steps + 1, :, lane]
    rows = {name: outcomes[:, STEP_OUTCOME + k] for k, name in enumerate(task.info_names)}
    states = {
        name: np.array([state[name][lane] for state in log.states[: count + 1]]) for name in log.states[0]
    }
    said = [bool(np.any(rows[name][1:] > 0.0)) for name in SUCCESS if name in rows]
    corridor = getattr(task, "corridor", None)

    def summed(values: Floats) -> Floats:
        together: Floats = np.diff(np.append(0.0, np.cumsum(values[1:]))[at])
        return together

    return Episode(
        environment=log.task.env_id,
        model=ship.name,
        dt=task.interval(ship) * log.stride,
        length=ship.particulars["length"],
        beam=ship.particulars.get("beam"),
        rudder_limit=ship.steering.limit,
        states=_finite(states),
        actions=log.actions[at[:-1], lane],
        rewards=summed(outcomes[:, 0]),
        commands={
            name: states[f"{name}_command"][1:] for name in ship.command_names if f"{name}_command" in states
        },
        reward_parts={name: summed(rows[name]) for name in task.reward_parts},
        info=_finite({name: rows[name][at] for name in rows if name not in {*task.reward_parts, *SUCCESS}}),
        waypoints=waypoints,
        corridor=None if corridor is None else corridor * ship.particulars["length"],
        arguments=plain({"model": log.task.model, **log.task.options}),
        seed=seed,
        terminated=not failed and bool(outcomes[-1, 1] > 0.0),
        truncated=not failed and bool(outcomes[-1, 2] > 0.0),
        success=said[0] if said else None,
    )


def _finite(histories: Mapping[str, Floats]) -> dict[str, Floats]:
    """Those that are finite throughout."""
    return {name: values for name, values in histories.items() if np.isfinite(values).all()}
