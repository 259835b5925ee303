"""Results of a benchmark: a row for each episode, and the summary; both as files.

`results.json` is described in `agents.benchmarking.results_format`, `episodes.parquet`
has one row for each controller, task, training run and seed.
"""

import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Self

import numpy as np

from agents.benchmarking.cells import CellName, Cells
from agents.benchmarking.entries import Entry
from agents.benchmarking.episode_table import (
    Columns,
    episode_table,
    pyarrow,
    read_episodes,
    write_episodes,
)
from agents.benchmarking.results_format import (
    FIELDS,
    FORMAT,
    KIND,
    check_summary,
)
from agents.benchmarking.sources import file_hash
from agents.benchmarking.summary import summarise
from agents.controllers.interface import model_hash
from agents.output import check_writable, present
from agents.suites.suite import (
    FIRST_SEED,
    BenchmarkTask,
    Suite,
    list_suites,
    load_suite,
)
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_fields, check_format
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

RESULTS, EPISODES, PARTS = "results.json", "episodes.parquet", "parts"
PACKAGES = ("shipgym", "numpy", "numba", "scipy", "control")
REMEDY = "run `shipgym benchmark` again"


@dataclass(frozen=True, eq=False)
class BenchmarkResult:
    """Results of a benchmark.

    Attributes
    ----------
    summary : dict
        Content of `results.json` (`agents.benchmarking.results_format`).
    episodes : dict of str to array
        One row for each episode: controller, task, run, seed, and figures by name.
    suite : Suite or None
        Suite that it was run on, if it is known.
    entries : tuple of Entry
        Controllers that were run; none if it was read from a file.
    """

    summary: dict[str, Any]
    episodes: Columns
    suite: Suite | None = None
    entries: tuple[Entry, ...] = ()

    @property
    def ranking(self) -> list[str]:
        """Names of the controllers, the best first."""
        return [ranked["name"] for ranked in self.summary["ranking"]]

    @cached_property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks."""
        return tuple(self.summary["tasks"])

    @cached_property
    def seeds(self) -> range:
        """Seeds of the episodes of each task."""
        first = self.summary["seeds"]["first"]
        count = self.summary["seeds"]["count"]
        return range(first, first + count)

    def cells(self, task: str) -> dict[str, Any]:
        """Return the figures in a task of each controller that could run it."""
        cells: dict[str, Any] = self.summary["tasks"][task]
        return cells

    def task(self, name: str) -> BenchmarkTask:
        """Return a task to run again.

        Raises InputError if its suite is not known.
        """
        if self.suite is None:
            name = self.summary["suite"]["name"]
            raise InputError(
                f"suite: expected the one of the results, '{name}', got none;"
                " load_results(path, suite=load_suite('your_suite.toml'))"
            )
        return self.suite.task(name)

    @property
    def failures(self) -> list[str]:
        """Sentences about the controllers that failed or could not run a task."""
        failures = []
        for name, about in self.summary["controllers"].items():
            for task, why in about["refused"].items():
                failures.append(f"{name} could not run {task}: {why}")

            for task in self.tasks:
                cell = self.cells(task).get(name)
                if cell and cell["failed"]:
                    failures.append(
                        f"{name} failed in {cell['failed']} episodes of {task}:"
                        f" {cell['failure']}"
                    )
        return failures

    def figures(self, controller: str, task: str, name: str = "cost") -> Floats:
        """Return a figure of each episode, shape (n_runs, n_episodes).

        There are no runs where the controller could not run the task. Raises InputError
        for an unknown controller, task or figure.
        """
        check_choice(controller, self.summary["controllers"], "controller")
        check_choice(task, self.tasks, "task")
        check_choice(name, self.episodes, "figure")

        episodes = self.episodes
        is_controller = episodes["controller"] == controller
        is_task = episodes["task"] == task
        figures = episodes[name][is_controller & is_task]
        return np.reshape(figures, (-1, len(self.seeds)))

    def save(self, folder: str | Path) -> Self:
        """Write `episodes.parquet` and then `results.json`, each whole or not at all.

        Returns the result with the hash of `episodes.parquet` in its summary. Raises
        InputError if pyarrow is missing or the folder cannot be written.
        """
        pyarrow()
        target = Path(folder)
        make_folder(target)
        table = target / EPISODES
        write_episodes(self.episodes, table)

        sha256 = file_hash(table)
        about_table = {**self.summary["episodes"], "sha256": sha256}
        summary = {**self.summary, "episodes": about_table}
        write_json(summary, target / RESULTS)
        return replace(self, summary=summary)


def check_new(folder: Path, resume: bool, suite: str) -> Path:
    """Refuse a folder that cannot take results.

    One that holds results is for `resume`, if they are of this suite. Raises InputError
    saying what to do.
    """
    pyarrow()  # a missing extra is reported now, not after the work
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"{folder}: expected a folder for the results, got a file; choose another"
        )
    check_writable(folder)
    names = present(folder) if folder.exists() else []
    has_results = any(name in (RESULTS, EPISODES, PARTS) for name in names)
    if names and not has_results:
        raise InputError(
            f"{folder}: expected results of a benchmark or nothing, got '{names[0]}';"
            " choose another folder"
        )
    if has_results and not resume:
        raise InputError(
            f"{folder}: already contains results; continue with --resume (resume=True),"
            " or choose another folder"
        )
    if RESULTS in names:
        other = load_results(folder).summary["suite"]["name"]
        if other != suite:
            raise InputError(
                f"{folder}: expected results of suite '{suite}', got those of"
                f" '{other}'; choose another folder"
            )
    return folder


def collect(
    suite: Suite,
    tasks: Sequence[BenchmarkTask],
    entries: Sequence[Entry],
    cells: Cells,
    n_episodes: int,
) -> BenchmarkResult:
    """Put together what was run.

    `cells` has every entry in every task, by the names of both.
    """
    names = [entry.name for entry in entries]
    controllers = {}
    in_order = {}
    for entry in entries:
        controllers[entry.name] = _about_entry(entry, tasks, cells)
        for task in tasks:
            key = entry.name, task.name
            in_order[key] = cells[key]

    seeds = FIRST_SEED + np.arange(n_episodes)
    table = episode_table(in_order, seeds)
    summary = {
        "format": FORMAT,
        "kind": KIND,
        "versions": versions(),
        "suite": _about_suite(suite, tasks),
        "seeds": {"first": FIRST_SEED, "count": n_episodes},
        "controllers": controllers,
        **summarise(tasks, names, cells),
        "episodes": {
            "file": EPISODES,
            "rows": len(table["seed"]),
            "sha256": None,
        },
    }
    return BenchmarkResult(summary, table, suite, tuple(entries))


def _about_suite(suite: Suite, tasks: Sequence[BenchmarkTask]) -> dict[str, Any]:
    source = Path(suite.source)
    return {
        "name": suite.name,
        "sha256": suite.sha256,
        "file": source.name if source.suffix == ".toml" else "",
        "complete": len(tasks) == len(suite.tasks),
        "tasks": {task.name: _about_task(task) for task in tasks},
    }


def versions() -> dict[str, str]:
    """Return the versions of what the results depend on, and the processor."""
    from llvmlite import binding

    found = {
        "python": platform.python_version(),
        "processor": str(binding.get_host_cpu_name()),
    }
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def _about_task(task: BenchmarkTask) -> dict[str, Any]:
    return {
        "environment": task.environment,
        "model": task.model,
        "model_sha256": model_hash(task.ship),
        "why": task.why,
        "limits": dict(task.limits),
        "on": task.on,
        "ship": task.true_ship,
    }


def _about_entry(
    entry: Entry,
    tasks: Sequence[BenchmarkTask],
    cells: Cells,
) -> dict[str, Any]:
    files: dict[str, str] = {}
    refused: dict[str, str] = {}
    n_runs = 0
    for task in tasks:
        cell = cells[entry.name, task.name]
        files |= entry.fingerprint(task)
        n_runs = max(n_runs, len(cell.runs))
        if cell.refused:
            refused[task.name] = cell.refused
    return {
        "source": entry.source if entry.is_text else None,
        "files": files,
        "runs": n_runs,
        "refused": refused,
    }


def load_results(path: str | Path, suite: Suite | None = None) -> BenchmarkResult:
    """Read the results of a benchmark.

    Raises InputError naming the file and the field at fault.

    Parameters
    ----------
    path : str or Path
        Their folder, or `results.json` in it.
    suite : Suite, optional
        Your own suite that they are of (`load_suite`), to run episodes again; a shipped
        one is found by its name.
    """
    where = Path(path)
    if where.is_dir():
        where = where / RESULTS
    summary = _read_summary(where)

    about_suite = summary["suite"]
    if suite is None and about_suite["name"] in list_suites():
        suite = load_suite(about_suite["name"])
    elif suite is not None and suite.sha256 != about_suite["sha256"]:
        raise InputError(f"{where}: expected results of this suite, got of another")

    table = where.with_name(EPISODES)
    about_table = summary["episodes"]
    if about_table["sha256"] != file_hash(table):
        raise InputError(
            f"{table}: expected the file that {RESULTS} was written with, got another"
            f" or one that is cut short; {REMEDY}"
        )
    episodes = read_episodes(table, about_table["rows"])
    _check_rows(summary, episodes, where)
    return BenchmarkResult(summary, episodes, suite)


def _read_summary(path: Path) -> dict[str, Any]:
    summary = read_json(path, "file of benchmark results", REMEDY)
    kind = summary.get("kind")
    if kind != KIND:
        raise InputError(f"{path}: kind: expected '{KIND}', got {kind!r}")
    where = str(path)
    check_format(summary, FORMAT, where)
    check_fields(summary, FIELDS, where, REMEDY)
    check_summary(summary, where)
    return dict(summary)


def _check_rows(summary: Mapping[str, Any], episodes: Columns, where: Path) -> None:
    """Refuse a table whose rows are not those that the summary counts."""
    runs: Counter[CellName] = Counter()
    for task, cells in summary["tasks"].items():
        for name, cell in cells.items():
            runs[name, task] = cell["runs"]

    names = episodes["controller"].tolist()
    tasks = episodes["task"].tolist()
    rows = Counter(zip(names, tasks, strict=True))
    n_episodes = summary["seeds"]["count"]
    for key in [*runs, *rows]:
        if rows[key] != runs[key] * n_episodes:
            name, task = key
            raise InputError(
                f"{where}: expected {runs[key]} runs of {n_episodes} episodes of"
                f" '{name}' on '{task}' in {EPISODES}, got {rows[key]} episodes;"
                f" {REMEDY}"
            )
