"""Train the agents of `agents/pretrained`, for every task of the suite.

    python scripts/train_pretrained.py                              # missing runs
    python scripts/train_pretrained.py --tasks roll-limit --seeds 0,1

Each task is learned with its settings in `agents/training/hyperparameters`, once for
each training seed, in the design model and over the models drawn from its covariance.
Of each run the policy that costs least on held-out episodes of the model is kept; the
runs are all shipped and all scored, none is chosen. All tasks learn with the first seed
before any learns with the second, so that a set that was cut short is balanced. Killed
at any moment, it goes on where it was.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from agents.agent_file import PRETRAINED, load_agent
from agents.policies.policy import LearnedPolicy
from agents.suites.suite import BenchmarkTask, find_task, load_suite
from agents.training import run_folder
from agents.training.evaluation import TrainingProgress
from agents.training.plan import TrainingRequest, make_plan
from agents.training.training import train
from shipgym.files import read_json, write_json

RESULT = "result.json"
LARGEST_KB = 300.0
PROGRESS_S = 10.0  # between lines


def main() -> None:
    """Train what is missing."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--algorithm", default="ppo")
    parser.add_argument("--tasks", help="names, separated by commas; by default all")
    parser.add_argument("--seeds", default="0,1,2,3,4", help="training seeds")
    parser.add_argument(
        "--runs", type=Path, default=Path("runs/pretrained"), help="folder of the runs"
    )
    arguments = parser.parse_args()
    tasks = load_suite().select(arguments.tasks)
    names = [task.name for task in tasks if task.on == "ship"]
    for seed in map(int, arguments.seeds.split(",")):
        for name in names:
            run = Run(arguments.algorithm, find_task(name), seed, arguments.runs)
            run.learn()
            run.publish()


class Run:
    """One run of training, in a folder of its own."""

    def __init__(
        self, algorithm: str, task: BenchmarkTask, seed: int, runs: Path
    ) -> None:
        self.algorithm, self.task, self.seed = algorithm, task, seed
        self.folder = runs / f"{task.name}-{algorithm}-{seed}"
        #: Command that makes the same policy.
        self.command = (
            f"shipgym train {algorithm} --task {task.name} --seed {seed} --out run"
        )

    def learn(self) -> None:
        """Begin it, go on with it, or leave it as it is where it has ended."""
        if (self.folder / RESULT).is_file():
            return
        self.folder.parent.mkdir(parents=True, exist_ok=True)
        began, shown = time.process_time(), time.monotonic()

        def on_progress(progress: TrainingProgress) -> None:
            nonlocal shown
            if progress.evaluated and time.monotonic() - shown > PROGRESS_S:
                shown = time.monotonic()
                steps = f"{progress.steps / 1e6:.2f} of {progress.total / 1e6:.2f} M"
                costs = f"{progress.cost:.2f}, best {progress.best_cost:.2f}"
                self.say(f"{steps}, cost {costs}")

        result = train(
            make_plan(
                TrainingRequest(self.algorithm, task=self.task.name, seed=self.seed)
            ),
            self.folder,
            resume=(self.folder / run_folder.RUN).is_file(),
            on_progress=on_progress,
            command=self.command,
        )
        write_json(result.to_dict(), self.folder / RESULT)
        first, seconds = result.curve[0]["cost"], time.process_time() - began
        best = f"{result.best_cost:.2f} at {result.best_steps}"
        self.say(f"{first:.2f} -> {best}, {seconds:.0f} s")

    def say(self, text: str) -> None:
        """Print a line about the run."""
        print(f"{self.task.name} {self.seed}: {text}", flush=True)

    def publish(self) -> None:
        """Write the run's policy with its record."""
        result = read_json(
            self.folder / RESULT, "result of a run", "delete it and train again"
        )
        policy = load_agent(self.folder / run_folder.AGENT)
        assert isinstance(policy, LearnedPolicy)
        script = "python scripts/train_pretrained.py"
        record: dict[str, Any] = {
            **policy.training,
            "command": self.command,
            "script": f"{script} --tasks {self.task.name} --seeds {self.seed}",
            "held_out_cost": result["best_cost"],
            "best_steps": result["best_steps"],
            "steps": result["steps"],
            "curve": [[row["steps"], round(row["cost"], 3)] for row in result["curve"]],
        }
        path = PRETRAINED / f"{self.task.name}-{self.algorithm}-s{self.seed}.json"
        replace(policy, training=record).save(path)

        files = (path, path.with_suffix(".safetensors"))
        size_kb = sum(file.stat().st_size for file in files) / 1000.0
        if size_kb > LARGEST_KB:
            raise SystemExit(
                f"{path}: expected at most {LARGEST_KB:.0f} kB with its weights, got"
                f" {size_kb:.0f}"
            )


if __name__ == "__main__":
    main()
