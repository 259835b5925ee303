"""Settings with which stable-baselines3's agents learned the environments of shipgym.

Rewards are to be scaled by stable-baselines3's `VecNormalize(..., norm_obs=False, gamma=...)`: losing
control or running aground costs the rest of the episode, a hundred times what steering well does.
Observations are scaled as they are.
"""

from __future__ import annotations

from typing import Any

#: Ships that PPO sails at once.
PPO_SHIPS = 64


def falling_rate(left: float) -> float:
    """Learning rate by the part of the training that is left."""
    return 1e-3 * left


#: Of `stable_baselines3.PPO`, with 64 ships.
PPO_SETTINGS: dict[str, Any] = {
    "n_steps": 256,
    "batch_size": 1024,
    "n_epochs": 10,
    "learning_rate": falling_rate,
    "gamma": 0.99,
    "policy_kwargs": {"net_arch": [64, 64]},
    "device": "cpu",
}

#: Ships that SAC sails at once.
SAC_SHIPS = 16

#: Of `stable_baselines3.SAC`, with 16 ships and a control interval of five times the default.
SAC_SETTINGS: dict[str, Any] = {
    "learning_starts": 800,
    "batch_size": 256,
    "learning_rate": 2e-3,
    "gamma": 0.95,
    "train_freq": 1,
    "gradient_steps": 8,
    "ent_coef": "auto_0.1",
    "policy_kwargs": {"net_arch": [32, 32]},
    "device": "cpu",
}
