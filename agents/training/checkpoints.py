"""All of a training that the steps to come depend on: taken at a rollout's boundary, and put back.

Networks and optimisers, the store of past steps, counters, random numbers, scales of the rewards, and the
ships where they are. A run that is put back goes on as if it had never stopped, bit for bit on the same
machine; so checkpoints may be taken at any time without changing what is learned.
"""

from __future__ import annotations

import random
from collections import deque
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.save_util import recursive_getattr
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize

Memory = dict[str, Any]
COUNTERS = (
    "num_timesteps",
    "_n_updates",
    "_episode_num",
    "_last_obs",
    "_last_episode_starts",
    "_last_original_obs",
)
STORED = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def take(agent: Any) -> Memory:
    """The state of an agent of stable-baselines3 and of its ships.

    `agent`: between a rollout and the next, its ships begun. Returns nested values for
    `safe_file.write_values`.
    """
    _, variables = agent._get_torch_save_params()
    return {
        "parameters": agent.get_parameters(),
        "variables": {name: recursive_getattr(agent, name) for name in variables},
        "counters": {name: getattr(agent, name) for name in COUNTERS},
        "episodes": list(agent.ep_info_buffer),
        "successes": [float(one) for one in agent.ep_success_buffer],
        "ships": [_layer_memory(layer) for layer in _layers(agent.env)],
        "replay": _replay_memory(getattr(agent, "replay_buffer", None)),
        "random": _random_memory(agent),
    }


def put_back(agent: Any, memory: Memory) -> None:
    """Let an agent made alike go on from what `take` gave, by `learn(..., reset_num_timesteps=False)`."""
    agent.set_parameters(memory["parameters"], exact_match=True, device="cpu")
    for name, value in memory["variables"].items():
        recursive_getattr(agent, name).data.copy_(value)
    for name, value in memory["counters"].items():
        setattr(agent, name, value)
    window = agent._stats_window_size
    agent.ep_info_buffer = deque(memory["episodes"], maxlen=window)
    agent.ep_success_buffer = deque(memory["successes"], maxlen=window)
    for layer, own in zip(_layers(agent.env), memory["ships"], strict=True):
        _put_layer_back(layer, own)
    _put_replay_back(getattr(agent, "replay_buffer", None), memory["replay"])
    _put_random_back(agent, memory["random"])


def _layers(env: Any) -> list[Any]:
    """An environment and those inside of it."""
    layers = [env]
    while isinstance(layers[-1], VecEnvWrapper):
        layers.append(layers[-1].venv)
    return layers


def _layer_memory(layer: Any) -> Memory:
    if not isinstance(layer, VecNormalize):
        found: Memory = layer.memory()
        return found
    scale = layer.ret_rms
    return {
        "mean": scale.mean, "var": scale.var, "count": scale.count, "returns": layer.returns,
        "old_obs": layer.old_obs,
    }  # fmt: skip


def _put_layer_back(layer: Any, memory: Memory) -> None:
    if not isinstance(layer, VecNormalize):
        layer.remember(memory)
        return
    layer.ret_rms.mean, layer.ret_rms.var = np.float64(memory["mean"]), np.float64(memory["var"])
    layer.ret_rms.count, layer.returns, layer.old_obs = memory["count"], memory["returns"], memory["old_obs"]


def _replay_memory(buffer: Any) -> Memory | None:
    """What a store of past steps holds so far."""
    if buffer is None:
        return None
    filled = buffer.buffer_size if buffer.full else buffer.pos
    held = {name: getattr(buffer, name)[:filled].copy() for name in STORED}
    return {"pos": buffer.pos, "full": buffer.full, **held}


def _put_replay_back(buffer: Any, memory: Memory | None) -> None:
    if buffer is None or memory is None:
        return
    buffer.pos, buffer.full = memory["pos"], memory["full"]
    for name in STORED:
        getattr(buffer, name)[: len(memory[name])] = memory[name]


def _random_memory(agent: Any) -> Memory:
    return {
        "python": random.getstate(),
        "numpy": np.random.get_state(),
        "torch": torch.get_rng_state(),
        "actions": agent.action_space.np_random.bit_generator.state,
    }


def _put_random_back(agent: Any, memory: Memory) -> None:
    random.setstate(memory["python"])
    np.random.set_state(memory["numpy"])
    torch.set_rng_state(memory["torch"])
    agent.action_space.np_random.bit_generator.state = memory["actions"]
