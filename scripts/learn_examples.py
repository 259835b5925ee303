"""Learning curves of the example tasks with stable-baselines3's defaults.

    python scripts/learn_examples.py            # all of docs/environments/examples.md
    python scripts/learn_examples.py berth --steps 50000

PPO with its defaults but 256 steps of 32 ships a rollout; after each quarter of the
steps the mean reward, length and end of 64 episodes.
"""

import argparse
import runpy
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from stable_baselines3 import PPO

import shipgym

ROOT = Path(__file__).parents[1]
EXAMPLES = ("encounter", "berth", "river")
N_SHIPS, N_EPISODES, QUARTERS = 32, 64, 4


class Ends(NamedTuple):
    """Means over episodes."""

    reward: float
    steps: float
    arrived: float  # share


def main() -> None:
    """Learn the examples that are named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("names", nargs="*", default=EXAMPLES)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    print("| example | steps | reward | steps of an episode | arrive | processor, s |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in arguments.names:
        learn(name, arguments.steps, arguments.seed)


def learn(name: str, steps: int, seed: int) -> None:
    """Learn an example, and print a row before and after each quarter."""
    path = ROOT / "examples" / f"{name}.py"
    options = runpy.run_path(str(path)).get("OPTIONS", {"dt": 5.0})
    env_id = f"examples/{name}-v0"
    shipgym.register_task(env_id, str(path), **options)
    ships = shipgym.ShipVecEnv(env_id, num_envs=N_SHIPS)
    agent = PPO("MlpPolicy", ships, n_steps=256, seed=seed)
    began = time.process_time()
    show(name, 0, sailed(agent, env_id), 0.0)
    for quarter in range(1, QUARTERS + 1):
        agent.learn(steps // QUARTERS, reset_num_timesteps=False)
        spent = time.process_time() - began
        show(name, quarter * steps // QUARTERS, sailed(agent, env_id), spent)


def sailed(agent: Any, env_id: str) -> Ends:
    """How episodes end that an agent steers without chance."""
    ships = shipgym.ShipVecEnv(env_id, num_envs=N_SHIPS, seed=1000)
    seen = ships.reset()
    ends: list[Ends] = []
    while len(ends) < N_EPISODES:
        actions, _ = agent.predict(seen, deterministic=True)
        seen, _, over, infos = ships.step(actions)
        for row in np.flatnonzero(over).tolist():
            info = infos[row]
            episode = info["episode"]
            lost = info["reward_end"] < 0.0
            arrived = not (info["TimeLimit.truncated"] or lost)
            ends.append(Ends(episode["r"], episode["l"], float(arrived)))
    means = np.mean(ends, axis=0)
    return Ends(*means.tolist())


def show(name: str, steps: int, ends: Ends, seconds: float) -> None:
    """Print a row of the table."""
    arrived = f"{100.0 * ends.arrived:.0f} %"
    print(
        f"| {name} | {steps:,} | {ends.reward:.0f} | {ends.steps:.0f} | {arrived} |"
        f" {seconds:.0f} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
