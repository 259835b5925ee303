"""Tune a suite's classical controllers by direct search: the suite's file of tuned settings.

    python scripts/tune_controllers.py                      # what is missing
    python scripts/tune_controllers.py --tasks mariner-calm --again

The file is written after every controller and task: stopped at any moment, it goes on
where it was. Where a task has a ship behind its model, they are tuned on the model;
`scripts/best_known.py` keeps costs.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from typing import Any

from direct_search import EPISODES, EVALUATIONS, FIRST_SEED, tunable, tune

from agents.controllers.designs import CLASSICAL
from agents.suites.reference import load_tuned
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, load_suite, suite_file
from shipgym.files import write_json


def main() -> None:
    """Tune, and say what came out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument(
        "--tasks", default="", help="names, separated by commas; by default all"
    )
    parser.add_argument("--controllers", default=",".join(CLASSICAL))
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS)
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument(
        "--again", action="store_true", help="also what is there already"
    )
    asked = parser.parse_args()
    suite = load_suite(asked.suite)
    tasks = [suite.task(name) for name in asked.tasks.split(",") if name] or list(
        suite.tasks
    )
    tasks = [task.design_task for task in tasks if task.on == "ship"]
    for task in tasks:
        tune_task(task, asked)


def tune_task(task: BenchmarkTask, asked: argparse.Namespace) -> None:
    """Tune all controllers on a task and write each as it is found."""
    found: dict[str, Any] = (
        load_tuned(asked.suite) if suite_file(asked.suite, "tuned").exists() else {}
    )
    own = found.setdefault(task.name, {})
    for kind in asked.controllers.split(","):
        if kind not in tunable(task) or (kind in own and not asked.again):
            continue
        began = time.process_time()
        settings = {name: one["settings"] for name, one in own.items()}
        best = tune(kind, task, settings, asked.evaluations, asked.episodes)
        own[kind] = asdict(best)
        budget = {
            "evaluations": asked.evaluations,
            "episodes": asked.episodes,
            "first_seed": FIRST_SEED,
        }
        write_json(
            {"suite": asked.suite, **budget, "tasks": found},
            suite_file(asked.suite, "tuned"),
        )
        spent = time.process_time() - began
        costs = f"{best.start_cost:9.2f} -> {best.cost:9.2f}"
        print(f"{task.name:20s} {kind:14s} {costs}   {spent:5.1f} s", flush=True)


if __name__ == "__main__":
    main()
