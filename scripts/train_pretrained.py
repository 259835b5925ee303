"""Train the agents of `agents/pretrained` again, for the suite whose ships contestants know by models.

    python scripts/train_pretrained.py                                   # every task's
    missing runs python scripts/train_pretrained.py --tasks roll-limit --seeds 0,1
    python scripts/train_pretrained.py --table results                   # markdown for
    docs/pretrained.md

Each task is learned with its settings in `agents/training/hyperparameters`, once for
each training seed, in the design model and over the models drawn from its covariance.
Of each run the policy that costs least on held-out episodes of the model is kept; the
runs are all shipped and all scored, none is chosen. All tasks learn with the first seed
before any learns with the second, so that a set that was cut short is balanced. Killed
at any moment, it goes on where it was.

`results` is a folder of `shipgym benchmark --suite shipgym-v2` with the agents and the
baselines; more folders may follow, of contestants that were run in fewer episodes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.agent_file import load_agent
from agents.benchmarking.results import BenchmarkResult, load_results
from agents.benchmarking.statistics import Draws, Interval, interval
from agents.policies.policy import LearnedPolicy
from agents.suites.suite import N_EPISODES, SETS, BenchmarkTask, load_suite
from agents.training import run_folder
from agents.training.request import TrainingRequest, make_plan
from agents.training.training import TrainingProgress, train
from shipgym.files import read_json, write_json

PRETRAINED = Path(__file__).parents[1] / "agents" / "pretrained"
RESULT = "result.json"
LARGEST_KB = 300.0
SLOW = "mpc"  # of the baselines, which no policy adds to
BROKEN = "delete it and train again"
GAIN, CLOSE = 0.05, 0.01  # what is asked of five tasks, and of the others


def main() -> None:
    """Train what is missing, or print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--suite", default="shipgym-v2")
    parser.add_argument("--algorithm", default="ppo")
    parser.add_argument(
        "--tasks", default="", help="names, separated by commas; by default all"
    )
    parser.add_argument(
        "--seeds", default="0,1,2,3,4", help="training seeds, separated by commas"
    )
    parser.add_argument(
        "--runs", type=Path, default=Path("runs/pretrained"), help="folder of the runs"
    )
    parser.add_argument(
        "--table",
        type=Path,
        nargs="+",
        help="only print what the agents cost in results",
    )
    asked = parser.parse_args()
    suite = load_suite(asked.suite)
    named = [suite.task(name) for name in asked.tasks.split(",") if name]
    tasks = named or [task for task in suite.tasks if task.on == "ship"]
    if asked.table:
        print(
            table(
                tasks, [load_results(folder) for folder in asked.table], asked.algorithm
            )
        )
        return
    for seed in map(int, asked.seeds.split(",")):
        for task in tasks:
            learn(asked.algorithm, task, seed, asked.runs)
            publish(asked.algorithm, task, seed, asked.runs)


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
    began, shown = time.process_time(), time.monotonic()

    def on_progress(progress: TrainingProgress) -> None:
        nonlocal shown
        if progress.evaluated and time.monotonic() - shown > 10.0:
            shown = time.monotonic()
            done = f"{progress.steps / 1e6:5.2f} of {progress.total / 1e6:.2f} M"
            print(
                f"{task.name} {seed}: {done}, cost {progress.cost:.2f}, best"
                f" {progress.best_cost:.2f}",
                flush=True,
            )

    plan = make_plan(TrainingRequest(algorithm, task=task.name, seed=seed))
    resume = (folder / run_folder.RUN).is_file()
    result = train(
        plan,
        folder,
        resume=resume,
        on_progress=on_progress,
        command=command_of(algorithm, task, seed),
    )
    write_json(result.to_dict(), folder / RESULT)
    first, spent = result.curve[0]["cost"], time.process_time() - began
    print(
        f"{task.name} {seed}: {first:.2f} -> {result.best_cost:.2f} at"
        f" {result.best_steps}, {spent:.0f} s",
        flush=True,
    )


def publish(algorithm: str, task: BenchmarkTask, seed: int, runs: Path) -> None:
    """Write a run's policy with its record."""
    folder, name = (
        folder_of(runs, algorithm, task, seed),
        f"{task.name}-{algorithm}-s{seed}.json",
    )
    result = read_json(folder / RESULT, "result of a run", BROKEN)
    policy = load_agent(folder / run_folder.AGENT)
    assert isinstance(policy, LearnedPolicy)
    record: dict[str, Any] = {
        **policy.training,
        "command": command_of(algorithm, task, seed),
        "script": (
            f"python scripts/train_pretrained.py --tasks {task.name} --seeds {seed}"
        ),
        "held_out_cost": result["best_cost"],
        "best_steps": result["best_steps"],
        "steps": result["steps"],
        "curve": [[row["steps"], round(row["cost"], 3)] for row in result["curve"]],
    }
    path = PRETRAINED / name
    replace(policy, training=record).save(path)
    size = (
        sum(file.stat().st_size for file in (path, path.with_suffix(".safetensors")))
        / 1000.0
    )
    if size > LARGEST_KB:
        raise SystemExit(
            f"{path}: {size:.0f} kB with its weights, expected at most {LARGEST_KB:.0f}"
        )


def table(
    tasks: Sequence[BenchmarkTask], results: Sequence[BenchmarkResult], algorithm: str
) -> str:
    """Costs of the best baseline and of every training seed, the gain, and whether the aim is met."""
    lines = [
        (
            "| task | best baseline | its cost | agents, by training seed | gain on the"
            " ship, % | on the model | far from the design | lost far: agents, baseline"
            " | gain over the best other than MPC | aim |"
        ),
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for number, task in enumerate(tasks):
        best = best_baseline(results, task.name, algorithm)
        gain, *others = (
            gain_of(*paired(results, task.name + end, algorithm, best), number)
            for end in SETS.values()
        )
        learned, theirs = paired(results, task.name, algorithm, best)
        lost = [
            f"{one.mean():.0%}"
            for one in paired(
                results, f"{task.name}-far", algorithm, best, "terminated"
            )
        ]
        seeds, n = (
            ", ".join(f"{cost:.1f}" for cost in learned.mean(axis=1)),
            theirs.shape[1],
        )
        fast = best_baseline(results, task.name, algorithm, SLOW)
        over = gain_of(*paired(results, task.name, algorithm, fast), number)
        named = best if n == N_EPISODES else f"{best} ({n} episodes)"
        met = (
            "gain"
            if gain.value >= GAIN and gain.low > 0
            else "near"
            if gain.value >= -CLOSE
            else "missed"
        )
        cells = [
            named,
            f"{theirs.mean():.1f}",
            seeds,
            *map(_shown, (gain, *others)),
            ", ".join(lost),
        ]
        cells += [f"{_shown(over)} {fast}", met]
        lines.append(f"| {' | '.join([task.name, *cells])} |")
    return "\n".join(lines)


def best_baseline(
    results: Sequence[BenchmarkResult], task: str, algorithm: str, without: str = ""
) -> str:
    """The one of the lowest mean cost; one that was run in fewer episodes is compared in these."""
    names = {name for one in results for name in one.summary["contestants"]} - {
        algorithm,
        "best-known",
        without,
    }
    costs = {name: figures(results, name, task) for name in sorted(names)}
    best, *others = sorted(
        (name for name in costs if costs[name].size),
        key=lambda name: (-costs[name].size, costs[name].mean()),
    )
    for name in others:
        ours, theirs = paired(results, task, best, name)
        best = name if theirs.mean() < ours.mean() else best
    return best


def figures(
    results: Sequence[BenchmarkResult], name: str, task: str, figure: str = "cost"
) -> NDArray[np.float64]:
    """A figure of a contestant where most episodes of it were run, shape (n_runs, n_episodes)."""
    held = [
        one
        for one in results
        if name in one.summary["contestants"] and task in one.tasks
    ]
    return max(
        (one.figures(name, task, figure) for one in held),
        key=np.size,
        default=np.zeros((0, 0)),
    )


def paired(
    results: Sequence[BenchmarkResult],
    task: str,
    one: str,
    other: str,
    figure: str = "cost",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A figure of two contestants in the episodes that both were run in."""
    first, second = (figures(results, name, task, figure) for name in (one, other))
    n = min(first.shape[1], second.shape[1])
    return first[:, :n], second[:, :n]


def gain_of(
    learned: NDArray[np.float64], theirs: NDArray[np.float64], number: int
) -> Interval:
    """What part of a baseline's cost the agents cost less, drawn over episodes and training seeds."""
    draws = Draws(number + 1, learned.shape[1])
    drawn = 1.0 - draws.means(learned, number, 1).mean(axis=1) / draws.means(
        theirs, number
    ).mean(axis=1)
    return interval(float(1.0 - learned.mean() / theirs.mean()), drawn)


def _shown(gain: Interval) -> str:
    """A gain with its interval, in percent."""
    return f"{100 * gain.value:.1f} ({100 * gain.low:.1f} to {100 * gain.high:.1f})"


if __name__ == "__main__":
    main()
