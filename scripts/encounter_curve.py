"""Learning curve of `examples/encounter.py`: collisions of PPO with its defaults.

Writes the rows of the table in docs/task_of_your_own.md.
"""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3 import PPO

import shipgym

TASK = Path(__file__).parents[1] / "examples" / "encounter.py"
EPISODES = 220


def evaluate(agent: Any) -> tuple[float, float]:
    """Share of episodes that end in a collision, and mean reward of a step.

    220 drawn cases; without an agent the rudder stays amidships.
    """
    ships = shipgym.ShipVecEnv("harbour/Encounter-v0", num_envs=EPISODES, seed=1000)
    seen = ships.reset()
    over = np.zeros(EPISODES, dtype=np.bool_)
    collided = np.zeros(EPISODES, dtype=np.bool_)
    earned = []
    while not over.all():
        actions = np.zeros((EPISODES, 1), dtype=np.float32)
        if agent is not None:
            actions, _ = agent.predict(seen, deterministic=True)
        seen, rewards, done, infos = ships.step(actions)
        earned.append(np.minimum(rewards, 1.0)[~over])
        for row in np.flatnonzero(done & ~over).tolist():
            collided[row] = infos[row]["reward_end"] < 0.0
        over |= done
    return float(collided.mean()), float(np.concatenate(earned).mean())


def main() -> None:
    """Train, and print a row for each part of the training."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=400_000)
    parser.add_argument("--parts", type=int, default=8)
    parser.add_argument("--bounded", type=float, default=0.1)
    parser.add_argument("--scatter", type=float, default=0.0)
    given = parser.parse_args()
    bounded = given.bounded or False
    options = {"dt": 5.0, "episode_steps": 150, "scatter": given.scatter}
    shipgym.register_task("harbour/Encounter-v0", TASK, bounded=bounded, **options)
    ships = shipgym.ShipVecEnv("harbour/Encounter-v0", num_envs=32, seed=0)
    agent = PPO("MlpPolicy", ships, n_steps=256, batch_size=256, seed=0)
    began = time.time()
    print("| steps | collisions | reward of a step |")
    print("| ---: | ---: | ---: |")
    collisions, reward = evaluate(None)
    print(f"| rudder amidships | {100.0 * collisions:.0f} % | {reward:.2f} |")
    for _ in range(given.parts):
        agent.learn(given.steps // given.parts, reset_num_timesteps=False)
        collisions, reward = evaluate(agent)
        steps = agent.num_timesteps
        print(f"| {steps:,} | {100.0 * collisions:.0f} % | {reward:.2f} |", flush=True)
    print(f"{time.time() - began:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
