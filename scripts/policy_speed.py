"""Commands per second of a learned policy in NumPy, on one core.

python scripts/policy_speed.py
"""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np

from agents import LearnedPolicy
from agents.policies.network import Layer, Network
from shipgym.ships import load_model
from shipgym.tasks.scales import OBSERVATION_NAMES, observation_scales

SIZES = (len(OBSERVATION_NAMES), 64, 64, 1)
REPEATS = 300


def random_policy(activation: str) -> LearnedPolicy:
    """A policy of course keeping with weights at random."""
    random = np.random.default_rng(0)
    shapes = pairwise(SIZES)
    layers = []
    for n_in, n_out in shapes:
        weight = random.normal(0.0, 0.2, (n_out, n_in)).astype(np.float32)
        layers.append(Layer(weight, np.zeros(n_out, np.float32)))
    network = Network(tuple(layers), activation)
    scales = tuple(observation_scales(load_model("mariner")).tolist())
    return LearnedPolicy(network, OBSERVATION_NAMES, scales)


def rate(policy: LearnedPolicy, ships: int) -> float:
    """Commands per second, the best of some repeats."""
    seen = (
        np.random.default_rng(1)
        .uniform(-1.0, 1.0, (ships, SIZES[0]))
        .astype(np.float32)
    )
    times = []
    for _ in range(REPEATS):
        start = time.thread_time()
        policy.predict(seen)
        times.append(time.thread_time() - start)
    return ships / min(times)


def main() -> None:
    """Print a line for each number of ships."""
    for activation in ("relu", "tanh"):
        policy = random_policy(activation)
        for ships in (1, 64, 4096):
            print(
                f"{activation}, {ships} ships: {rate(policy, ships) / 1e3:.0f} k"
                " commands/s"
            )


if __name__ == "__main__":
    main()
