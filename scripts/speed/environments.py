"""Environments: single, in vectors, in weather, of kernel models, with a learner."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import shipgym
from identification import KernelResidual, identify
from shipgym.envs.registration import env_id
from shipgym.manoeuvres import zigzag
from shipgym.sea import Current, Waves, Weather, Wind
from speed.measure import MODEL, SHORT_REPEATS, SHORT_STEPS, Row, best_time, run_python

STEPS_IN_PYTHON = """
import os, sys, time
import gymnasium, numpy as np, shipgym
env = gymnasium.make("shipgym/CourseKeeping-v0", model=sys.argv[1])
env.reset(seed=0)
action = np.zeros(1, dtype=np.float32)
env.step(action)
least = float("inf")
for _ in range(40):
    start = time.process_time()
    for _ in range(50):
        if any(env.step(action)[2:4]):
            env.reset()
    least = min(least, time.process_time() - start)
print(50 / least)
"""

SYNC_STEPS_IN_PYTHON = """
import sys, time
import gymnasium, numpy as np, shipgym
n = int(sys.argv[3])
env = gymnasium.make_vec(
    sys.argv[1], num_envs=n, vectorization_mode="sync", model=sys.argv[2]
)
env.reset(seed=0)
actions = np.zeros((n, 1), dtype=np.float32)
least = float("inf")
for _ in range(5):
    start = time.process_time()
    for _ in range(5):
        env.step(actions)
    least = min(least, time.process_time() - start)
print(5 * n / least)
"""


def single_environment(n_steps: int = 1000) -> Row:
    """Steps per second by `gymnasium.make`, against the same files as plain Python."""
    env = gymnasium.make("shipgym/CourseKeeping-v0", model=MODEL)
    env.reset(seed=0)
    action = np.zeros(1, dtype=np.float32)

    def run() -> None:
        for _ in range(n_steps):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    compiled = n_steps / best_time(run, SHORT_REPEATS)
    (plain,) = run_python(STEPS_IN_PYTHON, MODEL, NUMBA_DISABLE_JIT="1")
    return Row(
        "single environment, gymnasium.make",
        f"{compiled / 1e3:.0f} k steps/s",
        f"plain Python {plain / 1e3:.2f} k steps/s",
        compiled / plain,
        "300 k steps/s, 30 times",
    )


def native_speed(
    env_id: str,
    n_envs: int,
    clock: Callable[[], float] = time.process_time,
    **options: Any,
) -> float:
    """Steps per second of a native vector environment, with all returned values."""
    env = gymnasium.make_vec(
        env_id, num_envs=n_envs, vectorization_mode="vector_entry_point", **options
    )
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = env.action_space.sample()
    steps = min(max(SHORT_STEPS // n_envs, 1), 500)

    def sail() -> None:
        for _ in range(steps):
            env.step(
                actions
            )  # and let go of what it returns, as a learner does that has copied it

    return steps * n_envs / best_time(sail, SHORT_REPEATS, clock)


def native_against_python(task: str, n_envs: int = 64) -> Row:
    """The native vector environment against SyncVectorEnv as plain Python."""
    native = native_speed(env_id(task), n_envs, model=MODEL)
    (plain,) = run_python(
        SYNC_STEPS_IN_PYTHON, env_id(task), MODEL, str(n_envs), NUMBA_DISABLE_JIT="1"
    )
    return Row(
        f"{n_envs} {task}, gymnasium.make_vec",
        f"{native / 1e6:.1f} M steps/s",
        f"SyncVectorEnv in plain Python {plain / 1e3:.2f} k steps/s",
        native / plain,
        "100 times",
    )


def native_against_cart_pole(task: str, n_envs: int = 1024) -> Row:
    """The native vector environment against Gymnasium's own of CartPole."""
    native = native_speed(env_id(task), n_envs, model=MODEL)
    poles = native_speed("CartPole-v1", n_envs)
    return Row(
        f"{n_envs} {task}, gymnasium.make_vec",
        f"{native / 1e6:.1f} M steps/s",
        f"Gymnasium's native CartPole {poles / 1e6:.1f} M steps/s",
        native / poles,
        "3 times",
    )


def vector_speed(n_envs: int, task: str = "CourseKeeping", **options: Any) -> float:
    """Environment steps per second of a native vector environment of ours."""
    return native_speed(env_id(task), n_envs, model=MODEL, **options)


def vector_environment(task: str, n_envs: int, aim: str) -> Row:
    """A native vector environment on one core, against one environment at a time."""
    batched, single = vector_speed(n_envs, task), vector_speed(1, task)
    return Row(
        f"{task}, {n_envs} at once",
        f"{batched / 1e6:.1f} M steps/s",
        f"one at a time {single / 1e3:.0f} k steps/s",
        batched / single,
        aim,
    )


def weather(n_envs: int) -> Row:
    """A native vector environment with current, wind and waves, against calm water."""
    sea = Weather(
        current=Current(1.0, variation=0.2), wind=Wind(12.0), waves=Waves(3.25, 9.7)
    )
    rough, calm = vector_speed(n_envs, sea=sea), vector_speed(n_envs)
    return Row(
        f"CourseKeeping, {n_envs} at once, in current, wind and waves",
        f"{rough / 1e6:.1f} M steps/s",
        f"calm {calm / 1e6:.1f} M steps/s",
        rough / calm,
        "0.5",
    )


def kernel_ship(n_envs: int = 1024, centres: int = 64) -> Row:
    """A radial-basis model against its sums alone on NumPy arrays."""
    ship = shipgym.load_model("kvlcc2-l7")
    trials = [
        zigzag(ship, angle, angle, duration=100.0, dt=0.2, port_first=port).with_(
            name=f"{angle} {port}"
        )
        for angle in (10, 20)
        for port in (False, True)
    ]
    model = identify(
        trials,
        structure="linear",
        kernel=KernelResidual(centres=centres, length=1.4, C=100.0),
        particulars=ship.particulars,
        steering=ship.steering,
    ).model
    native = native_speed("shipgym/CourseKeeping-v0", n_envs, model=model)
    states = {
        name: np.full(n_envs, value)
        for name, value in zip("uvr", (1.0, 0.1, 0.01), strict=True)
    }
    states["delta"] = np.linspace(-0.5, 0.5, n_envs)
    stage = best_time(lambda: model.table.features("r", states, model.particulars), 50)
    return Row(
        f"CourseKeeping, {n_envs} kernel models of {centres} centres",
        f"{native / 1e6:.1f} M steps/s",
        f"the sums over their centres alone in NumPy {n_envs / (4.0 * stage) / 1e6:.2f}"
        " M steps/s",
        native * 4.0 * stage / n_envs,
        "3 M steps/s",
    )


def learning(task: str) -> Row:
    """Frames per second of PPO as shipped, on one core, and our share of the time."""
    from speed.learning import ppo_speed  # here, because torch takes seconds to import

    frames, share = ppo_speed(env_id(task))
    return Row(
        f"PPO, 256 {task}, one core",
        f"{frames / 1e3:.1f} k frames/s",
        f"{100.0 * share:.1f} % of the time in the environment",
        None,
        "40 k frames/s, 15 %",
    )
