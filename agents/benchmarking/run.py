"""The benchmark: every entry in every task of a suite, the same episodes."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from agents.benchmarking.cells import Options, job_of, read_cell, run_cell, run_job
from agents.benchmarking.entries import Entry, read_entries, source_for
from agents.benchmarking.results import PARTS, BenchmarkResult, check_new, collect
from agents.jobs import JobEngine, run_jobs
from agents.output import in_use
from agents.suites.benchmark_task import N_EPISODES, BenchmarkTask
from agents.suites.suite import DEFAULT_SUITE, load_suite
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.tasks.definition import no_worst_cost


def benchmark(
    controllers: Any,
    suite: str | Path = DEFAULT_SUITE,
    tasks: str | Sequence[str] | None = None,
    out: str | Path | None = None,
    workers: int | None = 1,
    engine: str = "local",
    *,
    address: str | None = None,
    resume: bool = False,
    episodes: int = N_EPISODES,
    seed: int = 0,
    runs: int = 1,
    allow_code: bool = False,
) -> BenchmarkResult:
    """Run controllers through the tasks of a suite and rank them.

    Returns results that are the same wherever the work is done, but for the times.
    Raises InputError for an unknown controller, suite or task, a folder in use or of
    other options, or if no controller could run any task.

    Parameters
    ----------
    controllers : str, sequence, or mapping of str
        What is compared: texts such as ``"pid,lq"`` (`agents.benchmarking.entries`),
        controllers, functions of a `BenchmarkTask` that return one; or any of these by
        name.
    suite : str or Path
        Name of a shipped suite, or the TOML file of your own.
    tasks : str or sequence of str, optional
        Names of some of its tasks; by default all of them.
    out : str or Path, optional
        Folder for the results and their parts; by default nothing is written.
    workers, engine, address
        Where the work is done (`run_jobs`); controllers given as objects steer in this
        process.
    resume : bool
        Go on in a folder of results: what is there already is not run again.
    episodes : int
        How many of the scored ones; fewer are for a quick look, not for a ranking.
    seed : int
        Which episodes are scored: each seed has others.
    runs : int
        How often an entry that searches or learns is made.
    allow_code : bool
        Whether a suite of your own may name Python files and modules, which are run.
    """
    entries = read_entries(controllers)
    the_suite = load_suite(suite, allow_code)
    selected = the_suite.select(tasks)
    for task in selected:
        _check_losses(task)
    check_whole(episodes, "episodes", at_least=1, at_most=N_EPISODES)
    check_whole(seed, "seed", at_least=0, at_most=9999)
    check_whole(runs, "runs", at_least=1)
    options = Options(episodes, seed, runs, the_suite.budget)
    where = JobEngine(engine, workers, address)
    rules = {task.name: _rule(task, entries) for task in selected}
    pairs = [*product(entries, selected)]
    pairs += [(rules[task.name], task) for task in selected]

    def run(where: JobEngine) -> BenchmarkResult:
        jobs = {}
        cells = {}
        for entry, task in pairs:
            if entry.is_text:
                jobs[entry.name, task.name] = job_of(entry, task, options)
            else:  # no other process can make objects
                cells[entry.name, task.name] = run_cell(entry, task, options)
        results = run_jobs(run_job, list(jobs.values()), where)
        for name, result in zip(jobs, results, strict=True):
            cells[name] = read_cell(result)
        names = {task: rule.name for task, rule in rules.items()}
        return collect(the_suite, selected, entries, cells, names, options)

    if out is None:
        return run(where)
    folder = check_new(Path(out), resume)
    with in_use(folder):
        try:
            return run(replace(where, keep=folder / PARTS)).save(folder)
        except InputError:  # nothing that could be kept
            if not resume:
                shutil.rmtree(folder / PARTS, ignore_errors=True)
            raise


def _check_losses(task: BenchmarkTask) -> None:
    """Refuse a task in which a lost ship costs nothing more, as losing would pay."""
    definition = task.task.definition
    if definition.worst_cost is no_worst_cost:
        raise InputError(
            f"{task.name}: expected worst_cost(settings) in {definition.source}, the"
            " largest cost of a step, which a lost ship pays for each step that is"
            " left; got none"
        )


def _rule(task: BenchmarkTask, entries: Sequence[Entry]) -> Entry:
    """Return the entry that is the rule of a task, or one with a name of its own."""
    for entry in entries:
        if source_for(entry.source, task) == task.rule:
            return entry
    return Entry(f" {task.rule}", task.rule)
