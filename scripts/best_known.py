"""Keep the lowest cost that anything reached in each scored episode of a suite.

    shipgym benchmark --suite shipgym-v2 --controllers wheel-over,tuned-wheel-over --out results
    python scripts/best_known.py --suite shipgym-v2 results            # of these results, and what is kept
    python scripts/best_known.py --suite shipgym-v2 results --search tuned-wheel-over,lq --tasks roll-limit

`zero` is the mean cost of the contestant `wheel-over`, designed on the model without search. The search
(`scripts/oracle.py`) goes on from what a contestant does, on the ship herself with the state known: what it
finds no autopilot may reach, and it stands in the file as `search from CONTESTANT`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from oracle import run_oracle

from agents.benchmarking.contestants import Contestant
from agents.benchmarking.results import load_results
from agents.suites.reference import best_known
from agents.suites.suite import N_EPISODES, load_suite, suite_file, suite_hash
from shipgym.files import write_json

ZERO = "wheel-over"


def main() -> None:
    """Write the file of best known costs anew."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("results", nargs="*", type=Path, help="folders of complete results")
    parser.add_argument("--suite", default="shipgym-v2")
    parser.add_argument("--tasks", default="", help="of the search, separated by commas; by default all")
    parser.add_argument("--search", default="", help="contestants to search from, separated by commas")
    asked = parser.parse_args()
    known: dict[str, Any] = best_known(asked.suite)
    for folder in asked.results:
        add_results(known, folder, asked.suite)
    write_json(known, suite_file(asked.suite, "best"))
    wanted = [name for name in asked.tasks.split(",") if name]
    for task in load_suite(asked.suite).tasks:
        if asked.search and (not wanted or task.name in wanted):
            ship, sailed, randomisation = task.sailed
            for source in asked.search.split(","):
                (policy,) = Contestant(source, source).policies(task, asked.suite)
                found = run_oracle(ship, sailed, task.seeds, policy, None, randomisation)
                keep(known, task.name, found.costs, f"search from {source}")
            write_json(known, suite_file(asked.suite, "best"))
    for name, one in known.items():
        by = {source: one["by"].count(source) for source in sorted(set(one["by"]))}
        print(f"{name:28s} zero {one['zero']:9.2f}  best known {np.mean(one['costs']):9.2f}  {by}")


def add_results(known: dict[str, Any], folder: Path, suite: str) -> None:
    """Costs of all contestants of a folder of results."""
    result = load_results(folder)
    about = result.summary
    if about["suite"]["sha256"] != suite_hash(suite) or about["seeds"]["count"] != N_EPISODES:
        raise SystemExit(f"{folder}: expected results of all episodes of {suite} as it is")
    for task, by_name in about["tasks"].items():
        if ZERO in by_name:
            known.setdefault(task, {"costs": [], "by": []})["zero"] = by_name[ZERO]["cost"]["value"]
        for name, found in by_name.items():
            if task in known and not found["failed"] and name != "best-known":
                keep(known, task, result.figures(name, task).min(axis=0), name)


def keep(known: dict[str, Any], task: str, costs: NDArray[np.float64], by: str) -> None:
    """Put costs in the place of those that are higher."""
    one = known[task]
    before = np.array(one["costs"] or np.full(len(costs), np.inf))
    names = one["by"] or [by] * len(costs)
    one["costs"] = np.minimum(before, costs).tolist()
    one["by"] = [by if less else name for less, name in zip(costs < before, names, strict=True)]


if __name__ == "__main__":
    main()
