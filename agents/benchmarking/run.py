"""The benchmark: every controller in every task of a suite, the same episodes."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from agents.benchmarking.cells import Cell, CellName, job_of, run_cell, run_job
from agents.benchmarking.entries import Entry, check_agents, read_entries
from agents.benchmarking.results import PARTS, BenchmarkResult, check_new, collect
from agents.jobs import JobEngine, run_jobs
from agents.output import in_use
from agents.suites.suite import (
    DEFAULT_SUITE,
    N_EPISODES,
    BenchmarkTask,
    Suite,
    load_suite,
    suite_file,
)
from identification.progress import Progress
from shipgym.checks import check_whole
from shipgym.errors import InputError


def benchmark(
    controllers: Any,
    suite: str | Path = DEFAULT_SUITE,
    tasks: str | Sequence[str] | None = None,
    out: str | Path | None = None,
    workers: int | None = 1,
    engine: str = "local",
    progress: Progress | None = None,
    *,
    address: str | None = None,
    resume: bool = False,
    episodes: int = N_EPISODES,
    allow_code: Sequence[str] = (),
) -> BenchmarkResult:
    """Run controllers through the tasks of a suite and rank them.

    Returns results that are the same wherever the work is done, but for the times.
    Raises InputError for an unknown controller, suite or task, a broken agent or one
    that fits no task, a folder in use, or if no controller could run any task.

    Parameters
    ----------
    controllers : str, sequence, or mapping of str
        What is compared: texts such as ``"pid,lq"`` (`agents.benchmarking.entries`),
        controllers, functions of a `BenchmarkTask` that return one; or any of these by
        name, a list being the training runs of one controller.
    suite : str or Path
        Name of a shipped suite, or the TOML file of your own.
    tasks : str or sequence of str, optional
        Names of some of its tasks; by default all of them.
    out : str or Path, optional
        Folder for the results and their parts; by default nothing is written.
    workers, engine, address
        Where the work is done (`run_jobs`); controllers given as objects steer in this
        process.
    progress : callable, optional
        Called with what is done, how many of it, and the total.
    resume : bool
        Go on in a folder of results: what is there already is not run again.
    episodes : int
        How many of the scored ones; fewer are for a quick look, not for a ranking.
    allow_code : sequence of str
        Python files and modules that a suite of your own may name.
    """
    entries = read_entries(controllers)
    the_suite = load_suite(suite, allow_code)
    selected = the_suite.select(tasks)
    check_whole(episodes, "episodes", at_least=1, at_most=N_EPISODES)
    where = JobEngine(engine, workers, address)
    for entry in entries:
        check_agents(entry, selected)
    if out is None:
        return _run(the_suite, selected, entries, episodes, where, progress)

    folder = check_new(Path(out), resume, the_suite.name)
    parts = folder / PARTS
    where = replace(where, keep=parts)
    with in_use(folder):
        try:
            result = _run(the_suite, selected, entries, episodes, where, progress)
        except NoResultsError:
            if not resume:
                shutil.rmtree(parts, ignore_errors=True)
            raise
        return result.save(folder)


class NoResultsError(InputError):
    """No controller could run any task."""


def _run(
    suite: Suite,
    tasks: Sequence[BenchmarkTask],
    entries: Sequence[Entry],
    n_episodes: int,
    where: JobEngine,
    progress: Progress | None,
) -> BenchmarkResult:
    rule = rule_of(suite)
    others = {entry.source: entry for entry in entries if entry.is_text}
    rule_entry = others.get(rule, Entry("", rule))  # no other entry has no name
    everyone = dict.fromkeys([*entries, rule_entry])
    cells = _run_cells(list(everyone), tasks, n_episodes, where, progress)
    own = [cells[entry.name, task.name] for entry in entries for task in tasks]
    if all(cell.refused for cell in own):
        raise NoResultsError(
            f"controllers: no controller could run any task; '{entries[0].name}' in"
            f" '{tasks[0].name}': {own[0].refused}"
        )
    rule_cells = {task.name: cells[rule_entry.name, task.name] for task in tasks}
    return collect(suite, tasks, entries, cells, rule, rule_cells)


def rule_of(suite: Suite) -> str:
    """Controller whose cost scores are relative to: tuned, where the suite has that."""
    has_settings = suite_file(suite.source, "tuned").exists()
    return "tuned-preview-lq" if has_settings else "preview-lq"


def _run_cells(
    entries: Sequence[Entry],
    tasks: Sequence[BenchmarkTask],
    n_episodes: int,
    where: JobEngine,
    progress: Progress | None,
) -> dict[CellName, Cell]:
    """Run every entry in every task; cells by the names of both."""
    cells: dict[CellName, Cell] = {}
    jobs: dict[CellName, dict[str, Any]] = {}
    for entry, task in product(entries, tasks):
        if entry.is_text:
            jobs[entry.name, task.name] = job_of(entry, task, n_episodes)
    on_progress = progress and partial(progress, "tasks done")
    results = run_jobs(run_job, list(jobs.values()), where, on_progress)
    for (name, task_name), result in zip(jobs, results, strict=True):
        part = f"part of '{name}' on '{task_name}'"
        cells[name, task_name] = Cell.from_dict(result, n_episodes, part)

    # no other process can make objects
    for entry, task in product(entries, tasks):
        if not entry.is_text:
            cells[entry.name, task.name] = run_cell(entry, task, n_episodes)
    return cells
