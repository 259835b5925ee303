"""Keep the lowest cost that anything reached in each scored episode of a suite.

    shipgym benchmark --suite shipgym-v2 --controllers wheel-over,tuned-wheel-over --out
    results python scripts/best_known.py --suite shipgym-v2 results            # of
    these results, and what is kept python scripts/best_known.py --suite shipgym-v2
    results --search lq,tuned-wheel-over --tasks roll-limit python scripts/best_known.py
    --suite shipgym-v2 results --rule --episodes 6    # for docs/benchmark.md

`zero` is the mean cost of the contestant `wheel-over`, designed on the model without
search. The search (`scripts/oracle.py`) goes on, in each episode, from what the best of
the contestants named does, on the ship herself with the state known: what it finds no
autopilot may reach, and it stands in the file as `search`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from agents.benchmarking.contestants import LEARNED, Contestant
from numpy.typing import NDArray
from oracle import OracleSettings, run_oracle

from agents.benchmarking.results import BenchmarkResult, load_results
from agents.suites.reference import best_known
from agents.suites.suite import (
    N_EPISODES,
    BenchmarkTask,
    load_suite,
    suite_file,
    suite_hash,
)
from shipgym.files import write_json

ZERO, SEARCH = "wheel-over", "search"
# between the best baseline and the best known, of a task that is there for learning
ROOM = 0.08


def main() -> None:
    """Write the file of best known costs anew."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "results", nargs="*", type=Path, help="folders of results, the first complete"
    )
    parser.add_argument("--suite", default="shipgym-v2")
    parser.add_argument(
        "--tasks", default="", help="of the search, separated by commas; by default all"
    )
    parser.add_argument(
        "--search", default="", help="contestants to search from, separated by commas"
    )
    parser.add_argument(
        "--episodes",
        type=int,
        default=N_EPISODES,
        help="of search and rule, the first ones",
    )
    parser.add_argument(
        "--passes", type=int, default=OracleSettings.passes, help="of the search"
    )
    parser.add_argument(
        "--rule",
        action="store_true",
        help="only print whether the rule of choice holds",
    )
    asked = parser.parse_args()
    known: dict[str, Any] = best_known(asked.suite)
    if asked.rule:
        print(
            rule(
                known,
                asked.suite,
                [load_results(one) for one in asked.results],
                asked.episodes,
            )
        )
        return
    for folder in asked.results:
        add_results(known, folder, asked.suite)
    write_json(known, suite_file(asked.suite, "best"))
    wanted = [name for name in asked.tasks.split(",") if name]
    for task in load_suite(asked.suite).tasks:
        if asked.search and (not wanted or task.name in wanted):
            search(known, task, asked)
            write_json(known, suite_file(asked.suite, "best"))
    for name, one in known.items():
        by = {source: one["by"].count(source) for source in sorted(set(one["by"]))}
        print(
            f"{name:28s} zero {one['zero']:9.2f}  best known"
            f" {np.mean(one['costs']):9.2f}  {by}"
        )


def add_results(known: dict[str, Any], folder: Path, suite: str) -> None:
    """Costs of all contestants of a folder of results; `zero` is taken from all episodes only."""
    result = load_results(folder)
    about = result.summary
    if about["suite"]["sha256"] != suite_hash(suite):
        raise SystemExit(f"{folder}: expected results of {suite} as it is")
    whole = about["seeds"]["count"] == N_EPISODES
    for task, by_name in about["tasks"].items():
        if ZERO in by_name and whole:
            known.setdefault(task, {"costs": [], "by": []})["zero"] = by_name[ZERO][
                "cost"
            ]["value"]
        for name, found in by_name.items():
            if task in known and not found["failed"] and name != "best-known":
                costs = result.figures(name, task).min(axis=0)
                keep(
                    known,
                    task,
                    np.pad(costs, (0, N_EPISODES - len(costs)), constant_values=np.inf),
                    name,
                )


def search(
    known: dict[str, Any], task: BenchmarkTask, asked: argparse.Namespace
) -> None:
    """Go on from the contestants in some episodes of a task."""
    began, (ship, sailed, randomisation) = time.process_time(), task.sailed
    starts = [
        Contestant(name, name).policies(task, asked.suite)[0]
        for name in asked.search.split(",")
    ]
    settings = replace(OracleSettings(), passes=asked.passes)
    seeds = task.seeds[: asked.episodes]
    found = run_oracle(ship, sailed, seeds, starts, settings, randomisation)
    costs = np.full(N_EPISODES, np.inf)
    costs[: len(seeds)] = found.costs
    keep(known, task.name, costs, SEARCH)
    spent = time.process_time() - began
    means = f"{found.start_costs.mean():9.2f} -> {found.costs.mean():9.2f}"
    print(
        f"{task.name:28s} {means} in {len(seeds)} episodes, {spent:.0f} s", flush=True
    )


def keep(known: dict[str, Any], task: str, costs: NDArray[np.float64], by: str) -> None:
    """Put costs in the place of those that are higher."""
    one = known[task]
    before = np.array(one["costs"] or np.full(len(costs), np.inf))
    names = one["by"] or [by] * len(costs)
    one["costs"] = np.minimum(before, costs).tolist()
    one["by"] = [
        by if less else name for less, name in zip(costs < before, names, strict=True)
    ]


def rule(
    known: dict[str, Any], suite: str, results: Sequence[BenchmarkResult], episodes: int
) -> str:
    """Which tasks leave as much room as the rule of choice asks, in the first so many episodes."""
    lines = ["| task | best baseline | its cost | best known | room | rule |"]
    lines.append("| --- | --- | --- | --- | --- | --- |")
    for task in (task for task in load_suite(suite).tasks if task.on == "ship"):
        costs = {
            name: float(one.figures(name, task.name)[:, :episodes].mean())
            for one in results
            for name in one.summary["contestants"]
            if name not in (*LEARNED, "best-known")
        }
        best = min(costs, key=costs.__getitem__)
        least = float(np.mean(known[task.name]["costs"][:episodes]))
        room = 1.0 - least / costs[best]
        robust = "robustness" if task.why.startswith("robustness") else "fails"
        held = "holds" if room >= ROOM else robust
        lines.append(
            f"| {task.name} | {best} | {costs[best]:.1f} | {least:.1f} | {room:.1%} |"
            f" {held} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
