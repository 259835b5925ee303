"""The summary of a benchmark: totals, the ranking, and who improves on whom."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from typing import Any

import numpy as np

from agents.benchmarking import statistics
from agents.benchmarking.cells import Cell
from agents.benchmarking.sources import BEST_KNOWN
from agents.benchmarking.statistics import (
    NOTHING,
    Draws,
    Interval,
    ScoreScale,
    score,
)
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
    by_task = {}
    for number, task in enumerate(tasks):
        by_task[task.name] = costs.of_task(number)

    reference = {}
    for number, (zero, best) in costs.reference.items():
        task_name = tasks[number].name
        reference[task_name] = {"zero": zero, "best": best}
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
    def costs(self) -> dict[int, dict[int, Floats]]:
        """Costs by controller and by task that it ran, shape (n_runs, n_episodes)."""
        costs: dict[int, dict[int, Floats]] = {}
        for controller in range(len(self.names)):
            costs[controller] = {}
            for task in range(len(self.tasks)):
                cell = self.cell(controller, task)
                if cell.runs:
                    costs[controller][task] = cell.costs
        return costs

    @cached_property
    def n_episodes(self) -> int:
        """Number of episodes of each task."""
        for by_task in self.costs.values():
            for costs in by_task.values():
                return int(costs.shape[1])
        return 1

    @cached_property
    def draws(self) -> Draws:
        """Bootstrap draws that all controllers share."""
        return Draws(len(self.tasks), self.n_episodes)

    @cached_property
    def reference(self) -> dict[int, ScoreScale]:
        """Costs whose scores are 0 and 1 by task; they are of all scored episodes."""
        suite = self.tasks[0].suite
        if self.n_episodes < N_EPISODES or not suite:
            return {}
        known = reference_costs(suite)
        reference = {}
        for number, task in enumerate(self.tasks):
            if task.name in known:
                reference[number] = known[task.name]
        return reference

    def tasks_on(self, on: str) -> list[int]:
        """Return the numbers of the tasks of a set of episodes."""
        return [number for number, task in enumerate(self.tasks) if task.on == on]

    def of_task(self, task: int) -> dict[str, dict[str, Any]]:
        """Return the figures of each controller in a task, by name."""
        figures = {}
        lowest = self._lowest(task)
        for controller, by_task in self.costs.items():
            if task in by_task:
                name = self.names[controller]
                figures[name] = self._figures(controller, task, lowest)
        return figures

    def _lowest(self, task: int) -> float:
        """Lowest mean cost in a task among controllers that are usable at sea."""
        means = []
        for controller, by_task in self.costs.items():
            if task in by_task and self.names[controller] != BEST_KNOWN:
                means.append(by_task[task].mean())
        return min(means, default=np.nan)

    def _figures(self, controller: int, task: int, lowest: float) -> dict[str, Any]:
        """Return the figures of a controller in a task, whose lowest cost is given."""
        costs = self.costs[controller][task]
        cost = statistics.mean_cost(costs, self.draws, task, controller)
        cost_iqm = statistics.interquartile_cost(costs, self.draws, task, controller)
        score = _score_of(cost, self.reference.get(task))

        cell = self.cell(controller, task)
        seconds = float(np.mean([run.seconds_per_action for run in cell.runs]))
        failures = [run.failure for run in cell.runs if run.failure]
        return {
            "cost": cost.to_dict(),
            "cost_iqm": cost_iqm.to_dict(),
            "score": score.to_dict(),
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
        ranked = []
        for controller, name in enumerate(self.names):
            totals = {}
            for on in SETS:
                if on == "ship" or self.tasks_on(on):
                    totals[on] = self._total(controller, on, by_task)
            on_ship = totals.pop("ship")
            ranked.append({"name": name, **on_ship, "elsewhere": totals})

        tasks = self.tasks_on("ship")
        by_score = all(task in self.reference for task in tasks)
        return sorted(ranked, key=lambda total: _sort_key(total, by_score))

    def _total(
        self, controller: int, on: str, by_task: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the totals of a controller in all tasks of a set of episodes."""
        costs, name = self.costs[controller], self.names[controller]
        tasks = [task for task in self.tasks_on(on) if task in costs]
        scored = [task for task in tasks if self._has_room(task)]
        score = statistics.aggregate_score(
            costs=[costs[task] for task in scored],
            references=[self.reference[task] for task in scored],
            draws=self.draws,
            tasks=scored,
            controller=controller,
        )

        cells = [by_task[self.tasks[task].name][name] for task in tasks]
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

    def _on_ship(self, controller: int) -> dict[int, Floats]:
        """Costs of a controller by task, on the ship."""
        tasks = self.tasks_on("ship")
        costs = self.costs[controller]
        return {task: costs[task] for task in tasks if task in costs}

    def improvements(self) -> dict[str, dict[str, Any]]:
        """Return the probability that one costs less than another, for all pairs."""
        improvements: dict[str, dict[str, Any]] = {name: {} for name in self.names}
        numbers = range(len(self.names))
        for first, second in permutations(numbers, 2):
            better = statistics.improvement(
                costs=self._on_ship(first),
                other_costs=self._on_ship(second),
                draws=self.draws,
                controllers=(first, second),
            )
            name, other = self.names[first], self.names[second]
            improvements[name][other] = better.to_dict()
        return improvements

    def profiles(self) -> dict[str, Any]:
        """Return the share of episodes whose score is above each threshold."""
        shares = {}
        for controller, name in enumerate(self.names):
            scores = self._episode_scores(controller)
            if len(scores):
                profile = statistics.performance_profile(scores, THRESHOLDS)
                shares[name] = profile.tolist()
        return {"thresholds": THRESHOLDS.tolist(), "shares": shares}

    def _episode_scores(self, controller: int) -> Floats:
        """Scores of all episodes on the ship that have one, shape (n,)."""
        parts = [np.zeros(0)]
        for task, costs in self._on_ship(controller).items():
            if task in self.reference:
                zero, best = self.reference[task]
                scores = score(costs, zero, best)
                parts.append(scores.ravel())
        all_scores = np.concatenate(parts)
        return all_scores[np.isfinite(all_scores)]


def _score_of(cost: Interval, reference: ScoreScale | None) -> Interval:
    """Score of a mean cost; it falls as the cost rises, so that the bounds swap."""
    if reference is None:
        return NOTHING
    zero, best = reference
    costs = cost.value, cost.high, cost.low
    value, low, high = score(costs, zero, best).tolist()
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


def _sort_key(total: Mapping[str, Any], by_score: bool) -> tuple[float, ...]:
    """Return what controllers are sorted by: tasks, score, relative cost."""
    score = total["score"]["value"]
    cost = total["relative_cost"]
    has_score = by_score and score is not None
    return (
        -total["tasks"],
        -score if has_score else np.inf,
        np.inf if cost is None else cost,
    )
