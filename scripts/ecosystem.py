"""Reinforcement-learning libraries' own wrappers on shipgym's environments.

    make ecosystem                             in a virtual environment of its own
    python scripts/ecosystem.py torchrl skrl   only these, where they are installed

Each takes some steps or a rollout and compares what it shows with the environment
itself. Exits with 1 if one does not run; a library that is not installed is said and
counts as failed too.
"""

from __future__ import annotations

import sys
import traceback
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import shipgym

ID, OPTIONS = "shipgym/PathFollowing-v0", {"model": "mariner", "episode_steps": 30}
STEPS = 70  # two episodes end within


def single() -> Any:
    """One ship."""
    return gymnasium.make(ID, **OPTIONS)


def many(**options: Any) -> Any:
    """Four ships at once."""
    return gymnasium.make_vec(ID, 4, **OPTIONS, **options)


def skrl_single() -> None:
    """The wrapper of skrl of one environment."""
    _skrl(single(), 1)


def skrl_native() -> None:
    """The wrapper of skrl of a vector environment."""
    _skrl(many(), 4)


def _skrl(env: Any, n: int) -> None:
    import torch
    from skrl.envs.wrappers.torch import wrap_env

    wrapped = wrap_env(env, wrapper="gymnasium", verbose=False)
    wrapped.reset()
    ended = 0
    for _ in range(STEPS):
        seen, _, terminated, truncated, _ = wrapped.step(torch.zeros(n, 1))
        assert seen.shape == (n, 15), seen.shape
        assert torch.isfinite(seen).all()
        over = terminated | truncated
        ended += int(over.sum())
        if n == 1 and bool(over.any()):
            wrapped.reset()
    assert ended == 2 * n, ended


def torchrl_single() -> None:
    """TorchRL's environment by an id with frames skipped, and its checker."""
    from torchrl.envs import GymEnv, GymWrapper
    from torchrl.envs.utils import check_env_specs

    assert GymEnv(ID, frame_skip=3, **OPTIONS).rollout(8)["observation"].shape == (
        8,
        15,
    )
    wrapped = GymWrapper(single())
    check_env_specs(wrapped)
    assert wrapped.rollout(STEPS)["next", "truncated"][-1].item()


def torchrl_native() -> None:
    """TorchRL's wrapper of a vector environment."""
    from torchrl.envs import GymWrapper

    rollout = GymWrapper(many(autoreset_mode="Disabled")).rollout(
        STEPS, break_when_any_done=False
    )
    assert rollout["observation"].shape == (4, STEPS, 15), rollout["observation"].shape
    assert rollout["next", "truncated"].sum().item() >= 8


def tianshou_single() -> None:
    """Tianshou's vector of single environments."""
    from tianshou.env import DummyVectorEnv

    envs = DummyVectorEnv([single for _ in range(3)])
    assert envs.reset(seed=1)[0].shape == (3, 15)
    for _ in range(20):
        seen, rewards, *_ = envs.step(np.zeros((3, 1), np.float32))
    assert np.isfinite(seen).all()
    assert (rewards > 0.0).all()
    ours = single()
    ours.reset(seed=1)  # that of each
    for _ in range(20):
        expected, *_ = ours.step(np.zeros(1, np.float32))
    np.testing.assert_array_equal(seen[1], expected)


def tianshou_native() -> None:
    """Tianshou's collector on a native vector environment (`TianshouShips`)."""
    import torch
    from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
    from tianshou.data import Collector, VectorReplayBuffer
    from tianshou.utils.net.common import Net
    from tianshou.utils.net.continuous import ContinuousActorProbabilistic

    envs = TianshouShips(many(autoreset_mode="Disabled"))
    spaces = envs.native.single_observation_space, envs.native.single_action_space
    net = Net(state_shape=spaces[0].shape, hidden_sizes=[16])
    actor = ContinuousActorProbabilistic(
        preprocess_net=net, action_shape=spaces[1].shape, unbounded=True
    )
    policy = ProbabilisticActorPolicy(
        actor=actor,
        dist_fn=lambda mean: torch.distributions.Independent(
            torch.distributions.Normal(*mean), 1
        ),
        action_space=spaces[1],
    )
    buffer = VectorReplayBuffer(4 * STEPS, 4)
    collected = Collector(policy, envs, buffer).collect(
        n_step=4 * STEPS, reset_before_collect=True
    )
    assert collected.n_collected_steps == 4 * STEPS, collected
    assert collected.n_collected_episodes == 8, collected
    kept, _ = buffer.sample(0)
    assert kept.obs.shape == (4 * STEPS, 15), kept.obs.shape
    begun = (kept.obs[1:STEPS] == kept.obs_next[: STEPS - 1]).all(
        axis=1
    )  # of the first ship
    assert list(np.flatnonzero(~begun)) == list(
        np.flatnonzero(kept.done[: STEPS - 1])
    ), "episodes"


class TianshouShips:
    """A native vector environment without autoreset, as Tianshou's collector uses it.

    For `collect(n_step=...)`, in which every ship takes every step.
    """

    is_async, waiting_id = False, ()

    def __init__(self, native: Any) -> None:
        self.native, self.env_num = native, native.num_envs
        self.action_space = [native.single_action_space] * self.env_num

    def __len__(self) -> int:
        return self.env_num

    def reset(self, env_id: Any = None, **reset: Any) -> tuple[Any, Any]:
        """Begin episodes of all ships or of some; observations and infos of these."""
        chosen = np.arange(self.env_num) if env_id is None else np.asarray(env_id)
        if env_id is not None:
            reset["options"] = {"reset_mask": np.isin(np.arange(self.env_num), chosen)}
        observations, _ = self.native.reset(**reset)
        return observations[chosen], np.array([{"env_id": one} for one in chosen])

    def step(self, action: Any, id: Any = None) -> tuple[Any, ...]:
        """One step of all ships."""
        if id is not None and len(id) != self.env_num:
            raise ValueError(
                f"{len(id)} ships found, expected all {self.env_num}: collect n_step"
            )
        *found, _ = self.native.step(np.asarray(action, np.float32))
        return *found, np.array([{"env_id": one} for one in range(self.env_num)])


def cleanrl_single() -> None:
    """The wrappers of CleanRL's `ppo_continuous_action.py` around each environment."""
    from gymnasium import wrappers as w

    def make() -> Any:
        env = w.ClipAction(w.RecordEpisodeStatistics(w.FlattenObservation(single())))
        env = w.TransformObservation(
            w.NormalizeObservation(env),
            lambda seen: np.clip(seen, -10.0, 10.0),
            env.observation_space,
        )
        return w.TransformReward(
            w.NormalizeReward(env, gamma=0.99), lambda reward: np.clip(reward, -10, 10)
        )

    _cleanrl(gymnasium.vector.SyncVectorEnv([make for _ in range(4)]))


def cleanrl_native() -> None:
    """The same wrappers in their forms for vectors, around a native environment."""
    from gymnasium.wrappers import vector as w

    env = w.NormalizeObservation(w.ClipAction(w.RecordEpisodeStatistics(many())))
    _cleanrl(w.NormalizeReward(env, gamma=0.99))


def _cleanrl(envs: Any) -> None:
    envs.reset(seed=1)
    episodes = 0
    for _ in range(STEPS):
        seen, rewards, _, _, infos = envs.step(np.zeros((4, 1), np.float32))
        episodes += int(np.sum(infos.get("_episode", 0)))
        assert np.isfinite(seen).all()
        assert np.isfinite(rewards).all()
    assert episodes == 8, episodes


def sb3_wrapped() -> None:
    """ShipVecEnv around Gymnasium's wrapper of a native one, in stable-baselines3."""
    from gymnasium.wrappers.vector import RecordEpisodeStatistics
    from stable_baselines3 import PPO

    ships = shipgym.ShipVecEnv(RecordEpisodeStatistics(many(autoreset_mode="SameStep")))
    PPO("MlpPolicy", ships, n_steps=16, batch_size=32).learn(128)


CHECKS: dict[str, tuple[Callable[[], None], ...]] = {
    "skrl": (skrl_single, skrl_native),
    "torchrl": (torchrl_single, torchrl_native),
    "tianshou": (tianshou_single, tianshou_native),
    "cleanrl": (cleanrl_single, cleanrl_native),
    "stable-baselines3": (sb3_wrapped,),
}


def main(names: list[str]) -> int:
    """Run the checks of some libraries, by default of all; the number that failed."""
    warnings.filterwarnings("ignore", category=DeprecationWarning)
    failed = 0
    for name in names or CHECKS:
        for check in CHECKS[name]:
            try:
                check()
                said = "runs"
            except Exception as error:
                failed += 1
                said = f"FAILED: {type(error).__name__}: {error}"
                traceback.print_exc()
            print(f"{name:18} {(check.__doc__ or '').strip()[:-1]}: {said}", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(min(main(sys.argv[1:]), 1))
