"""Single episodes of a benchmark, run again with their histories."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from agents.benchmarking.cells import CellName
from agents.benchmarking.entries import Entry, read_entries
from agents.benchmarking.results import BenchmarkResult
from agents.jobs import JobEngine, run_jobs
from agents.rollouts.episodes import recorded
from agents.suites.suite import BenchmarkTask
from identification.progress import Progress
from shipgym.envs.episode import Episode
from shipgym.errors import InputError

SAME_COST = 1e-9  # relative difference of costs that is rounding
#: What was run again of a cell, or of one of its training runs, ready for JSON.
Record = dict[str, Any]


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
    refused: dict[CellName, str] = field(default_factory=dict)
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
        As `benchmark` was given them; needed for results that were read from a file,
        which runs nothing that it names.
    workers : int or None
        Number of processes; None for one per core. Objects steer in this process.
    progress : callable, optional
        Called with what is done, how many of it, and the total.
    """
    entries = result.entries if controllers is None else read_entries(controllers)
    entry_of = {entry.name: entry for entry in entries}
    jobs: dict[CellName, dict[str, Any]] = {}
    records: dict[CellName, Record] = {}
    for cell, runs in _by_cell(episodes).items():
        name, task_name = cell
        try:
            task = result.task(task_name)
            entry = _given(name, entry_of)
        except InputError as error:
            records[cell] = {"refused": str(error)}
            continue
        if entry.is_text:
            jobs[cell] = {
                "task": task.to_dict(),
                "entry": name,
                "source": entry.source,
                "runs": runs,
            }
        else:
            records[cell] = _record(entry, task, runs)

    where = JobEngine(workers=workers)
    on_progress = progress and partial(progress, "episodes run again")
    results = run_jobs(rerun_job, list(jobs.values()), where, on_progress)
    records |= dict(zip(jobs, results, strict=True))
    return _collect(result, records)


def _given(name: str, entry_of: Mapping[str, Entry]) -> Entry:
    if name not in entry_of:
        raise InputError(
            f"controllers: expected '{name}', which results do not hold, got none"
        )
    return entry_of[name]


def _by_cell(episodes: Sequence[EpisodeId]) -> dict[CellName, list[Record]]:
    """Training runs by controller and task, each with its seeds."""
    cells: dict[CellName, list[Record]] = {}
    known: dict[EpisodeId, Record] = {}
    for episode in episodes:
        run = episode._replace(seed=0)  # a training run, whatever the episode
        if run not in known:
            known[run] = {"run": run.run, "seeds": []}
            of_cell = cells.setdefault((run.controller, run.task), [])
            of_cell.append(known[run])
        known[run]["seeds"].append(episode.seed)
    return cells


def rerun_job(job: dict[str, Any]) -> Record:
    """Run chosen episodes of a controller and task, in any process; see `_record`."""
    entry = Entry(job["entry"], job["source"])
    task = BenchmarkTask.from_dict(job["task"])
    return _record(entry, task, job["runs"])


def _record(entry: Entry, task: BenchmarkTask, runs: Sequence[Record]) -> Record:
    """Return `refused`, or for each of `runs` the costs and fields of its episodes."""
    records = []
    try:
        policies = entry.policies(task)
        for run in runs:
            policy = policies[run["run"]]
            again = recorded(policy, task, run["seeds"])
            fields = [episode and vars(episode) for episode in again.episodes]
            record = {**run, "costs": again.costs, "episodes": fields}
            records.append(record)
    except InputError as error:
        return {"refused": str(error)}
    except Exception as error:  # it cannot be run again, which is no reason for no page
        return {"refused": f"{type(error).__name__}: {error}"}
    return {"refused": "", "runs": records}


def _collect(result: BenchmarkResult, records: Mapping[CellName, Record]) -> Rerun:
    episodes: dict[EpisodeId, Episode] = {}
    refused: dict[CellName, str] = {}
    different: list[EpisodeId] = []
    for cell, record in records.items():
        if record["refused"]:
            refused[cell] = record["refused"]
            continue
        for run in record["runs"]:
            rows = zip(run["seeds"], run["costs"], run["episodes"], strict=True)
            for seed, cost, content in rows:
                key = EpisodeId(*cell, run["run"], seed)
                if content is not None:
                    episodes[key] = Episode(**content)
                if not _is_same(cost, cost_of(result, key)):
                    different.append(key)
    return Rerun(episodes, refused, tuple(different))


def _is_same(cost: float, before: float) -> bool:
    """Return whether two costs are equal to rounding; one that is not known is."""
    return not np.isfinite(cost) or bool(np.isclose(cost, before, rtol=SAME_COST))


def cost_of(result: BenchmarkResult, episode: EpisodeId) -> float:
    """Return the cost of an episode in the results."""
    costs = result.figures(episode.controller, episode.task)
    number = result.seeds.index(episode.seed)
    return float(costs[episode.run, number])
