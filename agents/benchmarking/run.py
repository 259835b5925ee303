"""The benchmark: every controller steers every task of a suite, in the same episodes."""

import shutil
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from agents.benchmarking.cells import Cell, job_of, run_cell, run_job
from agents.benchmarking.entries import Entry, check_agents, read_entries
from agents.benchmarking.results import PARTS, BenchmarkResult, check_new, collect
from agents.jobs import JobEngine, run_jobs
from agents.output import in_use
from agents.suites.suite import DEFAULT_SUITE, N_EPISODES, BenchmarkTask, load_suite
from identification.progress import Progress
from shipgym.checks import check_number, check_whole
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
    read = load_suite(suite, allow_code)
    selected = read.select(tasks)
    check_whole(episodes, "episodes", at_least=1)
    check_number(episodes, "episodes", at_most=N_EPISODES)
    where = JobEngine(engine, workers, address)
    for entry in entries:
        check_agents(entry, selected)
    folder = None if out is None else check_new(Path(out), resume, read.name)
    if folder is not None:
        where = replace(where, keep=folder / PARTS)

    with nullcontext() if folder is None else in_use(folder):
        cells = _run_cells(entries, selected, episodes, where, progress)
        if not any(cell.runs for cell in cells.values()):
            if folder is not None and not resume:
                shutil.rmtree(folder / PARTS, ignore_errors=True)
            raise InputError(_no_controller(cells))
        result = collect(read, selected, entries, cells, episodes)
        return result if folder is None else result.save(folder)


def _run_cells(
    entries: Sequence[Entry],
    tasks: Sequence[BenchmarkTask],
    n_episodes: int,
    where: JobEngine,
    progress: Progress | None,
) -> dict[tuple[str, str], Cell]:
    """Run every entry in every task; cells by the names of both."""
    texts = [entry for entry in entries if entry.is_text]
    objects = [entry for entry in entries if not entry.is_text]
    pairs = [(entry, task) for entry in texts for task in tasks]
    jobs = [job_of(entry, task, n_episodes) for entry, task in pairs]
    tell = progress and partial(progress, "tasks done")
    contents = run_jobs(run_job, jobs, where, tell)

    cells: dict[tuple[str, str], Cell] = {}
    for (entry, task), content in zip(pairs, contents, strict=True):
        part = f"part of '{entry.name}' on '{task.name}'"
        cells[entry.name, task.name] = Cell.from_dict(content, n_episodes, part)
    for entry in objects:
        for task in tasks:
            cells[entry.name, task.name] = run_cell(entry, task, n_episodes)
    return cells


def _no_controller(cells: Mapping[tuple[str, str], Cell]) -> str:
    """Say that nothing could be run, and why not the first."""
    (entry, task), cell = next(iter(cells.items()))
    return (
        f"controllers: no controller could run any task; '{entry}' in '{task}':"
        f" {cell.refused}"
    )
