"""Train an autopilot by PPO on paths and compare it with classical ones.

python scripts/train_autopilot.py FOLDER
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from agents import load_agent
from agents.controllers.designs import design
from agents.rollouts.rollout import episode_costs
from agents.training.request import TrainingRequest, make_plan
from agents.training.result import TrainingProgress
from agents.training.training import train

NEW_SEEDS = np.arange(1_000_000, 1_000_100)


def on_progress(now: TrainingProgress) -> None:
    """Print each evaluation."""
    if now.evaluated:
        print(f"step {now.steps:,}: cost {now.cost:.2f}, LQ's {now.lq_cost:.2f}")


def main(
    folder: Annotated[Path, typer.Argument(help="Folder of the training.")],
) -> None:
    """Train, or resume a training that was stopped, then compare on new episodes."""
    plan = make_plan(
        TrainingRequest("ppo", environment="path-following", model="mariner", threads=2)
    )
    train(plan, folder, resume=folder.exists(), on_progress=on_progress)
    task = plan.task
    for controller in (
        load_agent(folder, task.ship),
        design("ilos", task),
        design("lq", task),
    ):
        costs = episode_costs(controller, task.engine(len(NEW_SEEDS)), NEW_SEEDS)
        print(f"{controller.name}: mean cost of 100 new episodes {costs.mean():.1f}")


if __name__ == "__main__":
    typer.run(main)
