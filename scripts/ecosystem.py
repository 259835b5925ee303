"""Reinforcement-learning libraries' own wrappers on shipgym's environments, and a turn in shipmmg.

    make ecosystem                            in a virtual environment of its own; needs the network
    python scripts/ecosystem.py torchrl skrl  only these, where they are installed

Each takes some steps or a rollout and compares what it shows with the environment itself. Exits with 1 if one
does not run; a library that is not installed is said and counts as failed too.
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

ID, OPTIONS = "shipgym/PathFollowing-v1", {"model": "mariner", "episode_steps": 30}
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

    assert GymEnv(ID, frame_skip=3, **OPTIONS).rollout(8)["observation"].shape == (8, 15)
    wrapped = GymWrapper(single())
    check_env_specs(wrapped)
    assert wrapped.rollout(STEPS)["next", "truncated"][-1].item()


def torchrl_native() -> None:
    """TorchRL's wrapper of a vector environment."""
    from torchrl.envs import GymWrapper

    rollout = GymWrapper(many(autoreset_mode="Disabled")).rollout(STEPS, break_when_any_done=False)
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
    assert (rewards < 0.0).all()
    ours = single()
    ours.reset(seed=1)  # that of each
    for _ in range(20):
        expected, *_ = ours.step(np.zeros(1, np.float32))
    np.testing.assert_array_equal(seen[1], expected)


def pufferlib_single() -> None:
    """PufferLib's emulation and its serial vector of it."""
    import pufferlib.emulation
    import pufferlib.vector

    def make(**options: Any) -> Any:
        return pufferlib.emulation.GymnasiumPufferEnv(env_creator=single, **options)

    envs = pufferlib.vector.make(make, num_envs=3, backend=pufferlib.vector.Serial)
    envs.reset(seed=0)
    for _ in range(STEPS):
        seen, rewards, *_ = envs.step(np.zeros((3, 1), np.float32))
    assert seen.shape == (3, 15)
    assert np.isfinite(rewards).all()
    envs.close()


def cleanrl_single() -> None:
    """The wrappers of CleanRL's `ppo_continuous_action.py` around each environment."""
    from gymnasium import wrappers as w

    def make() -> Any:
        env = w.ClipAction(w.RecordEpisodeStatistics(w.FlattenObservation(single())))
        env = w.TransformObservation(
            w.NormalizeObservation(env), lambda seen: np.clip(seen, -10.0, 10.0), env.observation_space
        )
        return w.TransformReward(w.NormalizeReward(env, gamma=0.99), lambda reward: np.clip(reward, -10, 10))

    _cleanrl(gymnasium.vector.SyncVectorEnv([make for _ in range(4)]))


def cleanrl_native() -> None:
    """The same wrappers around a native vector environment, in their forms for vectors."""
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
    """ShipVecEnv around Gymnasium's wrapper of a native vector environment, in stable-baselines3."""
    from gymnasium.wrappers.vector import RecordEpisodeStatistics
    from stable_baselines3 import PPO

    ships = shipgym.ShipVecEnv(RecordEpisodeStatistics(many(autoreset_mode="SameStep")))
    PPO("MlpPolicy", ships, n_steps=16, batch_size=32).learn(128)


def shipmmg_turn() -> None:
    """A turn of KVLCC2 at 35 deg in shipmmg and here ends within a millimetre of the same place."""
    from shipmmg.mmg_3dof import Mmg3DofBasicParams, Mmg3DofManeuveringParams, simulate_mmg_3dof

    from shipgym.ships.catalogue import kvlcc2_l7

    ship = kvlcc2_l7("shipmmg")
    fields = shipgym.interchange.to_shipmmg(ship)
    rudder, n = np.radians(35.0), ship.service_shaft_speed
    ours = ship.simulate(np.tile([rudder, n], (1000, 1)), 0.2)
    orders = np.minimum(ship.steering.rate * ours.t, rudder)
    theirs = simulate_mmg_3dof(
        Mmg3DofBasicParams(**fields["basic_params"]),
        Mmg3DofManeuveringParams(**fields["maneuvering_params"]),
        ours.t, orders, np.full(len(ours.t), n), u0=ship.particulars["speed"], rtol=1e-8, atol=1e-10,
    ).sol(ours.t[-1])  # fmt: skip
    apart = np.hypot(theirs[3] - ours["x"][-1], theirs[4] - ours["y"][-1])
    assert apart < 1e-3, f"{1000.0 * apart:.2f} mm apart"


CHECKS: dict[str, tuple[Callable[[], None], ...]] = {
    "skrl": (skrl_single, skrl_native),
    "torchrl": (torchrl_single, torchrl_native),
    "tianshou": (tianshou_single,),  # it makes its vectors of single environments alone
    "pufferlib": (pufferlib_single,),  # likewise
    "cleanrl": (cleanrl_single, cleanrl_native),
    "stable-baselines3": (sb3_wrapped,),
    "shipmmg": (shipmmg_turn,),
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
