"""The summary of a benchmark: totals, the ranking, and who improves on whom."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from agents.benchmarking import statistics
from agents.benchmarking.cells import Cell
from agents.benchmarking.sources import BEST_KNOWN
from agents.benchmarking.statistics import NOTHING, Draws, Interval, score
from agents.suites.reference import reference_costs
from agents.suites.suite import N_EPISODES, SETS, BenchmarkTask
from shipgym.arrays import Floats, finite

THRESHOLDS = np.arange(-20, 31) / 20.0  # scores of the performance profile


def summarise(
    tasks: Sequence[BenchmarkTask],
    names: Sequence[str],
    cells: Mapping[tuple[str, str], Cell],
) -> dict[str, Any]:
    """Return the fields `tasks`, `reference`, `ranking`, `improvement` and `profile`.

    Ranking, improvements and profiles are of the episodes on the ship; totals of the
    other sets of episodes stand in `elsewhere`.

    Parameters
    ----------
    tasks : sequence of BenchmarkTask
        Those that were run.
    names : sequence of str
        Of the controllers.
    cells : mapping
        Every controller in every task, by the names of both.
    """
    costs = _Costs(tuple(tasks), tuple(names), cells)
    by_task = {task.name: costs.cells_of(k) for k, task in enumerate(tasks)}
    reference = {
        tasks[task].name: {"zero": zero, "best": best}
        for task, (zero, best) in costs.reference.items()
    }
    return {
        "tasks": by_task,
        "reference": reference,
        "ranking": costs.ranking(by_task),
        "improvement": costs.improvements(),
        "profile": costs.profiles(),
    }


@dataclass(frozen=True)
class _Costs:
    """Costs of all controllers in all tasks, both known by their numbers in order."""

    tasks: tuple[BenchmarkTask, ...]
    names: tuple[str, ...]
    cells: Mapping[tuple[str, str], Cell]

    def cell(self, controller: int, task: int) -> Cell:
        """Return the cell of a controller in a task."""
        return self.cells[self.names[controller], self.tasks[task].name]

    @cached_property
    def costs(self) -> dict[tuple[int, int], Floats]:
        """Costs by controller and task, each of shape (n_runs, n_episodes)."""
        return {
            (controller, task): self.cell(controller, task).costs
            for controller in range(len(self.names))
            for task in range(len(self.tasks))
            if self.cell(controller, task).runs
        }

    @cached_property
    def n_episodes(self) -> int:
        """Number of episodes of each task."""
        return next((costs.shape[1] for costs in self.costs.values()), 1)

    @cached_property
    def draws(self) -> Draws:
        """Bootstrap draws that all controllers share."""
        return Draws(len(self.tasks), self.n_episodes)

    @cached_property
    def reference(self) -> dict[int, tuple[float, float]]:
        """Costs whose scores are 0 and 1 by task; they are of all scored episodes."""
        if self.n_episodes < N_EPISODES or not self.tasks[0].suite:
            return {}
        known = reference_costs(self.tasks[0].suite)
        return {
            number: known[task.name]
            for number, task in enumerate(self.tasks)
            if task.name in known
        }

    def tasks_on(self, on: str) -> list[int]:
        """Return the numbers of the tasks of a set of episodes."""
        return [number for number, task in enumerate(self.tasks) if task.on == on]

    def cells_of(self, task: int) -> dict[str, dict[str, Any]]:
        """Return what each controller came to in a task, by name."""
        controllers = [who for who, number in self.costs if number == task]
        means = [
            self.costs[who, task].mean()
            for who in controllers
            if self.names[who] != BEST_KNOWN
        ]
        lowest = min(means, default=np.nan)
        return {self.names[who]: self._about(who, task, lowest) for who in controllers}

    def _about(self, controller: int, task: int, lowest: float) -> dict[str, Any]:
        """Return what a controller came to in a task whose lowest mean cost is given."""
        cell, costs = self.cell(controller, task), self.costs[controller, task]
        cost = statistics.mean_cost(costs, self.draws, task, controller)
        cost_iqm = statistics.interquartile_cost(costs, self.draws, task, controller)
        reference = self.reference.get(task)
        seconds = float(np.mean([run.seconds_per_action for run in cell.runs]))
        failures = [run.failure for run in cell.runs if run.failure]
        return {
            "cost": cost.to_dict(),
            "cost_iqm": cost_iqm.to_dict(),
            "score": _score_of(cost, reference).to_dict(),
            "relative_cost": finite(cost.value / lowest),
            "runs": len(cell.runs),
            "lost": cell.count("terminated"),
            "failed": cell.count("failed"),
            "failure": failures[0] if failures else "",
            "policy_sha256": [run.policy_sha256 for run in cell.runs],
            "microseconds_per_action": finite(1e6 * seconds),
            "metrics": _metrics(cell),
        }

    def ranking(self, by_task: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the controllers, the best first.

        Those that could run all tasks come first; they are ordered by score if every
        task has references, otherwise by relative cost.
        """
        others = [on for on in SETS if on != "ship" and self.tasks_on(on)]
        ranked = [
            {
                "name": name,
                **self._total(controller, "ship", by_task),
                "elsewhere": {
                    on: self._total(controller, on, by_task) for on in others
                },
            }
            for controller, name in enumerate(self.names)
        ]
        by_score = all(task in self.reference for task in self.tasks_on("ship"))
        return sorted(ranked, key=lambda one: _sort_key(one, by_score))

    def _total(
        self, controller: int, on: str, by_task: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return what a controller came to in all tasks of a set of episodes."""
        tasks = [task for task in self.tasks_on(on) if (controller, task) in self.costs]
        scored = [task for task in tasks if self._has_room(task)]
        score = statistics.aggregate_score(
            [self.costs[controller, task] for task in scored],
            [self.reference[task] for task in scored],
            self.draws,
            scored,
            controller,
        )
        cells = [
            by_task[self.tasks[task].name][self.names[controller]] for task in tasks
        ]
        relative = [cell["relative_cost"] for cell in cells if cell["relative_cost"]]
        geometric_mean = np.exp(np.mean(np.log(relative))) if relative else np.nan
        return {
            "score": score.to_dict(),
            "scored_tasks": len(scored),
            "relative_cost": finite(geometric_mean),
            "tasks": len(tasks),
            "lost": sum(cell["lost"] for cell in cells),
            "failed": sum(cell["failed"] for cell in cells),
        }

    def _has_room(self, task: int) -> bool:
        """Tell whether the best known cost of a task is below that of wheel-over."""
        if task not in self.reference:
            return False
        zero, best = self.reference[task]
        return zero > best

    def improvements(self) -> dict[str, dict[str, Any]]:
        """Return the probability that one costs less than another, for all pairs."""
        on_ship = [
            {
                task: self.costs[controller, task]
                for task in self.tasks_on("ship")
                if (controller, task) in self.costs
            }
            for controller in range(len(self.names))
        ]
        improvements: dict[str, dict[str, Any]] = {name: {} for name in self.names}
        for first, name in enumerate(self.names):
            for second, other in enumerate(self.names):
                if first != second:
                    pair = (first, second)
                    better = statistics.improvement(
                        on_ship[first], on_ship[second], self.draws, pair
                    )
                    improvements[name][other] = better.to_dict()
        return improvements

    def profiles(self) -> dict[str, Any]:
        """Return the share of episodes whose score is above each threshold."""
        shares = {}
        for controller, name in enumerate(self.names):
            scores = [
                score(self.costs[controller, task], *self.reference[task]).ravel()
                for task in self.tasks_on("ship")
                if task in self.reference and (controller, task) in self.costs
            ]
            finite_scores = np.concatenate([np.zeros(0), *scores])
            finite_scores = finite_scores[np.isfinite(finite_scores)]
            if len(finite_scores):
                profile = statistics.performance_profile(finite_scores, THRESHOLDS)
                shares[name] = profile.tolist()
        return {"thresholds": THRESHOLDS.tolist(), "shares": shares}


def _score_of(cost: Interval, reference: tuple[float, float] | None) -> Interval:
    """Score of a mean cost; it falls as the cost rises, so that the bounds swap."""
    if reference is None:
        return NOTHING
    value, low, high = score([cost.value, cost.high, cost.low], *reference).tolist()
    return Interval(value, low, high)


def _metrics(cell: Cell) -> dict[str, dict[str, float | None]]:
    """Mean, median and 95th percentile of each figure that an episode has."""
    metrics = {}
    for name in cell.runs[0].figures:
        values = cell.values(name)
        if len(values):
            median, p95 = np.percentile(values, [50.0, 95.0])
            metrics[name] = {
                "mean": finite(values.mean()),
                "median": finite(median),
                "p95": finite(p95),
            }
    return metrics


def _sort_key(ranked: Mapping[str, Any], by_score: bool) -> tuple[float, ...]:
    """Return what controllers are sorted by: tasks, score, relative cost."""
    score = ranked["score"]["value"] if by_score else None
    cost = ranked["relative_cost"]
    return (
        -ranked["tasks"],
        np.inf if score is None else -score,
        np.inf if cost is None else cost,
    )
