"""Search the least cost of each scored episode, the ship and all weather known.

    python scripts/clairvoyance.py --controllers tuned-preview-lq,mpc,ppo --out bounds
    python scripts/clairvoyance.py --tasks sharp-turns --seconds 600 --out bounds

The search starts from the commands of the controller that costs least in the episode
and improves them on the true ship, open loop, in the same weather. Each task has a file
in --out and --seconds of processor time in all: stopped at any moment the same command
goes on, and with more seconds it searches on. What is lower than the best known
cost of an episode is written to the suite's file as `search from CONTROLLER`, after it
was replayed with one ship. With the same seed and visits the result is the same.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from time import process_time

import numpy as np
from rudder_search.kept import Kept, steer_all
from rudder_search.lanes import Lanes
from rudder_search.search import N_LANES, Search

from agents.benchmarking.entries import Entry, check_agents, read_entries
from agents.suites.reference import best_known
from agents.suites.suite import (
    DEFAULT_SUITE,
    N_EPISODES,
    BenchmarkTask,
    load_suite,
    suite_file,
)
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.files import make_folder, write_json


def main(argv: Sequence[str] | None = None) -> int:
    """Search what is asked for; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument("--tasks", help="names, separated by commas; by default all")
    parser.add_argument("--controllers", default="tuned-preview-lq,mpc,ppo")
    parser.add_argument("--seconds", type=float, default=600.0, help="of each task")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--all-sets", action="store_true", help="not only on the ship")
    parser.add_argument("--out", type=Path, required=True, help="folder of sequences")
    arguments = parser.parse_args(argv)
    try:
        search_suite(arguments)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def search_suite(arguments: argparse.Namespace) -> None:
    """Search tasks one after the other."""
    check_number(arguments.seconds, "seconds", above=0.0)
    suite = load_suite(arguments.suite)
    entries = read_entries(arguments.controllers)
    tasks = []
    for task in suite.select(arguments.tasks):
        if arguments.all_sets or task.on == "ship":
            tasks.append(task)
    for entry in entries:
        check_agents(entry, tasks)
    make_folder(arguments.out)

    for task in tasks:
        about = {
            "task": task.name,
            "suite": suite.sha256,
            "seed": arguments.seed,
            "controllers": arguments.controllers,
        }
        path = arguments.out / f"{task.name}.npz"
        kept = search_task(task, entries, path, about, arguments.seconds)
        n_lower = keep_lower(task, kept)
        start, cost = kept.arrays["start_costs"].mean(), kept.arrays["costs"].mean()
        print(
            f"\r{task.name:26s} {start:9.2f} -> {cost:9.2f} ({cost / start - 1.0:+.1%})"
            f"  {n_lower} episodes lower than known"
        )


def search_task(
    task: BenchmarkTask,
    entries: Sequence[Entry],
    path: Path,
    about: dict[str, object],
    seconds: float,
) -> Kept:
    """Visit the episodes of a task in turn until the time is spent."""
    began = process_time()
    if path.exists():
        kept = Kept.read(path, about)
    else:
        kept = Kept.begin(about, steer_all(entries, task))
        kept.about["spent"] = process_time() - began
        kept.save(path)

    search = Search(Lanes(task, N_LANES), int(kept.about["seed"]))
    spent_before = kept.about["spent"]
    began = saved = process_time()
    while kept.about["spent"] < seconds:
        number = int(np.argmin(kept.arrays["visits"]))
        others = kept.arrays["starts"][:, number]
        seed = int(task.seeds[number])
        found = search.visit(kept.found(number), seed, others)
        kept.put(number, found)

        now = process_time()
        kept.about["spent"] = spent_before + now - began
        if now - saved > 10.0:
            kept.save(path)
            saved = now
            show(task, kept, seconds)
    kept.save(path)
    return kept


def show(task: BenchmarkTask, kept: Kept, seconds: float) -> None:
    """Print where the search stands, over the last line."""
    left = seconds - kept.about["spent"]
    cost = kept.arrays["costs"].mean()
    visits = kept.arrays["visits"].mean()
    print(
        f"\r{task.name}: mean cost {cost:.3f}, {visits:.1f} visits an episode,"
        f" {left:.0f} s of processor left ",
        end="",
        flush=True,
    )


def keep_lower(task: BenchmarkTask, kept: Kept) -> int:
    """Write costs below the best known to the suite's file; return how many."""
    known = best_known(task.suite)
    if task.name not in known:
        return 0
    of_task = known[task.name]
    n_lower = 0
    for number in range(N_EPISODES):
        cost = float(kept.arrays["costs"][number])
        if cost >= of_task["costs"][number]:
            continue
        kept.check(task, number)
        of_task["costs"][number] = cost
        of_task["by"][number] = f"search from {kept.source(number)}"
        n_lower += 1
    if n_lower:
        write_json(known, suite_file(task.suite, "best"))
    return n_lower


if __name__ == "__main__":
    sys.exit(main())
