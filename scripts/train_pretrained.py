"""Train the agents of `agents/pretrained` again, for the suite whose ships contestants know by models.

    python scripts/train_pretrained.py                                   # every task's missing runs
    python scripts/train_pretrained.py --tasks roll-limit --seeds 0,1
    python scripts/train_pretrained.py --table results                   # markdown for docs/pretrained.md

Each task is learned with its settings in `agents/training/hyperparameters`, once for each training seed, in
the design model and over the models drawn from its covariance. Of each run the policy that costs least on
held-out episodes of the model is kept; the runs are all shipped and all scored, none is chosen. All tasks
learn with the first seed before any learns with the second, so that a set that was cut short is balanced.
Killed at any moment, it goes on where it was.

`results` is a folder of `shipgym benchmark --suite shipgym-v2` with the agents and all the baselines.
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
from agents.suites.suite import BenchmarkTask, load_suite
from agents.training import run_folder
from agents.training.plan import Given, make_plan
from agents.training.training import Progress, train
from shipgym.files import read_json, write_json

PRETRAINED = Path(__file__).parents[1] / "agents" / "pretrained"
RESULT = "result.json"
LARGEST_KB = 300.0
BROKEN = "delete it and train again"
GAIN, CLOSE = 0.05, 0.01  # what is asked of five tasks, and of the others


def main() -> None:
    """Train what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--suite", default="shipgym-v2")
    parser.add_argument("--algorithm", default="ppo")
    parser.add_argument("--tasks", default="", help="names, separated by commas; by default all")
    parser.add_argument("--seeds", default="0,1,2,3,4", help="training seeds, separated by commas")
    parser.add_argument("--runs", type=Path, default=Path("runs/pretrained"), help="folder of the runs")
    parser.add_argument("--table", type=Path, help="only print what the agents cost in these results")
    asked = parser.parse_args()
    suite = load_suite(asked.suite)
    named = [suite.task(name) for name in asked.tasks.split(",") if name]
    tasks = named or [task for task in suite.tasks if task.on == "ship"]
    if asked.table:
        print(table(tasks, load_results(asked.table), asked.algorithm))
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
    first, spent = result.curve[0]["cost"], time.process_time() - began
    print(
        f"{task.name} {seed}: {first:.2f} -> {result.best_cost:.2f} at {result.best_steps}, {spent:.0f} s",
        flush=True,
    )


def publish(algorithm: str, task: BenchmarkTask, seed: int, runs: Path) -> None:
    """Write a run's policy with its record."""
    folder, name = folder_of(runs, algorithm, task, seed), f"{task.name}-{algorithm}-s{seed}.json"
    result = read_json(folder / RESULT, "result of a run", BROKEN)
    policy = load_agent(folder / run_folder.AGENT)
    assert isinstance(policy, LearnedPolicy)
    record: dict[str, Any] = {
        **policy.training,
        "command": command_of(algorithm, task, seed),
        "script": f"python scripts/train_pretrained.py --tasks {task.name} --seeds {seed}",
        "held_out_cost": result["best_cost"],
        "best_steps": result["best_steps"],
        "steps": result["steps"],
        "curve": [[row["steps"], round(row["cost"], 3)] for row in result["curve"]],
    }
    path = PRETRAINED / name
    replace(policy, training=record).save(path)
    size = sum(file.stat().st_size for file in (path, path.with_suffix(".safetensors"))) / 1000.0
    if size > LARGEST_KB:
        raise SystemExit(f"{path}: {size:.0f} kB with its weights, expected at most {LARGEST_KB:.0f}")


def table(tasks: Sequence[BenchmarkTask], result: BenchmarkResult, algorithm: str) -> str:
    """Costs of the best baseline and of every training seed, the gain, and whether the aim is met."""
    lines = [
        "| task | best baseline | its cost | agents, by training seed | gain on the ship | on the model "
        "| far from the design | lost far: agents, baseline | aim |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for number, task in enumerate(tasks):
        best, gain = _gain(result, task.name, algorithm, number)
        seeds = ", ".join(f"{cost:.1f}" for cost in result.figures(algorithm, task.name).mean(axis=1))
        others = [_gain(result, task.name + end, algorithm, number, best)[1] for end in ("-on-model", "-far")]
        lost = [
            f"{result.figures(one, f'{task.name}-far', 'terminated').mean():.0%}" for one in (algorithm, best)
        ]
        cost = result.figures(best, task.name).mean()
        met = "gain" if gain.value >= GAIN and gain.low > 0 else "near" if gain.value >= -CLOSE else "missed"
        cells = [task.name, best, f"{cost:.1f}", seeds, *map(_shown, (gain, *others)), ", ".join(lost), met]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _gain(
    result: BenchmarkResult, task: str, algorithm: str, number: int, best: str | None = None
) -> tuple[str, Interval]:
    """The baseline, by default that of the least mean cost, and what part of it the agents cost less."""
    costs = {name: result.figures(name, task) for name in result.summary["contestants"]}
    baselines = [name for name in costs if name not in (algorithm, "best-known") and len(costs[name])]
    best = best or min(baselines, key=lambda name: float(costs[name].mean()))
    learned, theirs = costs[algorithm], costs[best]
    draws = Draws(number + 1, learned.shape[1])

    def gains(own: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(1.0 - own.mean(axis=-1) / other.mean(axis=-1))

    drawn = gains(draws.means(learned, number, 1), draws.means(theirs, number))
    return best, interval(float(1.0 - learned.mean() / theirs.mean()), drawn)


def _shown(gain: Interval) -> str:
    """A gain with its interval, in percent."""
    return f"{100 * gain.value:+.1f} % ({100 * gain.low:+.1f} to {100 * gain.high:+.1f})"


if __name__ == "__main__":
    main()
