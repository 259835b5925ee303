"""Tune a suite's classical controllers by direct search and fly the oracle: the suite's two result files.

    python scripts/tune_controllers.py                      # what is missing in both files
    python scripts/tune_controllers.py --tasks mariner-calm --again
    python scripts/tune_controllers.py --from-agents        # flies paths from the pretrained agents too

Both files are written after every controller and task: killed at any moment, it goes on where it was. The
oracle's costs of all scored episodes are kept in a third file. It flies again where more episodes are asked
for, or where another controller has become the best and costs less than it. Where it flies fewer episodes
than are scored, its cost is that of the best classical controller over all of them times the oracle's part
of that controller's cost on those it flew.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from agents.oracle import OracleSettings, fly_oracle

from agents.agent_file import find_agent, load_agent
from agents.benchmarking.contestants import file_hash
from agents.benchmarking.direct_search import (
    CLASSICAL,
    EPISODES,
    EVALUATIONS,
    FIRST_SEED,
    load_tuned,
    tunable,
    tune,
    tuned_file,
)
from agents.controllers.controller import Controller
from agents.controllers.designs import design
from agents.rollouts.rollout import episode_costs
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, load_suite
from shipgym.errors import InputError
from shipgym.json_file import read_json, write_json

ORACLE_EPISODES = 100


def main() -> None:
    """Tune, then fly, and say what came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--suite", default=DEFAULT_SUITE)
    parser.add_argument("--tasks", default="", help="names, separated by commas; by default all")
    parser.add_argument("--controllers", default=",".join(CLASSICAL))
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS)
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument("--oracle-episodes", type=int, default=ORACLE_EPISODES)
    parser.add_argument("--again", action="store_true", help="also what is there already")
    parser.add_argument("--from-agents", action="store_true", help="better the oracle from pretrained agents")
    asked = parser.parse_args()
    suite = load_suite(asked.suite)
    tasks = [suite.task(name) for name in asked.tasks.split(",") if name] or list(suite.tasks)
    for task in tasks:
        tune_task(task, asked)
        refer(task, asked)
        if asked.from_agents and task.environment == "path-following":
            fly_from_agent(task, asked.suite)


def tune_task(task: BenchmarkTask, asked: argparse.Namespace) -> None:
    """Tune all controllers on a task and write each as it is found."""
    found = _tuned(asked.suite)
    own = found.setdefault(task.name, {})
    for kind in asked.controllers.split(","):
        if kind not in tunable(task) or (kind in own and not asked.again):
            continue
        began = time.process_time()
        settings = {name: one["settings"] for name, one in own.items()}
        best = tune(kind, task, settings, asked.evaluations, asked.episodes)
        own[kind] = asdict(best)
        budget = {"evaluations": EVALUATIONS, "episodes": EPISODES, "first_seed": FIRST_SEED}
        write_json({"suite": asked.suite, **budget, "tasks": found}, tuned_file(asked.suite))
        spent = time.process_time() - began
        costs = f"{best.start_cost:9.2f} -> {best.cost:9.2f}"
        print(f"{task.name:20s} {kind:14s} {costs}   {spent:5.1f} s", flush=True)


def refer(task: BenchmarkTask, asked: argparse.Namespace) -> None:
    """Fly the tuned controllers and the oracle on the scored seeds."""
    path = reference_file(asked.suite)
    found = _written(path)
    tuned = _tuned(asked.suite)[task.name]
    best = min(tuned, key=lambda kind: float(tuned[kind]["cost"]))
    known = found.get(task.name, {})
    enough = known.get("oracle_episodes", 0) >= asked.oracle_episodes and not asked.again
    if enough and known["best_classical"]["name"] == best:
        return
    began = time.process_time()
    engine = task.engine(len(task.seeds))
    start, pid = (design(kind, task, tuned[kind]["settings"]) for kind in (best, "pid"))
    cost = float(episode_costs(start, engine, task.seeds).mean())
    if enough and known["oracle"] <= cost:  # what it found from another start can still be sailed
        oracle = {name: known[name] for name in ("oracle", "oracle_episodes")}
    else:
        oracle = fly(task, start, cost, asked)
    found[task.name] = {
        "pid": float(episode_costs(pid, engine, task.seeds).mean()),
        "best_classical": {"name": best, "cost": cost},
        **oracle,
    }
    write_json(found, path)
    print(f"{task.name:20s} {found[task.name]}   {time.process_time() - began:.0f} s", flush=True)


def fly(task: BenchmarkTask, start: Controller, cost: float, asked: argparse.Namespace) -> dict[str, Any]:
    """Fly the oracle: its cost over all scored seeds, and how many it flew, whose costs are kept if all."""
    seeds = task.seeds[: asked.oracle_episodes]
    flight = fly_oracle(task.ship, task.task, seeds, start, OracleSettings(), task.parts[2])
    if len(seeds) == len(task.seeds):
        path = oracle_file(asked.suite)
        write_json({**_written(path), task.name: flight.costs.tolist()}, path)
    part = float(flight.costs.mean() / flight.start_costs.mean())
    return {"oracle": part * cost, "oracle_episodes": len(seeds)}


def fly_from_agent(task: BenchmarkTask, suite: str) -> None:
    """Fly the oracle from what the task's pretrained agent does; the cheaper of each episode is kept.

    The reference names the agent's file, so that the same agent is not flown from again.
    """
    costs, known = _written(oracle_file(suite)), _written(reference_file(suite))
    if known[task.name]["oracle_episodes"] < len(task.seeds):
        raise SystemExit(f"{task.name}: the oracle flew too few episodes, fly all of them first")
    agent_hash = file_hash(find_agent(f"{task.name}-ppo"))
    if known[task.name].get("agent_sha256") == agent_hash:
        return
    before = np.array(costs[task.name])
    agent = load_agent(f"{task.name}-ppo")
    flight = fly_oracle(task.ship, task.task, task.seeds, agent, OracleSettings(), task.parts[2])
    after = np.minimum(before, flight.costs)
    known[task.name] |= {"oracle": float(after.mean()), "agent_sha256": agent_hash}
    write_json({**costs, task.name: after.tolist()}, oracle_file(suite))
    write_json(known, reference_file(suite))
    print(f"{task.name:20s} oracle {before.mean():.2f} -> {after.mean():.2f}", flush=True)


def reference_file(suite: str) -> Path:
    """Where the suite's costs of reference are."""
    return tuned_file(suite).with_name(f"{suite}-reference.json")


def oracle_file(suite: str) -> Path:
    """Where the oracle's costs of each scored episode are."""
    return tuned_file(suite).with_name(f"{suite}-oracle.json")


def _written(path: Path) -> dict[str, Any]:
    """What was written so far."""
    return dict(read_json(path, "result file", "delete it")) if path.exists() else {}


def _tuned(suite: str) -> dict[str, Any]:
    """Settings found so far."""
    try:
        return load_tuned(suite)
    except InputError:
        if tuned_file(suite).exists():
            raise
        return {}


if __name__ == "__main__":
    main()
