"""The benchmark: every contestant sails every task of a suite, in the same episodes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.contestants import ORACLE, Contestant, check_agents, contestants, policy_hash
from agents.benchmarking.results import PARTS, BenchmarkResult, check_new, gathered
from agents.engines.jobs import check_engine, run_jobs
from agents.rollouts.metrics import evaluate
from agents.suites.reference import oracle_costs
from agents.suites.suite import DEFAULT_SUITE, N_EPISODES, BenchmarkTask, load_suite, suite_hash
from shipgym.checks import check_number, check_whole
from shipgym.errors import InputError

if TYPE_CHECKING:
    from agents.verification.chain import Progress


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

    Parameters
    ----------
    controllers : str, sequence, or mapping of str
        Who takes part: texts such as ``"pid,lq"`` (`agents.benchmarking.contestants`), controllers, functions
        that make one for a `BenchmarkTask`; or any of these by name, a list being the training runs of one.
    suite : str
        Name of a shipped suite.
    tasks : sequence of str, optional
        By default all of it.
    out : str or Path, optional
        Folder for the results and for what each contestant did in each task; by default nothing is written.
    workers : int or None
        Processes; None for as many as there are cores. Controllers that are given as objects, not by a text,
        steer in this process.
    engine : {"local", "ray"}
        See `agents.engines.jobs.run_jobs`.
    progress : callable, optional
        Told what is done, how many of it, and the total.
    address : str, optional
        Of a ray cluster.
    resume : bool
        Whether to go on in a folder where results are: what is there already is not run again.
    episodes : int
        The first so many of the scored ones. Fewer than all of them are for a quick look, not for a ranking.

    Returns
    -------
    BenchmarkResult
        The same whatever the number of workers and the engine, but for the times.

    Raises
    ------
    InputError
        For an unknown contestant, suite or task, with the nearest known one, the file of an agent that is
        broken or fits none of the tasks, or a folder that is in use.
    """
    found = load_suite(suite)
    chosen = found.tasks if tasks is None else tuple(found.task(name) for name in _once(tasks))
    who = contestants(controllers)
    check_number(check_whole(episodes, "episodes", at_least=1), "episodes", at_most=N_EPISODES)
    check_engine(engine, workers, address)
    folder = None if out is None else Path(out)
    if folder is not None:
        check_new(folder, resume)
    for one in who:
        check_agents(one, chosen)
    jobs = [job_of(one, task, suite, episodes) for one in who if one.is_text for task in chosen]
    done = run_jobs(
        run_job,
        jobs,
        engine=engine,
        workers=workers,
        address=address,
        keep=None if folder is None else folder / PARTS,
        progress=None if progress is None else lambda done, total: progress("tasks done", done, total),
    )
    by_pair = {(job["contestant"], job["task"]): result for job, result in zip(jobs, done, strict=True)}
    for one in who:
        if not one.is_text:
            for task in chosen:
                by_pair[one.name, task.name] = results_of(one, task, suite, episodes)
    result = gathered(found, chosen, who, by_pair, episodes)
    if folder is not None:
        result.save(folder)
    return result


def _once(names: Sequence[str]) -> list[str]:
    if isinstance(names, str):
        names = [name.strip() for name in names.split(",")]
    if not names:
        raise InputError("tasks: none found, expected at least one")
    return list(dict.fromkeys(names))


def job_of(one: Contestant, task: BenchmarkTask, suite: str, episodes: int) -> dict[str, Any]:
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
    one = Contestant(job["contestant"], job["source"])
    return results_of(one, load_suite(job["suite"]).task(job["task"]), job["suite"], job["episodes"])


def results_of(one: Contestant, task: BenchmarkTask, suite: str, episodes: int) -> dict[str, Any]:
    """Run one task with every training run of one contestant.

    Returns
    -------
    dict
        refused : why it cannot take part in this task, else empty.
        runs : for each training run its `episodes` (arrays by name), `failure`, `seconds_per_action` and
            `policy_sha256`.
    """
    seeds = task.seeds[:episodes]
    try:
        if one.source == ORACLE:
            return {"refused": "", "runs": [_kept(oracle_costs(task, suite)[:episodes])]}
        policies = one.policies(task, suite)
    except InputError as error:
        return {"refused": str(error), "runs": []}
    except Exception as error:  # a user's factory may raise anything
        if isinstance(one.source, str) and ":" not in one.source:
            raise
        return {"refused": f"{type(error).__name__}: {error}", "runs": []}
    runs = []
    for policy in policies:
        figures, run = evaluate(policy, task, seeds)
        runs.append(
            {
                "episodes": figures,
                "failure": run.failure,
                "seconds_per_action": run.seconds_per_action,
                "policy_sha256": policy_hash(policy),
            }
        )
    return {"refused": "", "runs": runs}


def _kept(costs: NDArray[np.float64]) -> dict[str, Any]:
    """A run of which only the costs are known."""
    return {"episodes": {"cost": costs}, "failure": "", "seconds_per_action": np.nan, "policy_sha256": None}
