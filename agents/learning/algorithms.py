"""Agents of stable-baselines3 and sb3-contrib by our settings, and the ships that they learn from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from agents.controller import Controller
from agents.learning.plan import Plan, training_options
from agents.learning.residual import ResidualVecEnv
from agents.learning.settings import OffPolicySettings, PPOSettings, Settings
from shipgym.envs.sb3 import ShipVecEnv
from shipgym.errors import InputError

ACTIVATIONS = {
    "relu": torch.nn.ReLU, "tanh": torch.nn.Tanh, "elu": torch.nn.ELU, "silu": torch.nn.SiLU,
}  # fmt: skip
#: Settings that go to the algorithms by their own names, and those that go by others.
SHARED = ("batch_size", "gamma")
OF_PPO = ("n_steps", "n_epochs", "gae_lambda", "clip_range", "ent_coef", "vf_coef", "max_grad_norm")
OF_STORE = ("buffer_size", "learning_starts", "train_freq", "gradient_steps", "tau")
OF_SAC = (*OF_STORE, "ent_coef")
OF_TD3 = (*OF_STORE, "policy_delay", "target_policy_noise", "target_noise_clip")


def make_ships(plan: Plan, base: Controller | None) -> VecEnv:
    """The ships that a plan's agent learns from, as it sees and steers them."""
    ships: VecEnv = ShipVecEnv(
        plan.task.env_id,
        plan.settings.ships,
        model=plan.task.ship,
        threads=plan.threads,
        **training_options(plan),
    )
    settings = plan.settings
    if base is not None or settings.history > 1:
        ships = ResidualVecEnv(ships, base, authority=settings.authority, history=settings.history)
    if settings.scale_rewards:
        ships = VecNormalize(ships, norm_obs=False, gamma=settings.gamma)
    return ships


def make_agent(plan: Plan, base: Controller | None) -> Any:
    """An agent that has learned nothing yet, with its ships.

    Parameters
    ----------
    plan : Plan
    base : Controller or None
        What it adds to.

    Returns
    -------
    BaseAlgorithm
        Its seed is also that of the ships; random numbers begin anew.
    """
    ships = make_ships(plan, base)
    kind, more = _KINDS[plan.algorithm]()
    settings = plan.settings
    arguments = {name: getattr(settings, name) for name in (*SHARED, *more)}
    network: dict[str, Any] = {
        "net_arch": list(settings.net_arch),
        "activation_fn": ACTIVATIONS[settings.activation],
        "optimizer_kwargs": {"fused": True},
    }
    if isinstance(settings, PPOSettings):
        network["log_std_init"] = settings.log_std_init
    if plan.algorithm == "td3":
        n = ships.action_space.shape[0]
        arguments["action_noise"] = NormalActionNoise(np.zeros(n), np.full(n, _of(settings, "action_noise")))
    if plan.algorithm == "tqc":
        network |= {"n_critics": _of(settings, "n_critics"), "n_quantiles": _of(settings, "n_quantiles")}
        arguments["top_quantiles_to_drop_per_net"] = _of(settings, "top_quantiles_to_drop")
    return kind(
        "MlpPolicy",
        ships,
        learning_rate=_rate(settings),
        policy_kwargs=network,
        seed=plan.training_seed,
        device="cpu",
        **arguments,
    )


def steps_of_update(settings: Settings) -> int:
    """Control intervals of all ships between two updates of the network."""
    if isinstance(settings, PPOSettings):
        return settings.ships * settings.n_steps
    assert isinstance(settings, OffPolicySettings)
    return settings.ships * settings.train_freq


def _of(settings: Settings, name: str) -> Any:
    return getattr(settings, name)


def _rate(settings: Settings) -> float | Callable[[float], float]:
    """Learning rate by the part of the training that is left."""
    if settings.schedule == "constant":
        return settings.learning_rate
    return lambda left: settings.learning_rate * left


def _tqc() -> tuple[Any, tuple[str, ...]]:
    try:
        from sb3_contrib import TQC
    except ImportError:
        raise InputError("sb3-contrib is not installed, tqc needs it: pip install 'shipgym[rl]'") from None
    return TQC, OF_SAC


_KINDS: dict[str, Callable[[], tuple[Any, tuple[str, ...]]]] = {
    "ppo": lambda: (PPO, OF_PPO),
    "sac": lambda: (SAC, OF_SAC),
    "td3": lambda: (TD3, OF_TD3),
    "tqc": _tqc,
}
