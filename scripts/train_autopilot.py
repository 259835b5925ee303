"""Train an autopilot by PPO on paths, keep it in a file, and compare it with classical ones.

python scripts/train_autopilot.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from agents import load_agent
from agents.controllers.designs import design
from agents.rollouts.rollout import episode_costs
from agents.training.plan import Given, make_plan
from agents.training.training import Progress, train

NEW_SEEDS = np.arange(1_000_000, 1_000_100)


def tell(now: Progress) -> None:
    """Print each evaluation."""
    if now.evaluated:
        print(f"step {now.steps:,}: cost {now.cost:.2f}, LQ's {now.lq_cost:.2f}")


def main(folder: Path) -> None:
    """Train, or go on with a training that was stopped, then compare on new episodes."""
    plan = make_plan(Given("ppo", environment="path-following", model="mariner", threads=2))
    train(plan, folder, resume=folder.exists(), tell=tell)
    task = plan.task
    for controller in (load_agent(folder, task.ship), design("ilos", task), design("lq", task)):
        costs = episode_costs(controller, task.engine(len(NEW_SEEDS)), NEW_SEEDS)
        print(f"{controller.name}: mean cost of 100 new episodes {costs.mean():.1f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
