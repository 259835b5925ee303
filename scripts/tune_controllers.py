"""Tune a suite's controllers by CMA-ES, on the models of its tasks.

    python scripts/tune_controllers.py                      # what is missing
    python scripts/tune_controllers.py --tasks sharp-turns --again

All have the same budget of processor seconds and episodes. MPC, which takes fifty times
as long for a command, is led by what was found for `preview-lq` where that costs less
on the model. The suite's file of tuned settings is written after every controller and
task: stopped at any moment, it goes on where it was.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from agents.controllers.designs import INNER
from agents.suites.suite import (
    DEFAULT_SUITE,
    BenchmarkTask,
    load_suite,
    load_tuned,
    suite_file,
)
from agents.training.controller_search import (
    FIRST_SEED,
    FoundSettings,
    SearchBudget,
    tune_controller,
    unseen_episodes,
)
from agents.training.controller_space import search_space
from shipgym.files import write_json

CONTROLLERS = ("lq", "ilos", "wheel-over", "preview-lq", "mpc")
RULE = "preview-lq"


def main() -> None:
    """Tune what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument("--tasks", help="names, separated by commas; by default all")
    parser.add_argument("--controllers", default=",".join(CONTROLLERS))
    parser.add_argument("--seconds", type=float, default=75.0)
    parser.add_argument("--episodes", type=int, default=16)
    parser.add_argument(
        "--again", action="store_true", help="also what is there already"
    )
    arguments = parser.parse_args()
    for task in load_suite(arguments.suite).select(arguments.tasks):
        if task.on == "ship":
            tune_task(task.design_task, arguments)


def tune_task(task: BenchmarkTask, arguments: argparse.Namespace) -> None:
    """Tune controllers on a task and write the settings of each as it is found."""
    budget = SearchBudget(seconds=arguments.seconds, episodes=arguments.episodes)
    path = suite_file(task.suite, "tuned")
    for kind in arguments.controllers.split(","):
        of_task = kept_settings(task).get(task.name, {})
        if kind in of_task and not arguments.again:
            continue
        if kind == "mpc":
            best = led_by_rule(task, of_task[RULE])
        else:
            best = tune_controller(kind, task, budget)
        of_task = {**kept_settings(task).get(task.name, {}), kind: asdict(best)}
        judge_alike(task, of_task, arguments.episodes)
        tasks = kept_settings(task)  # others may have tuned other tasks meanwhile
        tasks[task.name] = of_task
        content = {
            "suite": arguments.suite,
            "seconds": arguments.seconds,
            "episodes": arguments.episodes,
            "first_seed": FIRST_SEED,
            "tasks": tasks,
        }
        write_json(content, path)
        costs = f"{best.start_cost:9.2f} -> {best.cost:9.2f}"
        print(f"{task.name:20s} {kind:14s} {costs}  {best.seconds:5.1f} s", flush=True)


def judge_alike(task: BenchmarkTask, of_task: dict[str, Any], episodes: int) -> None:
    """Note what all that was found for a task costs on the same unseen episodes.

    Searches of other numbers of episodes were judged on others.
    """
    for kind, found in of_task.items():
        if kind == "mpc":
            continue  # which was judged on those of the rule
        judges = unseen_episodes(kind, task, episodes)
        start, cost = judges.costs([{}, found["settings"]])
        found |= {"start_cost": float(start), "cost": float(cost)}


def kept_settings(task: BenchmarkTask) -> dict[str, Any]:
    """Settings by task and controller that the file of its suite holds."""
    path = suite_file(task.suite, "tuned")
    return load_tuned(task.suite) if path.exists() else {}


def led_by_rule(task: BenchmarkTask, found: dict[str, Any]) -> FoundSettings:
    """Settings of MPC: those found for the rule, or its own where they cost less."""
    rule = found["settings"]
    settings = {
        "lookahead_lengths": rule["lookahead_lengths"],
        "reach_lengths": effective_lead(rule),
        "crab_share": rule["crab_share"],
    }
    for setting in search_space("lq", task):
        name = INNER + setting.name
        settings[name] = rule[name]
    candidates: list[dict[str, float]] = [{}, settings]
    costs = unseen_episodes("mpc", task, found["episodes"]).costs(candidates)
    better = int(np.argmin(costs))
    return replace(
        FoundSettings(**found),
        settings=candidates[better],
        cost=float(costs[better]),
        start_cost=float(costs[0]),
    )


def effective_lead(rule: dict[str, float]) -> float:
    """Distance ahead, ship lengths, whose course is as much as the rule's."""
    knots = [0.0, 0.1, 0.2, 0.3, 0.6, 1.0]
    weights = [*[rule[f"weight_{number}"] for number in range(5)], 0.0]
    within = float(np.trapezoid(weights, knots))
    return max(0.1, rule["reach_lengths"] * within)


if __name__ == "__main__":
    main()
