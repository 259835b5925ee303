"""`shipgym train` beside stable-baselines3's PPO on tasks from files, at equal steps.

    python scripts/own_tasks.py                    one seed, 65,536 steps
    python scripts/own_tasks.py --seeds 3 --only berth turn

Both learn from the same number of decisions, each with its own defaults: stable-
baselines3 on one ship of `gymnasium.make`. Costs are means of 100 episodes that neither
has seen: of the policy that `shipgym train` keeps, of its last one, and of
stable-baselines3's last.
"""

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO

from agents.agent_file import load_agent
from agents.policies.policy import LearnedPolicy
from agents.rollouts.rollout import episode_costs
from agents.training.plan import TrainingPlan, make_plan
from agents.training.training import train
from agents.training.yardsticks import RandomActions
from shipgym.envs.registration import register_file
from shipgym.examples import FOLDER

ROOT = Path(__file__).parents[1]
TASKS = {
    path.stem: path
    for folder in (FOLDER, ROOT / "examples", Path(__file__).with_suffix(""))
    for path in sorted(folder.glob("[!_]*.py"))
}
JUDGED = 1_000_000 + np.arange(100)  # seeds


def judged(policy: Any, plan: TrainingPlan) -> float:
    """Mean cost of an episode."""
    return float(episode_costs(policy, plan.task.engine(len(JUDGED)), JUDGED).mean())


def by_shipgym(plan: TrainingPlan) -> tuple[float, float]:
    """Costs of the policy that `shipgym train` keeps, and of its last one."""
    with TemporaryDirectory() as folder:
        kept = train(plan, Path(folder, "run")).policy
        last = load_agent(Path(folder, "run", "last.json"))
    return judged(kept, plan), judged(last, plan)


def by_itself(env_id: str, plan: TrainingPlan, seed: int) -> float:
    """Cost of what stable-baselines3's PPO learns with its defaults."""
    agent = PPO("MlpPolicy", gymnasium.make(env_id), seed=seed, device="cpu")
    agent.learn(plan.settings.total_steps)
    return judged(LearnedPolicy.from_sb3(agent), plan)


def main() -> None:
    """Print a row for each task and seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(TASKS), default=list(TASKS))
    parser.add_argument("--seeds", type=int, default=1)
    given = parser.parse_args()
    torch.set_num_threads(1)
    print("| task | seed | no action | kept | last | stable-baselines3 | seconds |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for seed in range(given.seeds):
        for name in given.only:
            row(name, seed)


def row(name: str, seed: int) -> None:
    """Learn a task both ways, and print what that costs."""
    env_id = f"own/{name.capitalize()}-v0"
    register_file(env_id, TASKS[name])
    plan = make_plan("ppo", env_id, settings={"total_steps": 65_536}, seed=seed)
    costs = [judged(RandomActions(plan.task.task.n_commands, 0.0), plan)]
    began = time.process_time()
    costs += by_shipgym(plan)
    learned = time.process_time()
    costs.append(by_itself(env_id, plan, seed))
    seconds = f"{learned - began:.0f}, {time.process_time() - learned:.0f}"
    cells = [name, str(seed), *(f"{cost:.4g}" for cost in costs), seconds]
    print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
