"""Single episodes of a benchmark flown once more, with all that happened in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.contestants import Contestant, contestants
from agents.benchmarking.flying import Flown, fly_task
from agents.benchmarking.results import BenchmarkResult
from agents.benchmarking.suite import BenchmarkTask, load_suite
from agents.controller import Policy
from agents.engines import run_jobs
from shipgym.envs.engine import Engine
from shipgym.envs.path_following_task import PathFollowingTask
from shipgym.envs.recording import REWARD, SUCCESS, plain
from shipgym.episode import Episode
from shipgym.errors import InputError

if TYPE_CHECKING:
    from agents.autopilot import Progress

Floats = NDArray[np.float64]

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
                if not np.isclose(cost, cost_of(result, flight), rtol=SAME_COST, equal_nan=True):
                    different.append(flight)
    refused = {pair: one["refused"] for pair, one in found.items() if one["refused"]}
    return Reflown(episodes, refused, tuple(different))


def cost_of(result: BenchmarkResult, flight: Flight) -> float:
    """What an episode cost in the results."""
    first = result.summary["seeds"]["first"]
    return float(result.figures(flight.contestant, flight.task)[flight.run, flight.seed - first])


class Recorded(NamedTuple):
    """Episodes of one controller: what happened, what each cost, and its seed."""

    episodes: list[Episode | None]
    costs: Floats
    seeds: NDArray[np.int64]


def recorded(controller: Policy, task: BenchmarkTask, seeds: Sequence[int]) -> Recorded:
    """Fly episodes of a task side by side, and keep all that happened.

    Parameters
    ----------
    controller : Policy
    task : BenchmarkTask
    seeds : sequence of int

    Returns
    -------
    Recorded
        No episode where the controller failed before the first step.
    """
    watch = _Watch()
    flown = fly_task(controller, task, seeds, watch=watch)
    episodes = [_episode(task, watch, flown, lane) for lane in range(len(seeds))]
    return Recorded(episodes, flown.episodes["cost"], flown.seeds)


class _Watch:
    """Keeps what an engine shows after each interval, of all lanes."""

    def __init__(self) -> None:
        self.states: list[dict[str, Floats]] = []
        self.info: list[dict[str, Floats]] = []
        self.actions: list[Floats] = []
        self.waypoints: list[Floats | None] = []

    def __call__(self, engine: Engine) -> None:
        if not self.states:
            self.waypoints = [engine.waypoints(lane) for lane in range(engine.num_envs)]
        else:
            self.actions.append(engine.command.T.astype(np.float64))
        self.states.append(engine.physical_state())
        self.info.append({name: engine.info(name).copy() for name in engine.task.info_names})


def _episode(task: BenchmarkTask, watch: _Watch, flown: Flown, lane: int) -> Episode | None:
    recording, ship = flown.recording, task.ship
    steps = int(recording.steps[lane])
    if not steps:
        return None
    states = _of_lane(watch.states[: steps + 1], lane)
    info = _of_lane(watch.info[: steps + 1], lane)
    parts = {name: values[1:] for name, values in info.items() if name.startswith(REWARD)}
    said = [bool(info[name][-1] > 0.0) for name in SUCCESS if name in info]
    lost, failed = bool(recording.lost[lane]), bool(recording.failed[lane])
    beam, corridor = ship.particulars.get("beam"), getattr(task.task, "corridor", None)
    return Episode(
        environment=task.env_id,
        model=ship.name,
        dt=recording.dt,
        length=ship.particulars["length"],
        beam=beam,
        rudder_limit=ship.steering.limit,
        states=states,
        actions=np.array([actions[lane] for actions in watch.actions[:steps]]),
        rewards=np.sum(list(parts.values()), axis=0),
        commands={
            name: states[f"{name}_command"][1:] for name in ship.command_names if f"{name}_command" in states
        },
        reward_parts=parts,
        info={name: values for name, values in info.items() if name not in {*parts, *SUCCESS}},
        waypoints=watch.waypoints[lane] if isinstance(task.task, PathFollowingTask) else None,
        corridor=None if corridor is None else corridor * ship.particulars["length"],
        arguments=plain({"model": task.model, **task.options}),
        seed=int(flown.seeds[lane]),
        terminated=lost or any(said),
        truncated=steps == task.task.episode_steps and not (lost or failed or any(said)),
        success=said[0] if said else None,
    )


def _of_lane(rows: Sequence[Mapping[str, Floats]], lane: int) -> dict[str, Floats]:
    """Values over time of one lane, by name; those that were not finite throughout are left out."""
    found = {name: np.array([row[name][lane] for row in rows]) for name in rows[0]}
    return {name: values for name, values in found.items() if np.isfinite(values).all()}
