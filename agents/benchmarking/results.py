"""Results of a benchmark: a row for each episode, and the summary; both as files.

docs/benchmark.md describes `results.json`; `episodes.parquet` has one row for each
controller, task, training run and seed.
"""

import json
import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from agents.benchmarking.cells import Cell, Cells
from agents.benchmarking.entries import Entry, file_hash
from agents.benchmarking.summary import KEYS, Summary
from agents.controllers.interface import model_hash
from agents.output import check_writable, present
from agents.suites.suite import FIRST_SEED, BenchmarkTask, Suite
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_fields, check_format
from shipgym.drafts import atomic_path
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import (
    LARGEST_TENSORS,
    make_folder,
    read_bytes,
    read_json,
    write_json,
)

RESULTS, EPISODES, PARTS = "results.json", "episodes.parquet", "parts"
FORMAT, KIND = 3, "shipgym-benchmark"
FIELDS = (
    "format",
    "kind",
    "versions",
    "suite",
    "seeds",
    "controllers",
    "rule",
    "tasks",
    "ranking",
    "episodes",
    "sha256",
)
PACKAGES = ("shipgym", "numpy", "numba", "scipy", "control")
REMEDY = "run `shipgym benchmark` again"
MOST_COLUMNS = 200  # of the table of episodes


@dataclass(frozen=True, eq=False)
class BenchmarkResult:
    """Results of a benchmark.

    Attributes
    ----------
    summary : dict
        Content of `results.json`.
    episodes : DataFrame
        One row for each episode: controller, task, run, seed, and figures by name.
    """

    summary: dict[str, Any]
    episodes: pd.DataFrame

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
        return range(first, first + self.summary["seeds"]["count"])

    def cells(self, task: str) -> dict[str, Any]:
        """Return the figures in a task of each controller that could run it."""
        cells: dict[str, Any] = self.summary["tasks"][task]
        return cells

    @property
    def failures(self) -> list[str]:
        """Sentences about the controllers that failed or could not run a task."""
        failures = []
        for name, about in self.summary["controllers"].items():
            if about["refused"]:
                first, *_ = about["refused"].values()
                tasks = ", ".join(about["refused"])
                failures.append(f"{name} could not run {tasks}: {first}")
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
        check_choice(name, list(self.episodes), "figure")
        table = self.episodes
        rows = (table["controller"] == controller) & (table["task"] == task)
        figures: Floats = table.loc[rows, name].to_numpy(np.float64)
        return figures.reshape(-1, len(self.seeds))

    def save(self, folder: str | Path) -> Self:
        """Write `episodes.parquet` and then `results.json`, each whole or not at all.

        Returns the result with the hash of `episodes.parquet` in its summary. Raises
        InputError if pyarrow is missing or the folder cannot be written.
        """
        _pyarrow()
        target = Path(folder)
        make_folder(target)
        table = target / EPISODES
        with atomic_path(table) as draft:
            self.episodes.to_parquet(draft, engine="pyarrow", index=False)

        about_table = {**self.summary["episodes"], "sha256": file_hash(table)}
        summary = {**self.summary, "episodes": about_table}
        summary["sha256"] = _summary_hash(summary)
        write_json(summary, target / RESULTS)
        return replace(self, summary=summary)


def _pyarrow() -> Any:
    """Return pyarrow's module for Parquet; InputError says how it is installed."""
    return library("pyarrow.parquet", "benchmark", "the table of episodes needs it")


def check_new(folder: Path, resume: bool, suite: str) -> Path:
    """Refuse a folder that cannot take results.

    One that holds results is for `resume`, if they are of this suite. Raises InputError
    saying what to do.
    """
    _pyarrow()  # a missing extra is reported now, not after the work
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
    rule: str,
    rule_cells: Mapping[str, Cell],
) -> BenchmarkResult:
    """Put together what was run.

    `cells` has every entry in every task, by the names of both; `rule_cells` the
    controller `rule`, which scores are relative to, by the name of the task.
    """
    computed = Summary(tasks, [entry.name for entry in entries], cells, rule_cells)
    episodes = computed.episodes
    by_task = computed.by_task()
    rule_costs = {}
    for number, costs in computed.rule_costs.items():
        rule_costs[tasks[number].name] = float(costs.mean())
    controllers = {}
    for entry in entries:
        controllers[entry.name] = _about_entry(entry, tasks, cells)
    summary = {
        "format": FORMAT,
        "kind": KIND,
        "versions": versions(),
        "suite": _about_suite(suite, tasks),
        "seeds": {"first": FIRST_SEED, "count": episodes["seed"].nunique()},
        "controllers": controllers,
        "rule": {"controller": rule, "costs": rule_costs},
        "tasks": by_task,
        "ranking": computed.ranking(by_task),
        "episodes": {"file": EPISODES, "rows": len(episodes), "sha256": None},
    }
    return BenchmarkResult(summary, episodes)


def _about_suite(suite: Suite, tasks: Sequence[BenchmarkTask]) -> dict[str, Any]:
    source = Path(suite.source)
    about_tasks = {}
    for task in tasks:
        about_tasks[task.name] = {
            "environment": task.environment,
            "model": task.model,
            "model_sha256": model_hash(task.ship),
            "why": task.why,
            "limits": dict(task.limits),
            "on": task.on,
            "ship": task.true_ship,
        }
    return {
        "name": suite.name,
        "sha256": suite.sha256,
        "file": source.name if source.suffix == ".toml" else "",
        "complete": len(tasks) == len(suite.tasks),
        "tasks": about_tasks,
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
        n_runs = max(n_runs, len(cell.costs))
        if cell.refused:
            refused[task.name] = cell.refused
    return {
        "source": entry.source if entry.is_text else None,
        "files": files,
        "runs": n_runs,
        "refused": refused,
    }


def load_results(path: str | Path) -> BenchmarkResult:
    """Read the results of a benchmark from their folder, or `results.json` in it.

    Raises InputError naming the file and the field at fault.
    """
    where = Path(path)
    if where.is_dir():
        where = where / RESULTS
    summary = read_json(where, "file of benchmark results", REMEDY)
    if summary.get("kind") != KIND:
        raise InputError(
            f"{where}: kind: expected '{KIND}', got {summary.get('kind')!r}"
        )
    check_format(summary, FORMAT, str(where))
    check_fields(summary, FIELDS, str(where), REMEDY)
    if summary["sha256"] != _summary_hash(summary):
        raise InputError(
            f"{where}: expected what the benchmark wrote, got other content; remove it"
            " and run `shipgym benchmark --resume` again"
        )
    episodes = _read_episodes(where.with_name(EPISODES), summary["episodes"])
    return BenchmarkResult(dict(summary), episodes)


def _summary_hash(summary: Mapping[str, Any]) -> str:
    """SHA-256 of a summary without its own hash."""
    content = {name: value for name, value in summary.items() if name != "sha256"}
    return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _read_episodes(path: Path, about: Mapping[str, Any]) -> pd.DataFrame:
    """Read the table that was written with a summary, which tells its hash and size."""
    content = read_bytes(path, "file of episodes", LARGEST_TENSORS)
    if about["sha256"] != file_hash(path):
        raise InputError(
            f"{path}: expected the file that {RESULTS} was written with, got another"
            f" or one that is cut short; {REMEDY}"
        )
    parquet = _pyarrow()
    pyarrow = library("pyarrow", "benchmark", "the table of episodes needs it")
    try:
        file = parquet.ParquetFile(pyarrow.BufferReader(content))
        size = file.metadata
        is_small = size.num_columns <= MOST_COLUMNS
        if size.num_rows != about["rows"] or not is_small:
            raise ValueError(
                f"{size.num_rows} rows of {size.num_columns} columns instead of"
                f" {about['rows']} rows"
            )
        table: pd.DataFrame = file.read().to_pandas(ignore_metadata=True)
        numbers = table.columns.difference(["controller", "task"])
        return table.astype(dict.fromkeys(numbers.difference(KEYS), np.float64))
    except (OSError, pyarrow.ArrowException, ValueError, TypeError) as error:
        raise InputError(
            f"{path}: expected a table of episodes, got one that cannot be read"
            f" ({error}); {REMEDY}"
        ) from None
