"""Results of a benchmark: a row for each episode, and the summary; both as files.

docs/benchmark.md describes `results.json`; `episodes.parquet` has one row for each
controller, task, set of episodes, run and seed.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from os.path import isdir
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from agents.benchmarking.cells import Cells, Options
from agents.benchmarking.entries import Entry, file_hash
from agents.benchmarking.summary import Summary
from agents.controllers.interface import model_hash
from agents.output import check_results, versions
from agents.suites.benchmark_task import BenchmarkTask
from agents.suites.suite import Suite
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_format
from shipgym.drafts import atomic_path
from shipgym.errors import InputError
from shipgym.extras import axes_of, library
from shipgym.files import make_folder, read_json, write_json
from shipgym.plots import MODEL

RESULTS, EPISODES, PARTS = "results.json", "episodes.parquet", "parts"
FORMAT, KIND = 5, "shipgym-benchmark"
PACKAGES = ("numpy", "numba", "scipy", "control")
REMEDY = "run `shipgym benchmark` again"


@dataclass(frozen=True, eq=False)
class BenchmarkResult:
    """Results of a benchmark.

    Attributes
    ----------
    summary : dict
        Content of `results.json`.
    episodes : DataFrame
        One row for each episode: controller, task, set, run, seed, and figures by name.
    """

    summary: dict[str, Any]
    episodes: pd.DataFrame

    @property
    def ranking(self) -> list[str]:
        """Names of the controllers, the best of the first part first."""
        first, *_ = self.summary["ranking"].values()
        return [ranked["name"] for ranked in first]

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks."""
        return tuple(self.summary["tasks"])

    def cells(self, task: str, on: str = "ship") -> dict[str, Any]:
        """Return the figures in a task of each controller that could run it.

        `on`: the set of episodes; there is nothing in one that the task has not.
        """
        cells: dict[str, Any] = self.summary["tasks"][task].get(on, {})
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
            own = self.to_frame().query("controller == @name and failure != ''")
            for failure, rows in own.groupby("failure", sort=False):
                tasks = ", ".join(rows["task"].unique())
                failures.append(
                    f"{name} in {tasks}: {failure} ({rows['failed'].sum()} episodes"
                    " failed)"
                )
        return failures

    def figures(
        self, controller: str, task: str, name: str = "cost", on: str = "ship"
    ) -> Floats:
        """Return a figure of each episode of a set, shape (n_runs, n_episodes).

        There are no runs where the controller could not run the task.
        """
        check_choice(controller, self.summary["controllers"], "controller")
        check_choice(task, self.tasks, "task")
        check_choice(name, list(self.episodes.columns), "figure")
        check_choice(on, set(self.episodes["set"]), "set")
        own = self.episodes.query("controller == @controller and task == @task")
        by_run = own[own["set"] == on].pivot(index="run", columns="seed", values=name)
        figures: Floats = by_run.to_numpy(np.float64)
        return figures

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each controller in each set of episodes of each task.

        With mean cost and score, each with its interval, what was lost and failed, and
        the mean of each figure.
        """
        rows = []
        for task, sets in self.summary["tasks"].items():
            for on, cells in sets.items():
                for name, cell in cells.items():
                    place = {"controller": name, "task": task, "set": on}
                    rows.append(place | _figures(cell))
        return pd.DataFrame(rows)

    def plot(self, ax: Any = None) -> Any:
        """Draw the ranking on axes of matplotlib, and return these.

        Scores on the ship with their 95 % intervals, those of the first part of the
        suite that has any.

        ax : matplotlib.axes.Axes, optional
            By default the current ones.
        """
        ax = axes_of(ax)
        for totals in self.summary["ranking"].values():
            scored = [one for one in totals if one["scores"]]
            if scored:
                names = [one["name"] for one in scored]
                scores = pd.DataFrame([one["scores"]["ship"] for one in scored])
                ax.hlines(names, scores["low"], scores["high"], color=MODEL)
                ax.plot(scores["value"], names, "o", color=MODEL)
                break
        ax.set_xlabel("score: cost of the rule over that of the controller")
        ax.invert_yaxis()
        return ax

    def save(self, folder: str | Path) -> Self:
        """Write `episodes.parquet` and then `results.json`, each whole or not at all.

        Returns the result itself. Raises InputError if pyarrow is missing or the folder
        cannot be written.
        """
        _pyarrow()
        target = Path(folder)
        make_folder(target)
        with atomic_path(target / EPISODES) as draft:
            self.episodes.to_parquet(draft, engine="pyarrow", index=False)
        content = {**self.summary, "sha256": _hash(self.summary, target / EPISODES)}
        write_json(content, target / RESULTS)
        return self


def _pyarrow() -> Any:
    """Return pyarrow; InputError says how it is installed."""
    return library("pyarrow", "benchmark", "the table of episodes needs it")


def check_new(folder: Path, resume: bool) -> Path:
    """Refuse a folder that cannot take results; one that has some is for `resume`.

    Raises InputError saying what to do.
    """
    _pyarrow()  # a missing extra is reported now, not after the work
    if resume and not folder.exists():
        raise InputError(f"{folder}: no results are there; leave --resume out to begin")
    check_results(folder, (RESULTS, EPISODES, PARTS), resume)
    return folder


def collect(
    suite: Suite,
    tasks: Sequence[BenchmarkTask],
    entries: Sequence[Entry],
    cells: Cells,
    rules: Mapping[str, str],
    options: Options,
) -> BenchmarkResult:
    """Put together what was run.

    `cells` has every entry in every task, by the names of both, and of each task that
    of its rule, whose name `rules` has. Raises InputError if no entry could run any
    task.
    """
    own = [cells[entry.name, task.name] for entry in entries for task in tasks]
    if all(cell.refused for cell in own):
        raise InputError(
            f"controllers: no controller could run any task; '{entries[0].name}' in"
            f" '{tasks[0].name}': {own[0].refused}"
        )
    computed = Summary(
        suite,
        tasks,
        [entry.name for entry in entries],
        cells,
        rules,
        options,
    )
    by_task = computed.by_task()
    source = Path(suite.source)
    summary = {
        "format": FORMAT,
        "kind": KIND,
        "versions": versions(*PACKAGES),
        "suite": {
            "name": suite.name,
            "sha256": suite.sha256,
            "file": source.name if source.suffix == ".toml" else "",
            "n_tasks": len(suite.tasks),
            "tasks": {
                task.name: {**task.to_dict(), "model_sha256": model_hash(task.ship)}
                for task in tasks
            },
        },
        "options": options._asdict(),
        "controllers": {
            entry.name: _about_entry(entry, tasks, cells) for entry in entries
        },
        "tasks": by_task,
        "ranking": computed.rankings(by_task),
    }
    return BenchmarkResult(summary, computed.episodes)


def _figures(cell: Mapping[str, Any]) -> dict[str, Any]:
    figures = {name: one["mean"] for name, one in cell["metrics"].items()}
    for part in ("cost", "score"):
        found = cell[part]
        figures[part] = found["value"]
        figures[f"{part}_low"] = found["low"]
        figures[f"{part}_high"] = found["high"]
    counts = {part: cell[part] for part in ("runs", "lost", "failed", "failure")}
    return figures | counts


def _about_entry(
    entry: Entry,
    tasks: Sequence[BenchmarkTask],
    cells: Cells,
) -> dict[str, Any]:
    files: dict[str, str] = {}
    for task in tasks:
        files |= entry.fingerprint(task)
    own = {task.name: cells[entry.name, task.name] for task in tasks}
    made = [cell for cell in own.values() if not cell.refused]
    return {
        "source": entry.source if entry.is_text else None,
        "files": files,
        "refused": {task: one.refused for task, one in own.items() if one.refused},
        "ship_steps": float(np.mean([cell.ship_steps for cell in made] or [0.0])),
        "seconds": float(np.mean([cell.seconds for cell in made] or [0.0])),
    }


def load_results(path: str | Path) -> BenchmarkResult:
    """Read the results of a benchmark from their folder, or `results.json` in it.

    Raises InputError naming the file and the field at fault.
    """
    where = Path(path)
    if isdir(where):
        where = where / RESULTS
    summary = read_json(where, "file of benchmark results", REMEDY)
    kind = summary.get("kind")
    if kind != KIND:
        raise InputError(f"{where}: kind: expected '{KIND}', got {kind!r}")
    check_format(summary, FORMAT, str(where))
    table = where.with_name(EPISODES)
    content = dict(summary)
    if content.pop("sha256", "") != _hash(content, table):
        raise InputError(
            f"{where}: expected it and {EPISODES} as the benchmark wrote them, got"
            f" other content; {REMEDY}"
        )
    _pyarrow()
    return BenchmarkResult(content, pd.read_parquet(table, engine="pyarrow"))


def _hash(summary: Mapping[str, Any], table: Path) -> str:
    """SHA-256 of a summary and of the table of episodes beside it."""
    text = json.dumps(summary, sort_keys=True) + file_hash(table)
    return sha256(text.encode()).hexdigest()
