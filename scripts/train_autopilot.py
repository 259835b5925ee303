"""Train an autopilot by PPO in calm water, keep it in a file, and fly it beside LQ.

python scripts/train_autopilot.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

from agents import LQ, fly, load_agent
from agents.learning.plan import Given, make_plan
from agents.learning.training import Progress, train
from shipgym.models import load_model

NEW_SEEDS = range(1_000_000, 1_000_100)


def tell(now: Progress) -> None:
    """Print each evaluation."""
    if now.evaluated:
        print(f"step {now.steps:,}: cost {now.cost:.2f}, LQ's {now.lq_cost:.2f}")


def main(folder: Path) -> None:
    """Train, or go on with a training that was stopped, then compare on episodes that nobody has seen."""
    plan = make_plan(Given("ppo", environment="course-keeping", model="mariner", threads=2))
    train(plan, folder, resume=folder.exists(), tell=tell)
    model = load_model("mariner")
    for controller in (load_agent(folder / "agent.json", model), LQ.from_model(model)):
        flights = fly(controller, model, seeds=list(NEW_SEEDS))
        print(f"{controller.name}: mean cost of 100 new episodes {flights.cost.mean():.2f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
