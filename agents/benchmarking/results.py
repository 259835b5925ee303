"""What a benchmark found: one row an episode, and the summary with its intervals; both as files.

What stands in `results.json` is told by `agents.benchmarking.results_shape`.
`episodes.parquet` has one row for each contestant, task, run and seed, with the figures
of `metrics`.
"""

import platform
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Self

import numpy as np

from agents.benchmarking.contestants import Contestant, file_hash, names_code
from agents.benchmarking.episode_table import (
    Columns,
    joined,
    pyarrow,
    read_episodes,
    write_episodes,
)
from agents.benchmarking.results_shape import SHAPE, check_summary
from agents.benchmarking.summary import Done, summary_of
from agents.controllers.controller import model_hash
from agents.output import check_writable, present
from agents.suites.suite import FIRST_SEED, BenchmarkTask, suite_hash
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_fields, check_format
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

FORMAT, KIND = 2, "shipgym-benchmark"
RESULTS, EPISODES, PARTS = "results.json", "episodes.parquet", "parts"
FIELDS = ("format", "kind", *SHAPE)
PACKAGES = ("shipgym", "numpy", "numba", "scipy", "control")
REMEDY = "run `shipgym benchmark` again"


@dataclass(frozen=True, eq=False)
class BenchmarkResult:
    """Result of a benchmark.

    Attributes
    ----------
    summary : dict
        What `results.json` holds (`agents.benchmarking.results_shape`).
    episodes : dict of str to array
        One row an episode: contestant, task, run, seed, and figures by name
        (`metrics`).
    allow_code : tuple of str
        Functions of contestants that the user named when it was made; none of a file.
    """

    summary: dict[str, Any]
    episodes: Columns
    allow_code: tuple[str, ...] = ()

    @property
    def ranking(self) -> list[str]:
        """Names of the contestants, the best first."""
        return [entry["name"] for entry in self.summary["ranking"]]

    @cached_property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks."""
        return tuple(self.summary["tasks"])

    @property
    def failures(self) -> list[str]:
        """In words, who failed or could not take part."""
        failures = []
        for name, one in self.summary["contestants"].items():
            failures += [
                f"{name} did not take part in {task}: {why}"
                for task, why in one["refused"].items()
            ]
            failures += [
                f"{name} failed in {found[name]['failed']} episodes of {task}:"
                f" {found[name]['failure']}"
                for task, found in self.summary["tasks"].items()
                if name in found and found[name]["failed"]
            ]
        return failures

    def figures(self, contestant: str, task: str, name: str = "cost") -> Floats:
        """A figure of each episode, shape (n_runs, n_episodes); of no runs where it took no part.

        Raises InputError for an unknown contestant, task or figure.
        """
        check_choice(contestant, self.summary["contestants"], "contestant")
        check_choice(task, self.tasks, "task")
        check_choice(name, self.episodes, "figure")
        rows = (self.episodes["contestant"] == contestant) & (
            self.episodes["task"] == task
        )
        return np.asarray(
            self.episodes[name][rows].reshape(-1, self.summary["seeds"]["count"])
        )

    def save(self, folder: str | Path | None) -> Self:
        """Write `episodes.parquet` and then `results.json`, each whole or not at all; None: nowhere.

        Returns the result with the hash of `episodes.parquet` in its summary.

        Raises InputError if pyarrow is missing or the folder cannot be written.
        """
        if folder is None:
            return self
        target = Path(folder)
        pyarrow()
        make_folder(target)
        write_episodes(self.episodes, target / EPISODES)
        about = {**self.summary["episodes"], "sha256": file_hash(target / EPISODES)}
        saved = replace(self, summary={**self.summary, "episodes": about})
        write_json(saved.summary, target / RESULTS)
        return saved


def check_new(folder: Path, resume: bool, suite: str) -> Path:
    """Refuse a folder that cannot take results, or holds some, unless of this suite and to be gone on with.

    Raises InputError saying what to do.
    """
    pyarrow()  # a missing extra is reported now, not after the work
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"{folder}: is not a folder, expected one to write the results to; choose"
            " another"
        )
    check_writable(folder)
    found = present(folder) if folder.exists() else []
    ours = any(name in (RESULTS, EPISODES, PARTS) for name in found)
    if ours and not resume:
        raise InputError(
            f"{folder}: already contains results; continue with --resume (resume=True),"
            " or choose another folder"
        )
    if (
        ours
        and (folder / RESULTS).is_file()
        and load_results(folder).summary["suite"]["name"] != suite
    ):
        raise InputError(
            f"{folder}: holds results of another suite than '{suite}'; choose another"
            " folder"
        )
    if found and not ours:
        raise InputError(
            f"{folder}: holds '{found[0]}', not a result of a benchmark; choose another"
            " folder"
        )
    return folder


def gathered(
    suite: str,
    tasks: Sequence[BenchmarkTask],
    who: Sequence[Contestant],
    done: Done,
    episodes: int,
) -> BenchmarkResult:
    """Put together what was done.

    `suite`: its name; `tasks`: those that were run; `done`: see
    `agents.benchmarking.run.results_of`; `episodes`: number of episodes of each task.
    """
    seeds = FIRST_SEED + np.arange(episodes)
    rows = [
        (one.name, task.name, number, seeds, run["episodes"])
        for one in who
        for task in tasks
        for number, run in enumerate(done[one.name, task.name]["runs"])
    ]
    table = joined(rows)
    about_tasks = {task.name: _about_task(task) for task in tasks}
    about = {
        "format": FORMAT,
        "kind": KIND,
        "versions": versions(),
        "suite": {"name": suite, "sha256": suite_hash(suite), "tasks": about_tasks},
        "seeds": {"first": FIRST_SEED, "count": episodes},
        "contestants": {one.name: _about_contestant(one, tasks, done) for one in who},
    }
    found = summary_of(suite, tasks, [one.name for one in who], done)
    file = {"file": EPISODES, "rows": len(table["seed"]), "sha256": None}
    code = tuple(one.source for one in who if one.is_text and names_code(one.source))
    return BenchmarkResult({**about, **found, "episodes": file}, table, code)


def versions() -> dict[str, str]:
    """Versions of what the results depend on, and the processor."""
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
        "on": task.on,
        "ship": task.behind,
    }


def _about_contestant(
    one: Contestant, tasks: Sequence[BenchmarkTask], done: Done
) -> dict[str, Any]:
    files = {
        path: code for task in tasks for path, code in one.fingerprint(task).items()
    }
    parts = {task.name: done[one.name, task.name] for task in tasks}
    return {
        "source": one.source if one.is_text else None,
        "files": files,
        "runs": max(len(part["runs"]) for part in parts.values()),
        "refused": {
            name: part["refused"] for name, part in parts.items() if part["refused"]
        },
    }


def load_results(path: str | Path) -> BenchmarkResult:
    """Read the results of a benchmark.

    Raises InputError naming the file and the field at fault.

    Parameters
    ----------
    path : str or Path
        Their folder, or `results.json` in it.
    """
    where = Path(path)
    where = where / RESULTS if where.is_dir() else where
    content = read_json(where, "file of benchmark results", REMEDY)
    if content.get("kind") != KIND:
        raise InputError(
            f"{where}: kind {content.get('kind')!r} found, expected '{KIND}': not"
            " benchmark results"
        )
    check_format(content, FORMAT, str(where))
    check_fields(content, FIELDS, str(where), REMEDY)
    check_summary(content, str(where))
    table = where.with_name(EPISODES)
    if content["episodes"]["sha256"] != file_hash(table):
        raise InputError(
            f"{table}: is not the one that {RESULTS} was written with, or is cut short;"
            f" {REMEDY}"
        )
    result = BenchmarkResult(
        dict(content), read_episodes(table, content["episodes"]["rows"])
    )
    _check_agree(result, str(where))
    return result


def _check_agree(result: BenchmarkResult, where: str) -> None:
    """The rows must be those of the contestants, tasks and seeds that the summary names."""
    count, episodes = result.summary["seeds"]["count"], result.episodes
    tasks = result.summary["tasks"]
    told = {
        (one, task): found["runs"]
        for task in tasks
        for one, found in tasks[task].items()
    }
    rows = Counter(
        zip(episodes["contestant"].tolist(), episodes["task"].tolist(), strict=True)
    )
    for one, task in [*told, *rows]:  # in the order of the summary, then of the table
        runs = told.get((one, task), 0)
        if rows[one, task] != runs * count:
            raise InputError(
                f"{where}: {rows[one, task]} episodes of '{one}' on '{task}' found in"
                f" {EPISODES}, expected {runs} runs of {count}; {REMEDY}"
            )
