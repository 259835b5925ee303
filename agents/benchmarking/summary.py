"""The summary of a benchmark: per task and contestant, the ranking, and who improves on which other."""

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import Any

import numpy as np

from agents.benchmarking import statistics
from agents.benchmarking.contestants import BEST_KNOWN
from agents.benchmarking.statistics import NOTHING, Draws, Interval, score
from agents.suites.reference import reference_costs
from agents.suites.suite import N_EPISODES, SETS, BenchmarkTask
from shipgym.arrays import Floats, finite

#: By contestant and task what `agents.benchmarking.run.results_of` answers.
Done = Mapping[tuple[str, str], Mapping[str, Any]]

THRESHOLDS = np.arange(-20, 31) / 20.0  # scores of the performance profile


def summary_of(
    suite: str, tasks: Sequence[BenchmarkTask], names: Sequence[str], done: Done
) -> dict[str, Any]:
    """The fields `tasks`, `reference`, `ranking`, `improvement` and `profile` of the results.

    `suite`: its name; `tasks`: those that were run; `names`: of the contestants;
    `done`: see `agents.benchmarking.run.results_of`. Ranking, improvements and profiles
    are of the episodes on the ship; what each contestant came to on the model and far
    from the design stands beside its place, `elsewhere`.
    """
    found = _Summary(suite, tasks, names, done)
    by_task = {task.name: found.task(k) for k, task in enumerate(tasks)}
    known = {
        tasks[k].name: {"zero": zero, "best": best}
        for k, (zero, best) in found.reference.items()
    }
    return {
        "tasks": by_task,
        "reference": known,
        "ranking": found.ranking(by_task),
        "improvement": found.improvements(),
        "profile": found.profiles(),
    }


class _Summary:
    """Costs of everybody in all tasks, and the draws of the bootstrap that are common to them."""

    def __init__(
        self,
        suite: str,
        tasks: Sequence[BenchmarkTask],
        names: Sequence[str],
        done: Done,
    ) -> None:
        self.tasks, self.names, self.done = (
            [task.name for task in tasks],
            list(names),
            done,
        )
        #: Numbers of the tasks of each set of episodes.
        self.sets = {
            on: [k for k, task in enumerate(tasks) if task.on == on] for on in SETS
        }
        #: By numbers of contestant and task, each of shape (n_runs, n_episodes).
        self.costs: dict[tuple[int, int], Floats] = {
            (who, k): np.stack(
                [run["episodes"]["cost"] for run in done[name, task]["runs"]]
            )
            for who, name in enumerate(names)
            for k, task in enumerate(self.tasks)
            if done[name, task]["runs"]
        }
        n_episodes = next((cost.shape[1] for cost in self.costs.values()), 1)
        known = (
            reference_costs(suite) if n_episodes == N_EPISODES else {}
        )  # which are of all scored episodes
        self.reference = {
            k: known[task] for k, task in enumerate(self.tasks) if task in known
        }
        self.draws = Draws(len(tasks), n_episodes)

    def task(self, number: int) -> dict[str, Any]:
        """What each contestant did in one task."""
        taking_part = {
            who: cost for (who, k), cost in self.costs.items() if k == number
        }
        means = [
            cost.mean()
            for who, cost in taking_part.items()
            if self.names[who] != BEST_KNOWN
        ]
        lowest, reference, found = (
            min(means, default=np.nan),
            self.reference.get(number),
            {},
        )
        for who, cost in taking_part.items():
            runs = self.done[self.names[who], self.tasks[number]]["runs"]
            mean = statistics.mean_cost(cost, self.draws, number, who)
            usual = statistics.interquartile_cost(cost, self.draws, number, who)
            seconds = float(np.mean([run["seconds_per_action"] for run in runs]))
            found[self.names[who]] = {
                "cost": mean.to_dict(),
                "cost_iqm": usual.to_dict(),
                "score": (
                    (
                        NOTHING if reference is None else _score(mean, reference)
                    ).to_dict()
                ),
                "relative_cost": finite(mean.value / lowest),
                "runs": len(runs),
                "lost": _count(runs, "terminated"),
                "failed": _count(runs, "failed"),
                "failure": next((run["failure"] for run in runs if run["failure"]), ""),
                "policy_sha256": [run["policy_sha256"] for run in runs],
                "microseconds_per_action": finite(1e6 * seconds),
                "metrics": _figures([run["episodes"] for run in runs]),
            }
        return found

    def ranking(self, by_task: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
        """The contestants, those that took part in all tasks first, the best first.

        By score if every task has its references, else by the geometric mean of their
        costs over the lowest.
        """
        others, found = [on for on in SETS if on != "ship" and self.sets[on]], []
        for who, name in enumerate(self.names):
            elsewhere = {on: self._entry(who, on, by_task) for on in others}
            found.append(
                {
                    "name": name,
                    **self._entry(who, "ship", by_task),
                    "elsewhere": elsewhere,
                }
            )
        by_score = all(k in self.reference for k in self.sets["ship"])
        return sorted(found, key=lambda entry: _place(entry, by_score))

    def _entry(
        self, who: int, on: str, by_task: Mapping[str, Mapping[str, Any]]
    ) -> dict[str, Any]:
        """What a contestant came to in the tasks of a set."""
        part = [k for k in self.sets[on] if (who, k) in self.costs]
        scored = [
            k for k in part if k in self.reference and np.greater(*self.reference[k])
        ]
        costs, known = (
            [self.costs[who, k] for k in scored],
            [self.reference[k] for k in scored],
        )
        found = [by_task[self.tasks[k]][self.names[who]] for k in part]
        relative = [one["relative_cost"] for one in found if one["relative_cost"]]
        return {
            "score": (
                statistics.aggregate_score(
                    costs, known, self.draws, scored, who
                ).to_dict()
            ),
            "scored_tasks": len(scored),
            "relative_cost": (
                finite(np.exp(np.mean(np.log(relative)))) if relative else None
            ),
            "tasks": len(part),
            "lost": sum(one["lost"] for one in found),
            "failed": sum(one["failed"] for one in found),
        }

    def improvements(self) -> dict[str, dict[str, Any]]:
        """Probability that one costs less than another, for all pairs."""
        ship, n = self.sets["ship"], len(self.names)
        costs = [
            {k: self.costs[who, k] for k in ship if (who, k) in self.costs}
            for who in range(n)
        ]
        found: dict[str, dict[str, Any]] = {name: {} for name in self.names}
        for i, k in permutations(range(n), 2):
            better = statistics.improvement(costs[i], costs[k], self.draws, (i, k))
            found[self.names[i]][self.names[k]] = better.to_dict()
        return found

    def profiles(self) -> dict[str, Any]:
        """Share of episodes whose score is above each threshold."""
        shares = {}
        for who, name in enumerate(self.names):
            scores = [
                score(self.costs[who, k], *known).ravel()
                for k, known in self.reference.items()
                if (who, k) in self.costs and k in self.sets["ship"]
            ]
            every = np.concatenate([np.zeros(0), *scores])
            every = every[np.isfinite(every)]
            if len(every):
                shares[name] = statistics.performance_profile(
                    every, THRESHOLDS
                ).tolist()
        return {"thresholds": THRESHOLDS.tolist(), "shares": shares}


def _count(runs: Sequence[Mapping[str, Any]], figure: str) -> int:
    """Episodes of which a figure is true."""
    return int(sum(np.nansum(run["episodes"].get(figure, 0.0)) for run in runs))


def _score(cost: Interval, reference: tuple[float, float]) -> Interval:
    """Score of a mean cost; a score falls as the cost rises, so its bounds change places."""
    return Interval(
        *(
            float(score(number, *reference))
            for number in (cost.value, cost.high, cost.low)
        )
    )


def _figures(
    runs: Sequence[Mapping[str, Floats]],
) -> dict[str, dict[str, float | None]]:
    """Mean, median and 95th percentile of each figure that at least one episode has."""
    found = {}
    for name in runs[0]:
        values = np.concatenate([run[name] for run in runs])
        values = values[np.isfinite(values)]
        if len(values):
            median, p95 = np.percentile(values, [50.0, 95.0])
            found[name] = {
                "mean": finite(values.mean()),
                "median": finite(median),
                "p95": finite(p95),
            }
    return found


def _place(entry: Mapping[str, Any], by_score: bool) -> tuple[float, ...]:
    points = entry["score"]["value"] if by_score else None
    cost = entry["relative_cost"]
    return (
        -entry["tasks"],
        -points if points is not None else np.inf,
        cost if cost is not None else np.inf,
    )
