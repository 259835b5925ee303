"""Single episodes of a benchmark run once more, with all that happened in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from agents.benchmarking.contestants import Contestant, contestants, remade
from agents.benchmarking.results import BenchmarkResult
from agents.jobs import JobEngine, run_jobs
from agents.rollouts.episodes import recorded
from agents.suites.suite import BenchmarkTask, load_suite
from identification.progress import Progress
from shipgym.envs.episode import Episode
from shipgym.errors import InputError

SAME_COST = 1e-9  # relative difference of the cost that is rounding


class EpisodeId(NamedTuple):
    """An episode of one contestant: in which task, of which training run, with which seed."""

    contestant: str
    task: str
    run: int
    seed: int


@dataclass(frozen=True, eq=False)
class Rerun:
    """Episodes that were run once more."""

    #: those that could be; one whose controller failed at once has no step and is not
    #: among them
    episodes: dict[EpisodeId, Episode] = field(default_factory=dict)
    refused: dict[tuple[str, str], str] = field(
        default_factory=dict
    )  # why others could not
    different: tuple[EpisodeId, ...] = ()  # whose cost is not the one in the results


def rerun(
    result: BenchmarkResult,
    episodes: Sequence[EpisodeId],
    controllers: Any = None,
    workers: int | None = 1,
    progress: Progress | None = None,
) -> Rerun:
    """Run episodes of a benchmark again, from their seeds.

    `result`: whose contestants and tasks they are of. `controllers`: as `benchmark` was
    given them; objects, and code that a file of results names, are known from here
    only. `workers`: processes; None for as many as there are cores. Objects steer in
    this process. `progress`: told what is done, how many of it, and the total.
    """
    given = (
        {}
        if controllers is None
        else {one.name: one for one in contestants(controllers)}
    )
    wanted: dict[tuple[str, str], dict[int, list[int]]] = {}
    for name, task, run, seed in episodes:
        wanted.setdefault((name, task), {}).setdefault(run, []).append(seed)
    suite = result.summary["suite"]["name"]
    jobs, found = [], {}
    for (name, task), seeds in wanted.items():
        about, asked = result.summary["contestants"][name], load_suite(suite).task(task)
        runs = [[run, *chosen] for run, chosen in seeds.items()]
        try:
            one = given.get(name) or remade(name, about, asked, result.allow_code)
        except InputError as error:
            found[name, task] = {"refused": str(error)}
            continue
        if not one.is_text:
            found[name, task] = _recorded(one, asked, suite, runs)
            continue
        jobs.append(
            {
                "suite": suite,
                "task": task,
                "contestant": name,
                "source": one.source,
                "runs": runs,
            }
        )
    told = progress and partial(progress, "episodes run again")
    done = run_jobs(rerun_job, jobs, JobEngine(workers=workers), told)
    found |= {
        (job["contestant"], job["task"]): one
        for job, one in zip(jobs, done, strict=True)
    }
    return _gathered(result, found)


def rerun_job(job: dict[str, Any]) -> dict[str, Any]:
    """Run chosen episodes of one contestant and task, in any process; see `_recorded`."""
    one, task = (
        Contestant(job["contestant"], job["source"]),
        load_suite(job["suite"]).task(job["task"]),
    )
    return _recorded(one, task, job["suite"], job["runs"])


def _recorded(
    one: Contestant, task: BenchmarkTask, suite: str, runs: Sequence[Sequence[int]]
) -> dict[str, Any]:
    """Why it cannot be, or of each training run, given with its seeds, costs and fields of the episodes."""
    done = []
    try:
        policies = one.policies(task, suite)
        for run, *seeds in runs:
            found = recorded(policies[run], task, seeds)
            episodes = [
                None if episode is None else vars(episode) for episode in found.episodes
            ]
            done.append(
                {"run": run, "seeds": seeds, "costs": found.costs, "episodes": episodes}
            )
    except (
        Exception
    ) as error:  # one that cannot be made again is no reason to have no page
        said = (
            str(error)
            if isinstance(error, InputError)
            else f"{type(error).__name__}: {error}"
        )
        return {"refused": said}
    return {"refused": "", "runs": done}


def _gathered(
    result: BenchmarkResult, found: Mapping[tuple[str, str], Mapping[str, Any]]
) -> Rerun:
    episodes: dict[EpisodeId, Episode] = {}
    different: list[EpisodeId] = []
    for (name, task), one in found.items():
        for run in one.get("runs", ()):
            for seed, cost, content in zip(
                run["seeds"], run["costs"], run["episodes"], strict=True
            ):
                key = EpisodeId(name, task, run["run"], seed)
                if content is not None:
                    episodes[key] = Episode(**content)
                if np.isfinite(cost) and not np.isclose(
                    cost, cost_of(result, key), rtol=SAME_COST
                ):
                    different.append(key)
    refused = {pair: one["refused"] for pair, one in found.items() if one["refused"]}
    return Rerun(episodes, refused, tuple(different))


def cost_of(result: BenchmarkResult, episode: EpisodeId) -> float:
    """What an episode cost in the results."""
    first = result.summary["seeds"]["first"]
    return float(
        result.figures(episode.contestant, episode.task)[
            episode.run, episode.seed - first
        ]
    )
