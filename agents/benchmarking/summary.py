"""The summary of a benchmark: figures of each controller in each task, the ranking."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from agents.benchmarking.cells import Cell, Cells
from agents.benchmarking.statistics import (
    Draws,
    geometric_mean,
    improvement,
    mean_cost,
    mean_score,
)
from agents.suites.limits import exceeded
from agents.suites.suite import SETS, BenchmarkTask
from shipgym.arrays import Floats, finite

#: Columns of the table of episodes that say what a row is of.
KEYS = ("controller", "task", "run", "seed")


@dataclass(frozen=True, eq=False)
class Summary:
    """Statistics of all controllers in all tasks.

    Attributes
    ----------
    tasks : sequence of BenchmarkTask
        Those that were run.
    names : sequence of str
        Of the controllers.
    cells : mapping
        Every controller in every task, by the names of both.
    rule_cells : mapping of str to Cell
        The rule in every task.
    """

    tasks: Sequence[BenchmarkTask]
    names: Sequence[str]
    cells: Cells
    rule_cells: Mapping[str, Cell]

    @cached_property
    def episodes(self) -> pd.DataFrame:
        """A row for each controller, task, run and episode; missing figures are NaN."""
        tables = []
        for name in self.names:
            for task in self.tasks:
                cell = self.cells[name, task.name]
                if not cell.refused:
                    tables.append(cell.table(name, task.name))
        table = pd.concat(tables, ignore_index=True)
        figures = table.columns.difference(KEYS)
        return table.astype(dict.fromkeys(figures, np.float64))

    @cached_property
    def draws(self) -> Draws:
        """Bootstrap draws that all controllers share."""
        return Draws(len(self.tasks), self.episodes["seed"].nunique())

    @cached_property
    def rule_costs(self) -> dict[int, Floats]:
        """Costs of the rule by number of the task, where it could run it."""
        costs = {}
        for number, task in enumerate(self.tasks):
            cell = self.rule_cells[task.name]
            if not cell.refused and cell.costs.mean() > 0.0:
                costs[number] = cell.costs
        return costs

    def by_task(self) -> dict[str, dict[str, Any]]:
        """Return the figures of each controller in each task that it ran."""
        metrics = _metrics(self.episodes)
        totals = self.episodes.groupby(["task", "controller"])[["terminated", "failed"]]
        counts = totals.sum()
        by_task: dict[str, dict[str, Any]] = {}
        for number, task in enumerate(self.tasks):
            by_task[task.name] = {}
            for controller, name in enumerate(self.names):
                cell = self.cells[name, task.name]
                if cell.refused:
                    continue
                key = task.name, name
                by_task[task.name][name] = {
                    **self._costs(number, controller),
                    "runs": len(cell.costs),
                    "lost": int(counts.at[key, "terminated"]),
                    "failed": int(counts.at[key, "failed"]),
                    "failure": cell.failure,
                    "exceeded": exceeded(task.limits, metrics[key]),
                    "microseconds_per_action": finite(1e6 * cell.seconds_per_action),
                    "metrics": metrics[key],
                }
        return by_task

    def _costs(self, task: int, controller: int) -> dict[str, Any]:
        """Mean cost and score of a controller in a task."""
        costs = self.cells[self.names[controller], self.tasks[task].name].costs
        score = mean_score({task: costs}, self.rule_costs, self.draws, controller)
        return {
            "cost": mean_cost(costs, self.draws, task, controller),
            "score": score,
        }

    def ranking(self, by_task: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the totals of the controllers on the ship, the best first.

        Those that could run all tasks come first, and of them those within all limits;
        they are ordered by the geometric mean of their mean costs, as by their scores.
        `elsewhere` has the totals of the other sets of episodes.
        """
        ranked = []
        for controller, name in enumerate(self.names):
            totals = {}
            for on in SETS:
                if any(task.on == on for task in self.tasks):
                    totals[on] = self._total(controller, on, by_task)
            on_ship = totals.pop("ship", None) or self._total(
                controller, "ship", by_task
            )
            ranked.append({"name": name, **on_ship, "elsewhere": totals})
        return sorted(ranked, key=_sort_key)

    def _total(
        self, controller: int, on: str, by_task: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the totals of a controller in all tasks of a set of episodes."""
        name = self.names[controller]
        costs = {}
        cells = []
        for number, task in enumerate(self.tasks):
            if task.on == on and name in by_task[task.name]:
                costs[number] = self.cells[name, task.name].costs
                cells.append(by_task[task.name][name])

        means = [one.mean() for one in costs.values()]
        mean = geometric_mean(means) if means else np.nan
        return {
            "score": mean_score(costs, self.rule_costs, self.draws, controller),
            "improvement": improvement(costs, self.rule_costs, self.draws, controller),
            "mean_cost": finite(float(mean)),
            "tasks": len(cells),
            "lost": sum(cell["lost"] for cell in cells),
            "failed": sum(cell["failed"] for cell in cells),
            "exceeding": sum(bool(cell["exceeded"]) for cell in cells),
        }


def _metrics(episodes: pd.DataFrame) -> dict[tuple[str, str], dict[str, Any]]:
    """Mean, median and 95th percentile of each figure that an episode has.

    By task and controller, and by figure.
    """
    figures = episodes.columns.difference(KEYS, sort=False)
    groups = episodes.groupby(["task", "controller"])[list(figures)]
    statistics = {
        "mean": groups.mean(),
        "median": groups.median(),
        "p95": groups.quantile(0.95),
    }
    metrics = {}
    for key in groups.groups:
        known = statistics["mean"].loc[key].dropna().index
        metrics[key] = {
            figure: {
                name: finite(of.at[key, figure]) for name, of in statistics.items()
            }
            for figure in known
        }
    return metrics


def _sort_key(total: Mapping[str, Any]) -> tuple[float, ...]:
    """Return what controllers are sorted by: tasks, limits, cost."""
    cost = total["mean_cost"]
    is_beyond = total["exceeding"] > 0
    return (-total["tasks"], is_beyond, np.inf if cost is None else cost)
