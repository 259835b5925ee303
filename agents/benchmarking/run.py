"""The benchmark: every contestant steers every task of a suite, in the same episodes."""

import shutil
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np

from agents.benchmarking.contestants import (
    BEST_KNOWN,
    Contestant,
    check_agents,
    contestants,
    policy_hash,
)
from agents.benchmarking.results import PARTS, BenchmarkResult, check_new, gathered
from agents.jobs import JobEngine, run_jobs
from agents.output import in_use
from agents.rollouts.metrics import evaluate
from agents.suites.reference import best_costs
from agents.suites.suite import (
    DEFAULT_SUITE,
    N_EPISODES,
    BenchmarkTask,
    load_suite,
    suite_hash,
)
from identification.progress import Progress
from shipgym.checks import ANY_KEY, Shape, check_number, check_shape, check_whole
from shipgym.errors import InputError

RUN: Shape = {
    "episodes": {ANY_KEY: (np.ndarray,)},
    "failure": (str,),
    "seconds_per_action": (int, float),
    "policy_sha256": (str, NoneType),
}
PART: Shape = {"refused": (str,), "runs": [RUN]}  # what `results_of` returns


def benchmark(
    controllers: Any,
    suite: str = DEFAULT_SUITE,
    tasks: Sequence[str] | None = None,
    out: str | Path | None = None,
    workers: int | None = 1,
    engine: str = "local",
    progress: Progress | None = None,
    *,
    address: str | None = None,
    resume: bool = False,
    episodes: int = N_EPISODES,
) -> BenchmarkResult:
    """Run controllers through the tasks of a suite and rank them.

    Returns results that are the same wherever the work is done, but for the times.
    Raises InputError for an unknown contestant, suite or task, a broken agent or one
    for no task, a folder in use, or if nobody took part in any task.

    Parameters
    ----------
    controllers : str, sequence, or mapping of str
        Who takes part: texts such as ``"pid,lq"`` (`agents.benchmarking.contestants`),
        controllers, functions of a `BenchmarkTask` that make one; or any of these by
        name, a list being the training runs of one.
    suite, tasks : str, and sequence of str, optional
        Name of a shipped suite, and of some of its tasks; by default all of them.
    out : str or Path, optional
        Folder for the results and their parts; by default nothing is written.
    workers, engine, address
        Where the work is done (`run_jobs`); controllers that are given as objects steer
        in this process.
    progress : callable, optional
        Told what is done, how many of it, and the total.
    resume : bool
        Whether to go on in a folder of results: what is there already is not run again.
    episodes : int
        How many of the scored ones; fewer are for a quick look, not for a ranking.
    """
    chosen, who = _chosen(suite, tasks), contestants(controllers)
    check_number(
        check_whole(episodes, "episodes", at_least=1), "episodes", at_most=N_EPISODES
    )
    where = JobEngine(engine, workers, address)
    for one in who:
        check_agents(one, chosen)
    folder = None if out is None else check_new(Path(out), resume, suite)
    jobs = [
        job_of(one, task, suite, episodes)
        for one in who
        if one.is_text
        for task in chosen
    ]
    with nullcontext() if folder is None else in_use(folder):
        found = run_jobs(
            run_job,
            jobs,
            replace(where, keep=folder and folder / PARTS),
            progress and partial(progress, "tasks done"),
        )
        pairs = zip(jobs, found, strict=True)
        done = {
            (job["contestant"], job["task"]): checked_part(one, job)
            for job, one in pairs
        }
        own = product(
            (one for one in who if not one.is_text), chosen
        )  # objects steer in this process
        done |= {
            (one.name, task.name): results_of(one, task, suite, episodes)
            for one, task in own
        }
        if not any(part["runs"] for part in done.values()):
            if folder is not None and not resume:
                shutil.rmtree(folder / PARTS, ignore_errors=True)
            (name, first), part = next(iter(done.items()))
            why = f"'{name}' in '{first}': {part['refused']}"
            raise InputError(f"controllers: nobody took part in any task; {why}")
        return gathered(suite, chosen, who, done, episodes).save(folder)


def checked_part(part: dict[str, Any], job: Mapping[str, Any]) -> dict[str, Any]:
    """A result of `run_job`, which may have been kept in a file; InputError if it is not one of the job."""
    where = f"part of '{job['contestant']}' on '{job['task']}'"
    check_shape(part, PART, where)
    names = {"cost"}.union(*(run["episodes"] for run in part["runs"]))
    for run in part["runs"]:
        shapes = {
            name: one.shape
            for name, one in run["episodes"].items()
            if one.dtype.kind in "bif"
        }
        if shapes != dict.fromkeys(names, (job["episodes"],)):
            raise InputError(
                f"{where}: expected cost and other figures of {job['episodes']}"
                " episodes"
            )
    return part


def _chosen(suite: str, names: Sequence[str] | None) -> tuple[BenchmarkTask, ...]:
    """Tasks of a suite by name, each once; the name of a task with a ship is that of all its sets."""
    found = load_suite(suite)
    if names is None:
        return found.tasks
    if isinstance(names, str):
        names = [name.strip() for name in names.split(",")]
    if not names:
        raise InputError("tasks: none found, expected at least one")
    sets = [
        [task for task in found.tasks if one and one in (task.base, task.name)]
        or [found.task(one)]
        for one in names
    ]
    return tuple({task.name: task for tasks in sets for task in tasks}.values())


def job_of(
    one: Contestant, task: BenchmarkTask, suite: str, episodes: int
) -> dict[str, Any]:
    """The job of one contestant and task; it names all that its result depends on."""
    return {
        "suite": suite,
        "suite_sha256": suite_hash(suite),
        "task": task.name,
        "contestant": one.name,
        "source": one.source,
        "files": one.fingerprint(task),
        "episodes": episodes,
    }


def run_job(job: dict[str, Any]) -> dict[str, Any]:
    """Do a job of `job_of`, in any process; see `results_of`."""
    one, task = (
        Contestant(job["contestant"], job["source"]),
        load_suite(job["suite"]).task(job["task"]),
    )
    return results_of(one, task, job["suite"], job["episodes"])


def results_of(
    one: Contestant, task: BenchmarkTask, suite: str, episodes: int
) -> dict[str, Any]:
    """Run one task with every training run of one contestant.

    Returns `refused`, why it cannot take part in this task, else empty, and `runs`, for
    each training run its `episodes` (arrays by name), `failure`, `seconds_per_action`
    and `policy_sha256`.
    """
    try:
        if one.source == BEST_KNOWN:
            costs = best_costs(task, suite)[:episodes]
            return {"refused": "", "runs": [_run({"cost": costs}, "", np.nan, None)]}
        policies = one.policies(task, suite)
    except InputError as error:
        return {"refused": str(error), "runs": []}
    except Exception as error:  # a user's factory may raise anything
        if isinstance(one.source, str) and ":" not in one.source:
            raise
        return {"refused": f"{type(error).__name__}: {error}", "runs": []}
    runs = []
    for policy in policies:
        figures, run = evaluate(policy, task, task.seeds[:episodes])
        runs.append(
            _run(figures, run.failure, run.seconds_per_action, policy_hash(policy))
        )
    return {"refused": "", "runs": runs}


def _run(
    episodes: Any, failure: str, seconds_per_action: float, policy_sha256: str | None
) -> dict[str, Any]:
    return {
        "episodes": episodes,
        "failure": failure,
        "seconds_per_action": seconds_per_action,
        "policy_sha256": policy_sha256,
    }
