"""Train the agents of `agents/pretrained`, one for each registered environment.

    python scripts/train_pretrained.py [--runs FOLDER]

Each learns on the ship that its environment has by default. Of a run the policy that
costs least on held-out episodes is shipped, with the command that makes it again.
Killed at any moment, the script goes on where it was.
"""

from __future__ import annotations

import argparse
import shlex
from dataclasses import replace
from pathlib import Path

from agents.agent_file import PRETRAINED, load_agent
from agents.policies.policy import LearnedPolicy
from agents.training import run_folder
from agents.training.evaluation import TrainingProgress
from agents.training.plan import TrainingRequest, make_plan
from agents.training.training import train

#: What the agents add to; in course keeping there is next to nothing to gain on LQ.
BASES = {"shipgym/CourseKeeping-v0": "none", "shipgym/PathFollowing-v0": "preview-lq"}


def main() -> None:
    """Train what is missing, and write the agents with their records."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "--runs", type=Path, default=Path("runs/pretrained"), help="folder of the runs"
    )
    runs: Path = parser.parse_args().runs
    for environment, base in BASES.items():
        learn(environment, base, runs)


def learn(environment: str, base: str, runs: Path) -> None:
    """Train one agent, or go on with it, and publish it."""
    words = ["shipgym", "train", "ppo", "--env", environment]
    words += ["--set", f"base={base}", "--out", "run"]
    settings = {"base": base}
    plan = make_plan(TrainingRequest("ppo", environment=environment, settings=settings))
    name = f"{plan.task.environment}-ppo"
    folder = runs / name
    result = train(
        plan,
        folder,
        resume=(folder / run_folder.RUN).is_file(),
        on_progress=say,
        command=shlex.join(words),
    )
    policy = load_agent(folder / run_folder.AGENT)
    assert isinstance(policy, LearnedPolicy)
    curve = [[row["steps"], round(row["cost"], 3)] for row in result.curve]
    record = {**policy.training, "command": shlex.join(words), "curve": curve}
    path = PRETRAINED / f"{name}.json"
    replace(policy, training=record).save(path)
    print(f"{path}: {result.best_cost:.2f}, LQ {result.lq_cost:.2f}")


def say(progress: TrainingProgress) -> None:
    """Print a line for each evaluation."""
    if progress.evaluated:
        print(f"{progress.steps:,} of {progress.total:,}: {progress.cost:.2f}")


if __name__ == "__main__":
    main()
