"""Learning speed of PPO on ShipVecEnv, and the environment's share of the time."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents.training.algorithms import sb3_arguments
from agents.training.settings import load_settings
from shipgym import ShipVecEnv


class LearningSpeed(NamedTuple):
    """Frames per second, and the part of the time spent in the environment."""

    frames: float
    share: float


class Timed(ShipVecEnv):
    """Knows how long its steps took, s."""

    spent = 0.0

    def step_wait(self) -> Any:
        """One control interval."""
        start = time.perf_counter()
        outcome = super().step_wait()
        self.spent += time.perf_counter() - start
        return outcome


def ppo_speed(env_id: str, repeats: int = 3) -> LearningSpeed:
    """The fastest of some rollouts with their updates, by the shipped settings."""
    torch.set_num_threads(1)
    settings = load_settings("ppo", given={"base": "none"})
    env = Timed(env_id, settings.ships, seed=0)
    scaled = VecNormalize(env, norm_obs=False, gamma=settings.gamma)
    agent = PPO("MlpPolicy", scaled, seed=0, **sb3_arguments(settings))
    frames = settings.ships * agent.n_steps
    measured = []
    for _ in range(repeats):
        env.spent, start = 0.0, time.perf_counter()
        agent.learn(frames, reset_num_timesteps=False)
        total = time.perf_counter() - start
        measured.append(LearningSpeed(frames / total, env.spent / total))
    return max(measured)
