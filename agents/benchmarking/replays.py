"""Single episodes of a benchmark, run again with their histories."""

import glob
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.benchmarking.entries import Entry, read_entries
from agents.benchmarking.results import BenchmarkResult
from agents.benchmarking.sources import file_hash, known_names, names_code
from agents.jobs import JobEngine, run_jobs
from agents.rollouts.episodes import recorded
from agents.suites.suite import BenchmarkTask
from identification.progress import Progress
from shipgym.checks import check_table, check_text
from shipgym.envs.episode import Episode
from shipgym.errors import InputError

SAME_COST = 1e-9  # relative difference of costs that is rounding


class EpisodeId(NamedTuple):
    """An episode of a controller: its task, its training run and its seed."""

    controller: str
    task: str
    run: int
    seed: int


@dataclass(frozen=True, eq=False)
class Rerun:
    """Episodes that were run again.

    Attributes
    ----------
    episodes : dict of EpisodeId to Episode
        Those that have at least one step.
    refused : dict of (str, str) to str
        Why a controller could not run a task again.
    different : tuple of EpisodeId
        Episodes whose cost is not the one in the results.
    """

    episodes: dict[EpisodeId, Episode] = field(default_factory=dict)
    refused: dict[tuple[str, str], str] = field(default_factory=dict)
    different: tuple[EpisodeId, ...] = ()


def rerun(
    result: BenchmarkResult,
    episodes: Sequence[EpisodeId],
    controllers: Any = None,
    workers: int | None = 1,
    progress: Progress | None = None,
) -> Rerun:
    """Run episodes of a benchmark again, from their seeds.

    Parameters
    ----------
    result : BenchmarkResult
    episodes : sequence of EpisodeId
    controllers : optional
        As `benchmark` was given them; needed for objects, and for code that a file of
        results names.
    workers : int or None
        Number of processes; None for one per core. Objects steer in this process.
    progress : callable, optional
        Called with what is done, how many of it, and the total.
    """
    given: dict[str, Entry] = {}
    if controllers is not None:
        given = {entry.name: entry for entry in read_entries(controllers)}

    jobs: list[dict[str, Any]] = []
    answers: dict[tuple[str, str], dict[str, Any]] = {}
    for (name, task_name), runs in _by_cell(episodes).items():
        try:
            task = result.task(task_name)
            about = result.summary["controllers"][name]
            entry = given.get(name) or rebuild(name, about, task, result.allow_code)
        except InputError as error:
            answers[name, task_name] = {"refused": str(error)}
            continue
        if entry.is_text:
            job = {"task": task.to_dict(), "entry": name, "source": entry.source}
            jobs.append({**job, "runs": runs})
        else:
            answers[name, task_name] = _record(entry, task, runs)

    tell = progress and partial(progress, "episodes run again")
    for job, answer in zip(
        jobs, run_jobs(rerun_job, jobs, JobEngine(workers=workers), tell), strict=True
    ):
        answers[job["entry"], job["task"]["name"]] = answer
    return _collect(result, answers)


def _by_cell(
    episodes: Sequence[EpisodeId],
) -> dict[tuple[str, str], list[list[int]]]:
    """Training runs by controller and task, each followed by its seeds."""
    seeds: dict[tuple[str, str], dict[int, list[int]]] = {}
    for name, task, run, seed in episodes:
        seeds.setdefault((name, task), {}).setdefault(run, []).append(seed)
    return {
        cell: [[run, *of_run] for run, of_run in runs.items()]
        for cell, runs in seeds.items()
    }


def rerun_job(job: dict[str, Any]) -> dict[str, Any]:
    """Run chosen episodes of a controller and task, in any process; see `_record`."""
    entry = Entry(job["entry"], job["source"])
    return _record(entry, BenchmarkTask.from_dict(job["task"]), job["runs"])


def _record(
    entry: Entry, task: BenchmarkTask, runs: Sequence[Sequence[int]]
) -> dict[str, Any]:
    """Return `refused`, or for each of `runs` the costs and fields of its episodes."""
    records = []
    try:
        policies = entry.policies(task)
        for run, *seeds in runs:
            found = recorded(policies[run], task, seeds)
            episodes = [one and vars(one) for one in found.episodes]
            records.append(
                {"run": run, "seeds": seeds, "costs": found.costs, "episodes": episodes}
            )
    except InputError as error:
        return {"refused": str(error)}
    except Exception as error:  # it cannot be run again, which is no reason for no page
        return {"refused": f"{type(error).__name__}: {error}"}
    return {"refused": "", "runs": records}


def _collect(
    result: BenchmarkResult, answers: Mapping[tuple[str, str], Mapping[str, Any]]
) -> Rerun:
    episodes: dict[EpisodeId, Episode] = {}
    different: list[EpisodeId] = []
    for (name, task), answer in answers.items():
        for run in answer.get("runs", ()):
            rows = zip(run["seeds"], run["costs"], run["episodes"], strict=True)
            for seed, cost, content in rows:
                key = EpisodeId(name, task, run["run"], seed)
                if content is not None:
                    episodes[key] = Episode(**content)
                is_same = np.isclose(cost, cost_of(result, key), rtol=SAME_COST)
                if np.isfinite(cost) and not is_same:
                    different.append(key)
    refused = {
        cell: answer["refused"] for cell, answer in answers.items() if answer["refused"]
    }
    return Rerun(episodes, refused, tuple(different))


def cost_of(result: BenchmarkResult, episode: EpisodeId) -> float:
    """Return the cost of an episode in the results."""
    costs = result.figures(episode.controller, episode.task)
    return float(costs[episode.run, episode.seed - result.summary["seeds"]["first"]])


def rebuild(
    name: str,
    about: Mapping[str, Any],
    task: BenchmarkTask,
    allow_code: Collection[str],
) -> Entry:
    """Make an entry of a file of results again, to run it in a task.

    By name, or from files that still have the SHA-256 in the results. Raises InputError
    for other files, for objects, and for functions that the user has not named.

    Parameters
    ----------
    name : str
        Name of the entry.
    about : mapping
        What the results say of it.
    task : BenchmarkTask
    allow_code : collection of str
        Functions that the user has named, module:function.
    """
    if about.get("source") is None:
        raise InputError(f"'{name}' was an object, which results do not hold")
    source = check_text(about["source"], f"'{name}': source")
    if names_code(source) and source not in allow_code:
        raise InputError(
            f"'{name}': expected no code that you have not named yourself, got"
            f" '{source}'; give it as `controllers`"
        )
    if names_code(source) or source in known_names():
        return Entry(name, source)

    hashes = check_table(about.get("files"), f"'{name}': files")
    design_name = task.design_task.name
    paths = [
        path
        for pattern in source.split("+")
        for path in sorted(hashes)
        if _is_match(path, pattern.replace("{task}", design_name))
    ]
    for path in paths:
        if not Path(path).is_file() or file_hash(path) != hashes[path]:
            raise InputError(f"'{path}': expected the file that took part, got another")
    if not paths:
        raise InputError(f"'{source}': expected files that took part, got none")
    return Entry(name, "+".join(glob.escape(path) for path in paths))


def _is_match(path: str, pattern: str) -> bool:
    parts, patterns = Path(path).parts, Path(pattern).parts
    return len(parts) == len(patterns) and all(map(fnmatchcase, parts, patterns))
