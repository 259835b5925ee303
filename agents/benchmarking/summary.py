"""The summary of a benchmark: totals, the ranking, and who improves on whom."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from statistics import fmean
from typing import Any

import numpy as np

from agents.benchmarking import statistics
from agents.benchmarking.cells import Cell, Cells
from agents.benchmarking.sources import BEST_KNOWN
from agents.benchmarking.statistics import NOTHING, Draws, score
from agents.suites.limits import exceeded
from agents.suites.reference import ReferenceCosts, reference_costs
from agents.suites.suite import SETS, BenchmarkTask
from shipgym.arrays import Floats, finite


def summarise(
    tasks: Sequence[BenchmarkTask],
    names: Sequence[str],
    cells: Cells,
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
    for number, known in costs.reference.items():
        task_name = tasks[number].name
        reference[task_name] = {
            "rule": float(known.rule.mean()),
            "bound": float(known.bound.mean()),
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
    cells: Cells

    @cached_property
    def costs(self) -> dict[int, dict[int, Floats]]:
        """Costs by controller and by task that it ran, shape (n_runs, n_episodes)."""
        costs: dict[int, dict[int, Floats]] = {}
        for controller, name in enumerate(self.names):
            by_task = {}
            for number, task in enumerate(self.tasks):
                cell = self.cells[name, task.name]
                if cell.runs:
                    by_task[number] = cell.costs
            costs[controller] = by_task
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
    def reference(self) -> dict[int, ReferenceCosts]:
        """Costs of the rule, and the bound, in these episodes by task."""
        suite = self.tasks[0].suite
        known = reference_costs(suite) if suite else {}
        reference = {}
        for number, task in enumerate(self.tasks):
            if task.name in known:
                rule, bound = known[task.name]
                reference[number] = ReferenceCosts(
                    rule=rule[: self.n_episodes],
                    bound=bound[: self.n_episodes],
                )
        return reference

    @cached_property
    def rule_costs(self) -> dict[int, Floats]:
        """Costs of the rule by task, shape (n_episodes,)."""
        return {task: known.rule for task, known in self.reference.items()}

    def tasks_on(self, on: str) -> list[int]:
        """Return the numbers of the tasks of a set of episodes."""
        return [number for number, task in enumerate(self.tasks) if task.on == on]

    def of_task(self, task: int) -> dict[str, dict[str, Any]]:
        """Return the figures of each controller in a task, by name."""
        figures = {}
        lowest = self._lowest(task)
        task_name = self.tasks[task].name
        for controller, name in enumerate(self.names):
            if task in self.costs[controller]:
                cell = self.cells[name, task_name]
                costs = self._cost_figures(controller, task, lowest)
                run_figures = _run_figures(cell)
                limits = self.tasks[task].limits
                beyond = exceeded(limits, run_figures["metrics"])
                figures[name] = costs | run_figures | {"exceeded": beyond}
        return figures

    def _lowest(self, task: int) -> float:
        """Lowest mean cost in a task among controllers that are usable at sea."""
        means = []
        for controller, name in enumerate(self.names):
            costs = self.costs[controller]
            if task in costs and name != BEST_KNOWN:
                means.append(costs[task].mean())
        return min(means, default=np.nan)

    def _cost_figures(
        self, controller: int, task: int, lowest: float
    ) -> dict[str, Any]:
        """Costs, score and gain in a task, whose lowest cost is given."""
        costs = self.costs[controller][task]
        cost = statistics.mean_cost(costs, self.draws, task, controller)
        cost_iqm = statistics.interquartile_cost(costs, self.draws, task, controller)
        score = gain = NOTHING
        if task in self.rule_costs:
            score = statistics.mean_score(
                {task: costs}, self.rule_costs, self.draws, controller
            )
            gain = statistics.gain_over(
                costs,
                self.rule_costs[task],
                draws=self.draws,
                task=task,
                controllers=(controller, len(self.names)),
            )
        return {
            "cost": cost.to_dict(),
            "cost_iqm": cost_iqm.to_dict(),
            "score": score.to_dict(),
            "gain": gain.to_dict(),
            "relative_cost": finite(cost.value / lowest),
        }

    def ranking(self, by_task: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the controllers, the best first.

        Those that could run all tasks come first, and of them those within all limits;
        they are ordered by score if the rule's cost is known in every task, otherwise
        by relative cost.
        """
        elsewhere = [on for on in SETS if on != "ship" and self.tasks_on(on)]
        ranked = []
        for controller, name in enumerate(self.names):
            on_ship = self._total(controller, "ship", by_task)
            totals = {}
            for on in elsewhere:
                totals[on] = self._total(controller, on, by_task)
            ranked.append({"name": name, **on_ship, "elsewhere": totals})

        tasks = self.tasks_on("ship")
        by_score = all(task in self.rule_costs for task in tasks)
        return sorted(ranked, key=lambda total: _sort_key(total, by_score))

    def _total(
        self, controller: int, on: str, by_task: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the totals of a controller in all tasks of a set of episodes."""
        costs = self.costs[controller]
        tasks = [task for task in self.tasks_on(on) if task in costs]
        name = self.names[controller]
        cells = [by_task[self.tasks[task].name][name] for task in tasks]
        return {
            **self._scores(controller, tasks),
            "relative_cost": _relative_cost(cells),
            "tasks": len(tasks),
            "lost": sum(cell["lost"] for cell in cells),
            "failed": sum(cell["failed"] for cell in cells),
            "exceeding": sum(bool(cell["exceeded"]) for cell in cells),
        }

    def _scores(self, controller: int, tasks: Sequence[int]) -> dict[str, Any]:
        """Scores over tasks, and the probability of costing less than the rule."""
        scored = [task for task in tasks if task in self.rule_costs]
        costs = {task: self.costs[controller][task] for task in scored}
        rule_runs = {task: self.rule_costs[task][None, :] for task in scored}

        mean = statistics.mean_score(costs, self.rule_costs, self.draws, controller)
        middle = statistics.interquartile_score(
            costs, self.rule_costs, self.draws, controller
        )
        rule_number = len(self.names)
        better = statistics.improvement(
            costs=costs,
            other_costs=rule_runs,
            draws=self.draws,
            controllers=(controller, rule_number),
        )
        return {
            "score": mean.to_dict(),
            "score_iqm": middle.to_dict(),
            "improvement": better.to_dict(),
            "scored_tasks": len(scored),
        }

    def _on_ship(self, controller: int) -> dict[int, Floats]:
        """Costs of a controller by task, on the ship."""
        tasks = self.tasks_on("ship")
        costs = self.costs[controller]
        return {task: costs[task] for task in tasks if task in costs}

    def improvements(self) -> dict[str, dict[str, Any]]:
        """Return the probability that one costs less than another, for all pairs."""
        improvements: dict[str, dict[str, Any]] = {name: {} for name in self.names}
        for pair in permutations(range(len(self.names)), 2):
            first, second = pair
            better = statistics.improvement(
                costs=self._on_ship(first),
                other_costs=self._on_ship(second),
                draws=self.draws,
                controllers=pair,
            )
            others = improvements[self.names[first]]
            others[self.names[second]] = better.to_dict()
        return improvements

    def profiles(self) -> dict[str, Any]:
        """Return the share of episodes whose score is above each threshold."""
        shares = {}
        thresholds = np.arange(41) / 20.0  # scores of the performance profile
        for controller, name in enumerate(self.names):
            scores = self._episode_scores(controller)
            if len(scores):
                profile = statistics.performance_profile(scores, thresholds)
                shares[name] = profile.tolist()
        return {"thresholds": thresholds.tolist(), "shares": shares}

    def _episode_scores(self, controller: int) -> Floats:
        """Scores of all episodes on the ship, the rule in the same one, shape (n,)."""
        scores = [np.zeros(0)]
        for task, costs in self._on_ship(controller).items():
            if task in self.rule_costs:
                scores.append(score(costs, self.rule_costs[task]).ravel())
        all_scores = np.concatenate(scores)
        return all_scores[np.isfinite(all_scores)]


def _relative_cost(cells: Sequence[Mapping[str, Any]]) -> float | None:
    """Geometric mean of the relative costs that there are."""
    costs = [cell["relative_cost"] for cell in cells]
    known = [cost for cost in costs if cost]
    if not known:
        return None
    mean_log = np.mean(np.log(known))
    return finite(np.exp(mean_log))


def _run_figures(cell: Cell) -> dict[str, Any]:
    """Failures, times and metrics of all training runs of a cell."""
    failures = [run.failure for run in cell.runs if run.failure]
    seconds = fmean(run.seconds_per_action for run in cell.runs)
    return {
        "runs": len(cell.runs),
        "lost": cell.count("terminated"),
        "failed": cell.count("failed"),
        "failure": failures[0] if failures else "",
        "policy_sha256": [run.policy_sha256 for run in cell.runs],
        "microseconds_per_action": finite(1e6 * seconds),
        "metrics": _metrics(cell),
    }


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
    """Return what controllers are sorted by: tasks, limits, score, relative cost."""
    score = total["score"]["value"]
    if score is None or not by_score:
        score = -np.inf
    cost = total["relative_cost"]
    if cost is None:
        cost = np.inf
    is_beyond = total["exceeding"] > 0
    return (-total["tasks"], is_beyond, -score, cost)
