"""The summary of a benchmark: figures of each controller in each task, the ranking."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import gmean

from agents.benchmarking.cells import Cells, Options
from agents.benchmarking.statistics import mean_cost, mean_score
from agents.suites.benchmark_task import BenchmarkTask
from agents.suites.limits import exceeded
from agents.suites.suite import Suite
from shipgym.arrays import Floats, finite

#: Columns of the table of episodes that say what a row is of.
KEYS = ("controller", "task", "set", "run", "seed")
#: Figures of each controller by task and by set of episodes.
ByTask = Mapping[str, Mapping[str, Mapping[str, Any]]]


@dataclass(frozen=True, eq=False)
class Summary:
    """Statistics of all controllers in all tasks.

    Attributes
    ----------
    suite : Suite
    tasks : sequence of BenchmarkTask
        Those that were run.
    names : sequence of str
        Of the controllers.
    cells : mapping
        Every controller, and the rule of each task, by the names of both.
    rules : mapping of str to str
        Name of the rule in `cells` by task.
    options : Options
    """

    suite: Suite
    tasks: Sequence[BenchmarkTask]
    names: Sequence[str]
    cells: Cells
    rules: Mapping[str, str]
    options: Options

    @cached_property
    def episodes(self) -> pd.DataFrame:
        """A row for each episode of each controller; missing figures are NaN."""
        tables = []
        for name in self.names:
            for task in self.tasks:
                cell = self.cells[name, task.name]
                if not cell.refused:
                    tables.append(cell.table(name, task.name, self.options))
        table = pd.concat(
            tables,
            ignore_index=True,
        )
        return table.astype(
            dict.fromkeys(table.columns.difference(KEYS), np.float64),
        )

    def costs(self, name: str, on: str, part: str = "") -> dict[str, Floats]:
        """Costs of a controller by task, those of a part if it is given.

        Each has the shape (n_runs, n_episodes). The name "" stands for the rules.
        """
        found = {}
        for task in self.tasks:
            cell = self.cells[name or self.rules[task.name], task.name]
            is_wanted = not part or task.part == part
            if is_wanted and on in cell.figures:
                found[task.name] = cell.figures[on]["cost"]
        return found

    def by_task(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Return the figures of each controller in each set that it ran."""
        metrics = _metrics(self.episodes)
        found = {}
        for task in self.tasks:
            sets: dict[str, dict[str, Any]] = {on: {} for on in task.sets}
            found[task.name] = sets
            for on, name in product(task.sets, self.names):
                cell = self.cells[name, task.name]
                if not cell.refused:
                    means = metrics[task.name, on, name]
                    sets[on][name] = self._of_cell(task, on, name, means)
        return found

    def _of_cell(
        self, task: BenchmarkTask, on: str, name: str, means: dict[str, Any]
    ) -> dict[str, Any]:
        cell = self.cells[name, task.name]
        figures = cell.figures[on]
        costs = figures["cost"]
        return {
            "cost": mean_cost(costs, task.name),
            "score": mean_score({task.name: costs}, self.costs("", on)),
            "runs": len(costs),
            "lost": int(figures["terminated"].sum()),
            "failed": int(figures["failed"].sum()),
            "failure": cell.failures.get(on, ""),
            "exceeded": exceeded(task.limits, means),
            "metrics": means,
        }

    def rankings(self, by_task: ByTask) -> dict[str, list[dict[str, Any]]]:
        """Return the totals of the controllers by part of the suite, the best first.

        Those that could run all tasks come first, and of them those within all limits
        on the ship; they are ordered by the geometric mean of their mean costs. A part
        of which not all tasks were run has no scores.
        """
        rankings = {}
        for part in dict.fromkeys(task.part for task in self.tasks):
            totals = [self._total(name, part, by_task) for name in self.names]
            rankings[part] = sorted(totals, key=_sort_key)
        return rankings

    def _total(self, name: str, part: str, by_task: ByTask) -> dict[str, Any]:
        """Return the totals of a controller in the tasks of a part."""
        costs = self.costs(name, "ship", part)
        cells = [by_task[task]["ship"][name] for task in costs]
        means = [one.mean() for one in costs.values()]
        total = {
            "name": name,
            "tasks": len(costs),
            "of": sum(task.part == part for task in self.suite.tasks),
            "mean_cost": finite(float(gmean(means))) if means else None,
            "lost": sum(cell["lost"] for cell in cells),
            "failed": sum(cell["failed"] for cell in cells),
            "exceeding": [
                task for task in costs if by_task[task]["ship"][name]["exceeded"]
            ],
        }
        if total["tasks"] < total["of"]:
            return {**total, "scores": {}}
        scores = {}
        sets = {on: 0 for task in self.tasks if task.part == part for on in task.sets}
        for on in sets:
            mine, rules = self.costs(name, on, part), self.costs("", on, part)
            scores[on] = mean_score(mine, rules)
        return {**total, "scores": scores}


def _metrics(episodes: pd.DataFrame) -> dict[tuple[str, ...], dict[str, Any]]:
    """Mean and 95th percentile of each figure that an episode has.

    By task, set and controller, and by figure.
    """
    figures = episodes.columns.difference(KEYS, sort=False)
    groups = episodes.groupby(["task", "set", "controller"])[list(figures)]
    found: dict[tuple[str, ...], dict[str, Any]] = {}
    for name, table in (
        ("mean", groups.mean()),
        ("p95", groups.quantile(0.95)),
    ):
        for key, row in table.iterrows():
            for figure, value in row.dropna().items():
                found.setdefault(key, {}).setdefault(figure, {})[name] = float(value)
    return found


def _sort_key(total: Mapping[str, Any]) -> tuple[float, ...]:
    """Return what controllers are sorted by: tasks, limits, cost."""
    cost = total["mean_cost"]
    return (
        -total["tasks"],
        bool(total["exceeding"]),
        np.inf if cost is None else cost,
    )
