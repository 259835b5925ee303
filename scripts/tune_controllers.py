"""Tune a suite's controllers by CMA-ES, on the models of its tasks.

    python scripts/tune_controllers.py                      # what is missing
    python scripts/tune_controllers.py --tasks sharp-turns --runs 5

Each run is a search with a seed of its own and the same budget of candidates and
episodes. The suite's file of tuned settings is written after every run: stopped at any
moment, the script goes on where it was.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from agents.suites.suite import DEFAULT_SUITE, load_suite, load_tuned, tuned_file
from agents.training.controller_search import SearchBudget, tune_controller
from shipgym.envs.engine import Engine
from shipgym.files import write_json


def main() -> None:
    """Tune what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument("--tasks", help="names, separated by commas; by default all")
    parser.add_argument("--controllers", default="preview-lq,wheel-over")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--candidates", type=int, default=500)
    parser.add_argument("--episodes", type=int, default=16)
    given = parser.parse_args()
    budget = SearchBudget(3600.0, given.candidates, given.episodes)
    suite = load_suite(given.suite)
    path = tuned_file(suite.source)
    known = load_tuned(suite.source) if path.exists() else {}
    for task in suite.select(given.tasks):
        kinds = given.controllers.split(",")
        if not task.design.task.follows_path:
            kinds = [task.rule.removeprefix("tuned-")]
        for kind in kinds if task.rule.startswith("tuned-") else ():
            of_task: dict[str, Any] = known.setdefault(task.name, {})
            runs = of_task.setdefault(kind, [])
            for seed in range(len(runs), given.runs):
                before = Engine.ship_steps
                found = tune_controller(kind, task, budget, seed=seed)
                steps = Engine.ship_steps - before
                runs.append({**asdict(found), "ship_steps": steps})
                write_json({"suite": given.suite, "tasks": known}, path)
                costs = f"{found.start_cost:.2f} -> {found.cost:.2f}"
                print(f"{task.name} {kind} {seed}: {costs}, {steps:,}", flush=True)


if __name__ == "__main__":
    main()
