"""The summary of a benchmark: per task and contestant, the ranking, and who improves on whom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.contestants import ORACLE
from agents.benchmarking.statistics import (
    Draws,
    Interval,
    aggregate_score,
    finite,
    improvement,
    interquartile_cost,
    mean_cost,
    performance_profile,
    score,
)
from agents.suites.reference import reference_costs
from agents.suites.suite import N_EPISODES, BenchmarkTask

Floats = NDArray[np.float64]
Flown = Mapping[tuple[str, str], Mapping[str, Any]]

THRESHOLDS = np.linspace(-1.0, 1.5, 51)  # scores of the performance profile
NOTHING: dict[str, float | None] = {"value": None, "low": None, "high": None}


def summary_of(
    suite: str, tasks: Sequence[BenchmarkTask], names: Sequence[str], flown: Flown
) -> dict[str, Any]:
    """The fields `tasks`, `reference`, `ranking`, `improvement` and `profile` of the results.

    Parameters
    ----------
    suite : str
        Its name.
    tasks : sequence of BenchmarkTask
        Those that were flown.
    names : sequence of str
        Of the contestants.
    flown : dict of (contestant, task) to dict
        See `agents.benchmarking.run.flown_by`.
    """
    costs = {
        (name, k): np.stack([run["episodes"]["cost"] for run in flown[name, task.name]["runs"]])
        for name in names
        for k, task in enumerate(tasks)
        if flown[name, task.name]["runs"]
    }
    n_episodes = next((cost.shape[1] for cost in costs.values()), 1)
    known = reference_costs(suite) if n_episodes == N_EPISODES else {}  # which are of all scored episodes
    reference = {task.name: known[task.name] for task in tasks if task.name in known}
    draws = Draws(len(tasks), n_episodes)
    by_task = {
        task.name: _of_task(task.name, k, names, flown, costs, draws, reference)
        for k, task in enumerate(tasks)
    }
    return {
        "tasks": by_task,
        "reference": {task: {"pid": pid, "oracle": oracle} for task, (pid, oracle) in reference.items()},
        "ranking": _ranking(tasks, names, by_task, costs, draws, reference),
        "improvement": _improvements(names, costs, draws),
        "profile": _profiles(tasks, names, costs, reference),
    }


def _of_task(
    task: str,
    number: int,
    names: Sequence[str],
    flown: Flown,
    costs: Mapping[tuple[str, int], Floats],
    draws: Draws,
    reference: Mapping[str, tuple[float, float]],
) -> dict[str, Any]:
    """What each contestant did in one task."""
    taking_part = {name: costs[name, number] for name in names if (name, number) in costs}
    flyable = [cost.mean() for name, cost in taking_part.items() if name != ORACLE]
    lowest = min(flyable, default=np.nan)
    found = {}
    for name, cost in taking_part.items():
        who = list(names).index(name)
        runs = flown[name, task]["runs"]
        mean = mean_cost(cost, draws, number, who)
        found[name] = {
            "cost": mean.to_dict(),
            "cost_iqm": interquartile_cost(cost, draws, number, who).to_dict(),
            "score": _score(mean, reference[task]).to_dict() if task in reference else NOTHING,
            "relative_cost": finite(mean.value / lowest),
            "runs": len(runs),
            "lost": int(sum(np.nansum(run["episodes"].get("terminated", 0.0)) for run in runs)),
            "failed": int(sum(np.nansum(run["episodes"].get("failed", 0.0)) for run in runs)),
            "failure": next((run["failure"] for run in runs if run["failure"]), ""),
            "policy_sha256": [run["policy_sha256"] for run in runs],
            "microseconds_per_action": finite(
                1e6 * float(np.mean([run["seconds_per_action"] for run in runs]))
            ),
            "metrics": _figures([run["episodes"] for run in runs]),
        }
    return found


def _score(cost: Interval, reference: tuple[float, float]) -> Interval:
    """Score of a mean cost; a score falls as the cost rises, so its bounds change places."""
    return Interval(*(float(score(number, *reference)) for number in (cost.value, cost.high, cost.low)))


def _figures(runs: Sequence[Mapping[str, Floats]]) -> dict[str, dict[str, float | None]]:
    """Mean, median and 95th percentile of each figure that at least one episode has."""
    found = {}
    for name in runs[0]:
        values = np.concatenate([run[name] for run in runs])
        values = values[np.isfinite(values)]
        if len(values):
            median, p95 = np.percentile(values, [50.0, 95.0])
            found[name] = {"mean": finite(values.mean()), "median": finite(median), "p95": finite(p95)}
    return found


def _ranking(
    tasks: Sequence[BenchmarkTask],
    names: Sequence[str],
    by_task: Mapping[str, Mapping[str, Any]],
    costs: Mapping[tuple[str, int], Floats],
    draws: Draws,
    reference: Mapping[str, tuple[float, float]],
) -> list[dict[str, Any]]:
    """The contestants, those that flew all tasks first, the best first.

    By score if every task has its references, else by the geometric mean of their costs over the lowest.
    """
    entries = []
    for who, name in enumerate(names):
        flown = [k for k in range(len(tasks)) if (name, k) in costs]
        scored = [
            k
            for k in flown
            if tasks[k].name in reference and np.isfinite(score(0.0, *reference[tasks[k].name]))
        ]
        aggregate = dict(NOTHING)
        if scored:
            known = [reference[tasks[k].name] for k in scored]
            aggregate = aggregate_score([costs[name, k] for k in scored], known, draws, scored, who).to_dict()
        found = [by_task[tasks[k].name][name] for k in flown]
        relative = [one["relative_cost"] for one in found if one["relative_cost"]]
        entries.append(
            {
                "name": name,
                "score": aggregate,
                "scored_tasks": len(scored),
                "relative_cost": finite(np.exp(np.mean(np.log(relative)))) if relative else None,
                "tasks": len(flown),
                "lost": sum(one["lost"] for one in found),
                "failed": sum(one["failed"] for one in found),
            }
        )
    by_score = all(task.name in reference for task in tasks)
    return sorted(entries, key=lambda entry: _place(entry, by_score))


def _place(entry: Mapping[str, Any], by_score: bool) -> tuple[float, ...]:
    points = entry["score"]["value"] if by_score else None
    cost = entry["relative_cost"]
    return -entry["tasks"], -points if points is not None else np.inf, cost if cost is not None else np.inf


def _improvements(
    names: Sequence[str], costs: Mapping[tuple[str, int], Floats], draws: Draws
) -> dict[str, dict[str, Any]]:
    """Probability that one costs less than another, for all pairs."""
    by_name = [{k: cost for (who, k), cost in costs.items() if who == name} for name in names]
    return {
        one: {
            other: improvement(by_name[i], by_name[k], draws, (i, k)).to_dict()
            for k, other in enumerate(names)
            if k != i
        }
        for i, one in enumerate(names)
    }


def _profiles(
    tasks: Sequence[BenchmarkTask],
    names: Sequence[str],
    costs: Mapping[tuple[str, int], Floats],
    reference: Mapping[str, tuple[float, float]],
) -> dict[str, Any]:
    """Share of episodes whose score is above each threshold."""
    shares = {}
    for name in names:
        scores = [
            score(costs[name, k], *reference[task.name]).ravel()
            for k, task in enumerate(tasks)
            if (name, k) in costs and task.name in reference
        ]
        every = np.concatenate([np.zeros(0), *scores])
        every = every[np.isfinite(every)]
        if len(every):
            shares[name] = performance_profile(every, THRESHOLDS).tolist()
    return {"thresholds": THRESHOLDS.round(6).tolist(), "shares": shares}
