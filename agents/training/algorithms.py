"""Agents of stable-baselines3, and the ships that they learn from."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from agents.agent_file import load_agent
from agents.controllers.controller import Controller
from agents.controllers.designs import design, tuned
from agents.suites.benchmark_task import BenchmarkTask
from agents.training.plan import TrainingPlan, training_options
from agents.training.residual import ResidualVecEnv
from agents.training.settings import LearningSettings, PPOSettings, SACSettings
from shipgym.envs.pace import NO_LIMIT
from shipgym.envs.sb3 import ShipVecEnv
from shipgym.errors import InputError

ALGORITHMS = {"ppo": PPO, "sac": SAC}
ACTIVATIONS = {"relu": torch.nn.ReLU, "tanh": torch.nn.Tanh}


class StaggeredShips(ShipVecEnv):
    """Ships whose first episodes are truncated one after another, evenly in time.

    Else all of them would begin at once, again and again, and a rollout show one part
    of episodes only.
    """

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in each row, each of them of another age."""
        observations: NDArray[np.float32] = super().reset()
        longest = self.vector_env.task.episode_steps
        ages = np.arange(self.num_envs) * longest // self.num_envs
        self.vector_env.write("steps", ages)
        return observations


def make_ships(plan: TrainingPlan, base: Controller | None) -> VecEnv:
    """Make the ships that a plan's agent learns from, as it sees and steers them."""
    settings = plan.settings
    options = training_options(plan)
    pace: dict[str, Any] = {"action_repeat": settings.action_repeat}
    if settings.rate_limit < NO_LIMIT:
        pace["rate_limit"] = settings.rate_limit
    if base is None:
        options |= {"frame_stack": settings.frame_stack, **pace}
    ships: VecEnv = StaggeredShips(
        plan.task.env_id,
        settings.ships,
        model=plan.task.ship,
        **options,
    )
    if base is not None:
        ships = ResidualVecEnv(ships, base, authority=settings.authority, **pace)
    return scaled_rewards(ships, settings)


def scaled_rewards(ships: VecEnv, settings: LearningSettings) -> VecEnv:
    """Scale rewards as the settings say; observations are scaled as they are."""
    scaled = VecNormalize(ships, norm_obs=False, gamma=settings.gamma)
    scale = settings.reward_scale
    if scale != "running":
        scaled.training = False
        scaled.ret_rms.var = np.float64(scale) ** 2
        scaled.epsilon = 0.0
    return scaled


def make_agent(plan: TrainingPlan, base: Controller | None) -> Any:
    """Make an agent that has learned nothing yet, with its ships.

    `base` is the controller that it adds to. The agent's seed is also that of the
    ships; the random numbers start again.
    """
    agent = ALGORITHMS[plan.algorithm](
        "MlpPolicy",
        make_ships(plan, base),
        seed=plan.training_seed,
        **sb3_arguments(plan.settings),
    )
    if base is not None and plan.algorithm == "sac":
        # the last layer is zero and adds nothing to the base (Silver et al. 2018,
        # arXiv:1812.06298); PPO's is next to zero anyway
        torch.nn.init.zeros_(agent.actor.mu.weight)
        torch.nn.init.zeros_(agent.actor.mu.bias)
    return agent


def design_base(name: str, task: BenchmarkTask) -> Controller | None:
    """Controller that a policy adds to, by the setting `base`.

    Raises InputError if the ship has no such controller, the file is not one for her,
    or guidance has no path to follow.

    Parameters
    ----------
    name : str
        "none"; a kind of controller, which is designed on the task's ship; "tuned", the
        best of those that were tuned for the task of a suite, without `NO_BASES`; or a
        controller's file.
    task : BenchmarkTask
    """
    if name == "none":
        return None
    if name == "tuned":
        if not task.suite:
            raise InputError(
                "base: expected a task of a suite for 'tuned', got none; give --task,"
                " or another base"
            )
        return tuned("base", task, task.suite)
    if name.endswith(".json"):
        agent = load_agent(name, task.ship)
        if not isinstance(agent, Controller):
            raise InputError(
                f"base: {name}: expected a classical controller, got a learned policy"
            )
        return agent
    return design(name, task)


def sb3_arguments(settings: LearningSettings) -> dict[str, Any]:
    """Keywords of the algorithm's class in stable-baselines3."""
    names = ["batch_size", "gamma", "ent_coef"]
    network: dict[str, Any] = {
        "net_arch": list(settings.net_arch),
        "activation_fn": ACTIVATIONS[settings.activation],
        # half of the time of small networks is Adam's otherwise
        "optimizer_kwargs": {"fused": True},
    }
    if isinstance(settings, PPOSettings):
        names += ["n_steps", "n_epochs", "gae_lambda", "clip_range"]
        network["log_std_init"] = settings.log_std_init
    if isinstance(settings, SACSettings):
        names += ["buffer_size", "learning_starts", "train_freq", "gradient_steps"]
        names += ["tau", "target_entropy"]
        network["net_arch"] = {
            "pi": list(settings.net_arch),
            "qf": list(settings.critic_arch),
        }
    return {
        **{name: getattr(settings, name) for name in names},
        "learning_rate": LinearSchedule(settings.learning_rate, 0.0, 1.0),
        "policy_kwargs": network,
        "device": "cpu",
    }


def set_deviation(agent: Any, settings: LearningSettings) -> None:
    """Set PPO's exploration for this stage of the training, unless it is learned."""
    if not isinstance(settings, PPOSettings) or settings.log_std_end == "learned":
        return
    if hasattr(agent.policy, "log_std"):  # discrete orders have none
        done = min(agent.num_timesteps / settings.total_steps, 1.0)
        begin = settings.log_std_init
        change = float(settings.log_std_end) - begin
        agent.policy.log_std.data.fill_(begin + done * change)
