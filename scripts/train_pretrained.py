"""Train the agents of `agents/pretrained` again, and say how good they are.

    python scripts/train_pretrained.py                                   # every task's missing runs
    python scripts/train_pretrained.py --tasks mariner-calm --seeds 0,1,2
    python scripts/train_pretrained.py --table                           # markdown for docs/pretrained.md

Each task of the suite is learned with its settings in `agents/training/hyperparameters`, once for each
training seed. Of all evaluations of all runs the policy that costs least on held-out episodes is kept; only
then is it run on the episodes that are scored. Killed at any moment, it goes on where it was.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.agent_file import load_agent
from agents.controllers.controller import Policy
from agents.controllers.designs import tuned
from agents.policies.policy import LearnedPolicy
from agents.rollouts.rollout import episode_costs
from agents.suites.reference import reference_costs
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, load_suite
from agents.training import run_folder
from agents.training.plan import Given, make_plan
from agents.training.training import Progress, train
from shipgym.files import read_json, write_json

AGENTS = Path(__file__).parents[1] / "agents"
PRETRAINED = AGENTS / "pretrained"
RESULT = "result.json"
LARGEST_KB = 300.0
FRESH = range(2_000_000, 2_000_100)  # never scored, trained or tuned on
ENOUGH = 0.05  # room between the best classical controller and the oracle from which half of it is asked for
CLOSE = 0.02  # how near the best classical controller is asked for elsewhere
BROKEN = "delete it and train again"


def main() -> None:
    """Train what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--algorithm", default="ppo")
    parser.add_argument("--tasks", default="", help="names, separated by commas; by default all")
    parser.add_argument("--seeds", default="0,1,2", help="training seeds, separated by commas")
    parser.add_argument("--runs", type=Path, default=Path("runs/pretrained"), help="folder of the runs")
    parser.add_argument("--table", action="store_true", help="only print what the agents cost")
    asked = parser.parse_args()
    suite = load_suite()
    tasks = [suite.task(name) for name in asked.tasks.split(",") if name] or list(suite.tasks)
    if asked.table:
        print(table(tasks, asked.algorithm))
        return
    seeds = [int(seed) for seed in asked.seeds.split(",")]
    for task in tasks:
        for seed in seeds:
            learn(asked.algorithm, task, seed, asked.runs)
        publish(asked.algorithm, task, seeds, asked.runs)


def folder_of(runs: Path, algorithm: str, task: BenchmarkTask, seed: int) -> Path:
    """Folder of one run."""
    return runs / f"{task.name}-{algorithm}-{seed}"


def command_of(algorithm: str, task: BenchmarkTask, seed: int) -> str:
    """The command that makes the same policy."""
    return f"shipgym train {algorithm} --task {task.name} --seed {seed} --out run"


def learn(algorithm: str, task: BenchmarkTask, seed: int, runs: Path) -> None:
    """One run, begun, gone on with, or left as it is where it has ended."""
    folder = folder_of(runs, algorithm, task, seed)
    if (folder / RESULT).is_file():
        return
    runs.mkdir(parents=True, exist_ok=True)
    began, shown = time.process_time(), -np.inf

    def tell(progress: Progress) -> None:
        nonlocal shown
        if progress.evaluated and time.monotonic() - shown > 10.0:
            shown = time.monotonic()
            done = f"{progress.steps / 1e6:5.2f} of {progress.total / 1e6:.2f} M"
            print(
                f"{task.name} {seed}: {done}, cost {progress.cost:.2f}, best {progress.best_cost:.2f}",
                flush=True,
            )

    plan = make_plan(Given(algorithm, task=task.name, seed=seed))
    resume = (folder / run_folder.RUN).is_file()
    result = train(plan, folder, resume=resume, tell=tell, command=command_of(algorithm, task, seed))
    write_json(result.to_dict(), folder / RESULT)
    spent = time.process_time() - began
    print(
        f"{task.name} {seed}: best {result.best_cost:.2f} at {result.best_steps}, {spent:.0f} s", flush=True
    )


def publish(algorithm: str, task: BenchmarkTask, seeds: Sequence[int], runs: Path) -> None:
    """Write the best of the runs with the record of all of them."""
    told, policies = [], []
    for seed in seeds:
        folder = folder_of(runs, algorithm, task, seed)
        result = read_json(folder / RESULT, "result of a run", BROKEN)
        policy = load_agent(folder / run_folder.AGENT)
        assert isinstance(policy, LearnedPolicy)
        policies.append(policy)
        told.append({
            "seed": seed,
            "held_out_cost": result["best_cost"],
            "best_steps": result["best_steps"],
            "steps": result["steps"],
            "scored_cost": scored_cost(policy, task),
            "curve": [[row["steps"], round(row["cost"], 3)] for row in result["curve"]],
        })  # fmt: skip
    chosen = min(range(len(seeds)), key=lambda number: float(told[number]["held_out_cost"]))
    best, listed = policies[chosen], ",".join(map(str, seeds))
    record: dict[str, Any] = {
        **best.training,
        "command": command_of(algorithm, task, seeds[chosen]),
        "script": f"python scripts/train_pretrained.py --tasks {task.name} --seeds {listed}",
        "score": {"cost": told[chosen]["scored_cost"], "seeds": [int(task.seeds[0]), int(task.seeds[-1])]},
        "runs": told,
    }
    PRETRAINED.mkdir(exist_ok=True)
    path = PRETRAINED / f"{task.name}-{algorithm}.json"
    replace(best, training=record).save(path)
    size = sum(file.stat().st_size for file in (path, path.with_suffix(".safetensors"))) / 1000.0
    if size > LARGEST_KB:
        raise SystemExit(f"{path}: {size:.0f} kB with its weights, expected at most {LARGEST_KB:.0f}")
    print(
        f"{task.name}: seed {seeds[chosen]}, scored {told[chosen]['scored_cost']:.2f}, {size:.0f} kB",
        flush=True,
    )


def scored_cost(policy: Policy, task: BenchmarkTask) -> float:
    """Mean cost of the scored episodes."""
    return float(episode_costs(policy, task.engine(len(task.seeds)), task.seeds).mean())


def table(tasks: Sequence[BenchmarkTask], algorithm: str) -> str:
    """Costs of the best classical controller, of the best known and of the agent; whether the aim is met."""
    reference = reference_costs(DEFAULT_SUITE)
    lines = [
        "| Task | Best classical | Cost | Best known | Learned | Room closed | Aim | Gain: scored, fresh "
        "| Training seeds |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for task in tasks:
        path = PRETRAINED / f"{task.name}-{algorithm}.json"
        if task.name not in reference or not path.is_file():
            lines.append(f"| {task.name} | | | | not trained | | missed | | |")
            continue
        policy = load_agent(path)
        assert isinstance(policy, LearnedPolicy)
        lines.append(_row(task, reference[task.name], policy))
    return "\n".join(lines)


def _row(task: BenchmarkTask, known: tuple[float, float], policy: LearnedPolicy) -> str:
    """One task's line."""
    best = tuned("best", task, DEFAULT_SUITE)
    classical, least, learned = scored_cost(best, task), known[1], scored_cost(policy, task)
    gain, room = 1.0 - learned / classical, 1.0 - least / classical
    asked = room > ENOUGH
    met = gain >= 0.5 * room if asked else gain >= -CLOSE
    every = ", ".join(f"{run['scored_cost']:.1f}" for run in policy.training["runs"])
    share = f"{gain / room:.0%} of {room:.1%}" if asked else f"room {room:.1%}, {-gain:+.1%} to classical"
    return (
        f"| {task.name} | {best.name} | {classical:.1f} | {least:.1f} | {learned:.1f} "
        f"| {share} | {'met' if met else 'missed'} | {gain:.1%}, {fresh_gain(policy, task):.1%} | {every} |"
    )


def fresh_gain(policy: LearnedPolicy, task: BenchmarkTask) -> float:
    """What a policy costs less than the best classical controller on fresh episodes, a part of that."""
    engine, seeds = task.engine(len(FRESH)), np.array(FRESH)
    classical = episode_costs(tuned("best", task, DEFAULT_SUITE), engine, seeds)
    return float(1.0 - episode_costs(policy, engine, seeds).mean() / classical.mean())


if __name__ == "__main__":
    main()
