"""Agents of stable-baselines3 and sb3-contrib by our settings, and the ships that they learn from."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from agents.controllers.controller import Controller
from agents.policies.policy import NO_LIMIT
from agents.training.plan import Plan, training_options
from agents.training.residual import ResidualVecEnv
from agents.training.settings import (
    OffPolicySettings,
    PPOSettings,
    Settings,
    TD3Settings,
    TQCSettings,
)
from shipgym.envs.sb3 import ShipVecEnv
from shipgym.extras import library

ACTIVATIONS = {"relu": torch.nn.ReLU, "tanh": torch.nn.Tanh}
#: Settings that do not go to the algorithms' classes as keywords of the same name.
_ELSEWHERE = {item.name for item in fields(Settings)} - {"batch_size", "gamma"} | {
    "log_std_init",
    "log_std_end",
    "critic_arch",
    "action_noise",
    "n_critics",
    "n_quantiles",
    "top_quantiles_to_drop",
}


class StaggeredShips(ShipVecEnv):
    """Ships whose first episodes are truncated one after another, evenly over the length of one.

    Else all of them would begin at once, again and again, and a rollout show one part
    of episodes only.
    """

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in each row, each of them of another age."""
        observations: NDArray[np.float32] = super().reset()
        longest = self.vector_env.task.episode_steps
        self.vector_env.write(
            "steps", np.arange(self.num_envs) * longest // self.num_envs
        )
        return observations


def make_ships(plan: Plan, base: Controller | None) -> VecEnv:
    """The ships that a plan's agent learns from, as it sees and steers them."""
    settings, options = plan.settings, training_options(plan)
    ships: VecEnv = StaggeredShips(
        plan.task.env_id,
        settings.ships,
        model=plan.task.ship,
        threads=plan.threads,
        **options,
    )
    part = {
        name: getattr(settings, name)
        for name in ("frame_stack", "action_repeat", "rate_limit")
    }
    if base is not None or part != {
        "frame_stack": 1,
        "action_repeat": 1,
        "rate_limit": NO_LIMIT,
    }:
        ships = ResidualVecEnv(ships, base, authority=settings.authority, **part)
    return scaled_rewards(ships, settings)


def scaled_rewards(ships: VecEnv, settings: Settings) -> VecEnv:
    """Ships whose rewards are scaled as the settings say; observations are scaled as they are."""
    scaled = VecNormalize(ships, norm_obs=False, gamma=settings.gamma)
    if settings.reward_scale != "running":
        scaled.training = False
        scaled.ret_rms.var, scaled.epsilon = np.float64(settings.reward_scale) ** 2, 0.0
    return scaled


def make_agent(plan: Plan, base: Controller | None) -> Any:
    """An agent that has learned nothing yet, with its ships.

    `base`: what it adds to. The agent's seed is also that of the ships; the random
    numbers start again.
    """
    kind = algorithm_class(plan.algorithm)
    ships = make_ships(plan, base)
    arguments = sb3_arguments(plan.settings, ships.action_space.shape)
    agent = kind("MlpPolicy", ships, seed=plan.training_seed, **arguments)
    if base is not None and isinstance(plan.settings, OffPolicySettings):
        begin_as_base(agent)
    return agent


def begin_as_base(agent: Any) -> None:
    """Let a policy that adds to a controller add nothing at first: its last layer is zero.

    Source: Silver et al. 2018, arXiv:1812.06298. PPO's last layer is next to zero
    anyway.
    """
    for actor in (
        agent.actor,
        getattr(agent, "actor_target", agent.actor),
    ):  # SAC and TQC have no target
        last = [
            layer for layer in actor.mu.modules() if isinstance(layer, torch.nn.Linear)
        ][-1]
        torch.nn.init.zeros_(last.weight)
        torch.nn.init.zeros_(last.bias)


def sb3_arguments(
    settings: Settings, action_shape: tuple[int, ...] = (1,)
) -> dict[str, Any]:
    """Keywords of the algorithm's class in stable-baselines3 or sb3-contrib for our settings.

    `action_shape`: of one ship's actions.
    """
    arguments = {
        one.name: getattr(settings, one.name)
        for one in fields(settings)
        if one.name not in _ELSEWHERE
    }
    network: dict[str, Any] = {
        "net_arch": list(settings.net_arch),
        "activation_fn": ACTIVATIONS[settings.activation],
        "optimizer_kwargs": {
            "fused": True
        },  # half of the time of small networks is Adam's otherwise
    }
    if isinstance(settings, OffPolicySettings):
        network["net_arch"] = {
            "pi": list(settings.net_arch),
            "qf": list(settings.critic_arch),
        }
    if isinstance(settings, PPOSettings):
        network["log_std_init"] = settings.log_std_init
    if isinstance(settings, TD3Settings):
        deviation = np.full(action_shape, settings.action_noise)
        arguments["action_noise"] = NormalActionNoise(np.zeros(action_shape), deviation)
    if isinstance(settings, TQCSettings):
        network |= {
            "n_critics": settings.n_critics,
            "n_quantiles": settings.n_quantiles,
        }
        arguments["top_quantiles_to_drop_per_net"] = settings.top_quantiles_to_drop
    return {
        **arguments,
        "learning_rate": _rate(settings),
        "policy_kwargs": network,
        "device": "cpu",
    }


def _rate(settings: Settings) -> float | Callable[[float], float]:
    """Learning rate by the part of the training that is left."""
    if settings.schedule == "constant":
        return settings.learning_rate
    return lambda left: (
        settings.learning_rate * max(left, 0.0)
    )  # the last rollout ends after the last step


def set_deviation(agent: Any, settings: Settings) -> None:
    """Set PPO's exploration for this stage of the training, unless it is learned."""
    if not isinstance(settings, PPOSettings) or settings.log_std_end == "learned":
        return
    if hasattr(agent.policy, "log_std"):  # discrete orders have none
        done = min(agent.num_timesteps / settings.total_steps, 1.0)
        begin, end = settings.log_std_init, float(settings.log_std_end)
        agent.policy.log_std.data.fill_(begin + done * (end - begin))


def algorithm_class(name: str) -> Any:
    """The class of an algorithm by its name; InputError if its package is not installed."""
    if name != "tqc":
        return {"ppo": PPO, "sac": SAC, "td3": TD3}[name]
    return library("sb3_contrib", "rl", "tqc needs it").TQC
