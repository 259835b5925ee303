"""Keep the rule's cost and the bound in each scored episode of a suite.

    shipgym benchmark --controllers wheel-over,tuned-wheel-over,mpc,ppo --out results
    python scripts/best_known.py results
    python scripts/best_known.py results --room 6    # the table of docs/benchmark.md

`rule_costs` are those of the tuned rule, which scores are relative to: of these results
if it took part in them. The bound from clairvoyance, `costs`, is the lowest cost that
any controller reached: lower ones come from results that are complete; those that are
kept already stay if they are lower. Some of those were reached by a search of the
rudder on the true ship, its state and the weather to come known: they stand in the file
as `search`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from agents.benchmarking.results import BenchmarkResult, load_results
from agents.benchmarking.sources import BEST_KNOWN, LEARNED
from agents.suites.reference import RULE, best_known
from agents.suites.suite import DEFAULT_SUITE, N_EPISODES, load_suite, suite_file
from shipgym.files import write_json

LEAST_ROOM = 0.08  # of a task for learning, see docs/benchmark.md


def main() -> None:
    """Add results to the file, or print the room that each task leaves."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("results", type=Path, help="folder of complete results")
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument(
        "--room", type=int, metavar="N", help="only print the room in N episodes"
    )
    arguments = parser.parse_args()
    suite = load_suite(arguments.suite)
    known = best_known(suite.source)
    result = load_results(arguments.results)
    if result.summary["suite"]["sha256"] != suite.sha256:
        raise SystemExit(f"{arguments.results}: expected results of {suite.name}")
    if arguments.room:
        print("\n".join(room_table(known, result, arguments.room)))
        return

    if result.summary["seeds"]["count"] != N_EPISODES:
        raise SystemExit(f"{arguments.results}: expected {N_EPISODES} episodes")
    for task in result.tasks:
        known[task] = lowest(known.get(task), result, task)
        rule = np.mean(known[task].get("rule_costs", np.nan))
        bound = np.mean(known[task]["costs"])
        print(f"{task:28s} rule {rule:9.2f}  bound {bound:9.2f}")
    write_json(known, suite_file(suite.source, "best"))


def lowest(
    known: dict[str, Any] | None, result: BenchmarkResult, task: str
) -> dict[str, Any]:
    """Return what is kept of a task, the costs of results in place of higher ones."""
    kept = known or {"costs": [np.inf] * N_EPISODES, "by": [""] * N_EPISODES}
    costs, by = np.array(kept["costs"]), list(kept["by"])
    cells = result.summary["tasks"][task]
    for name, cell in cells.items():
        if name == BEST_KNOWN or cell["failed"]:
            continue
        of_controller = result.figures(name, task).min(axis=0)
        for number in np.flatnonzero(of_controller < costs):
            by[number] = name
        costs = np.minimum(costs, of_controller)
    found = {**kept, "costs": costs.tolist(), "by": by}
    if RULE in cells and not cells[RULE]["failed"]:
        found["rule_costs"] = result.figures(RULE, task)[0].tolist()
    return found


def room_table(
    known: dict[str, Any], result: BenchmarkResult, n_episodes: int
) -> list[str]:
    """Rows of tasks with the room between the best baseline and the best known."""
    lines = [
        "| task | best baseline | its cost | best known | room |",
        "| --- | --- | --- | --- | --- |",
    ]
    for task, cells in result.summary["tasks"].items():
        if result.summary["suite"]["tasks"][task]["on"] != "ship":
            continue
        costs = {}
        for name in cells:
            if name not in (*LEARNED, BEST_KNOWN):
                figures = result.figures(name, task)[:, :n_episodes]
                costs[name] = float(figures.mean())
        best = min(costs, key=costs.__getitem__)
        best_cost = float(np.mean(known[task]["costs"][:n_episodes]))
        room = 1.0 - best_cost / costs[best]
        lines.append(
            f"| {task} | {best} | {costs[best]:.1f} | {best_cost:.1f} |"
            f" {room:.1%}{'' if room >= LEAST_ROOM else ' (below)'} |"
        )
    return lines


if __name__ == "__main__":
    main()
