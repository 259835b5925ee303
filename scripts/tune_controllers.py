"""Tune a suite's classical controllers by direct search, on the models of its tasks.

    python scripts/tune_controllers.py                      # what is missing
    python scripts/tune_controllers.py --tasks sharp-turns --again

The suite's file of tuned settings is written after every controller and task: stopped
at any moment, it goes on where it was.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from typing import Any

from direct_search import FIRST_SEED, tunable, tune

from agents.controllers.designs import CLASSICAL
from agents.suites.reference import load_tuned
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, load_suite, suite_file
from shipgym.files import write_json

EVALUATIONS, EPISODES = 24, 16  # of the shipped suite


def main() -> None:
    """Tune what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument("--tasks", help="names, separated by commas; by default all")
    parser.add_argument("--controllers", default=",".join(CLASSICAL))
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS)
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument(
        "--again", action="store_true", help="also what is there already"
    )
    arguments = parser.parse_args()
    for task in load_suite(arguments.suite).select(arguments.tasks):
        if task.on == "ship":
            tune_task(task.design_task, arguments)


def tune_task(task: BenchmarkTask, arguments: argparse.Namespace) -> None:
    """Tune controllers on a task and write the settings of each as it is found."""
    path = suite_file(task.suite, "tuned")
    tasks: dict[str, Any] = load_tuned(task.suite) if path.exists() else {}
    of_task = tasks.setdefault(task.name, {})
    for kind in arguments.controllers.split(","):
        if kind not in tunable(task) or (kind in of_task and not arguments.again):
            continue
        began = time.process_time()
        settings = {name: found["settings"] for name, found in of_task.items()}
        best = tune(kind, task, settings, arguments.evaluations, arguments.episodes)
        of_task[kind] = asdict(best)
        content = {
            "suite": arguments.suite,
            "evaluations": arguments.evaluations,
            "episodes": arguments.episodes,
            "first_seed": FIRST_SEED,
            "tasks": tasks,
        }
        write_json(content, path)
        seconds = time.process_time() - began
        costs = f"{best.start_cost:9.2f} -> {best.cost:9.2f}"
        print(f"{task.name:20s} {kind:14s} {costs}   {seconds:5.1f} s", flush=True)


if __name__ == "__main__":
    main()
