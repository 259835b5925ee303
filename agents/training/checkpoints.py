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

from agents.training.safe_file import check_like

Memory = dict[str, Any]
COUNTERS = (
    "num_timesteps",
    "_n_updates",
    "_episode_num",
    "_last_obs",
    "_last_episode_starts",
    "_last_original_obs",
)
LARGEST_WEIGHT, LARGEST_LOG_STD = 1e9, 20.0
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
    """Let an agent made alike go on from what `take` gave, by `learn(..., reset_num_timesteps=False)`.

    Raises ValueError, naming the first difference, if that has other names, kinds or shapes than the agent's
    own.
    """
    memory = _with_own_settings(agent, memory)
    check_like(memory, _own(agent, memory), "agent")
    _check_weights(memory["parameters"])
    _check_observed(agent, memory["counters"]["_last_obs"])
    for number, kept in enumerate(memory["ships"]):
        if not np.isfinite(kept.get("states", 0.0)).all():  # positions, velocities, orders and what is asked
            raise ValueError(f"agent.ships[{number}].states: expected finite numbers")
    agent.set_parameters(memory["parameters"], exact_match=True, device="cpu")
    for name, value in memory["variables"].items():
        recursive_getattr(agent, name).data.copy_(value)
    for name, value in memory["counters"].items():
        setattr(agent, name, value)
    window = agent._stats_window_size
    agent.ep_info_buffer = deque(memory["episodes"], maxlen=window)
    agent.ep_success_buffer = deque(memory["successes"], maxlen=window)
    for layer, kept in zip(_layers(agent.env), memory["ships"], strict=True):
        _put_layer_back(layer, kept)
    _put_replay_back(getattr(agent, "replay_buffer", None), memory["replay"])
    _put_random_back(agent, memory["random"])


def _check_weights(parameters: Memory) -> None:
    """Raise ValueError, naming the place, for weights with which a network's outputs overflow."""
    for part, weights in parameters.items():
        for name, one in weights.items():
            if isinstance(one, torch.Tensor) and one.is_floating_point():
                most = LARGEST_LOG_STD if "log_std" in name else LARGEST_WEIGHT
                if not bool((one.abs() <= most).all()):
                    raise ValueError(
                        f"parameters.{part}.{name}: expected numbers of magnitude {most:g} at most"
                    )


def _check_observed(agent: Any, observed: Any) -> None:
    """Raise ValueError for what an environment of the agent does not show."""
    for row in observed:
        if not agent.observation_space.contains(row):
            raise ValueError("counters._last_obs: expected numbers within the bounds of the observations")


def check_record(record: Any) -> None:
    """Raise ValueError, naming the place, unless this is what a training tells of its evaluations."""
    row: Memory = {"steps": 0, "seconds": 0.0, "cost": 0.0}
    curve = [row | {"mean_return": _number(one, "mean_return")} for one in _list(record, "curve")]
    own = {"best_cost": _number(record, "best_cost"), "best_steps": 0, "curve": curve, "seconds": 0.0}
    check_like(record, own, "run")


def _with_own_settings(agent: Any, memory: Any) -> Any:
    """A memory with an agent's own settings of optimisers; of the memory's only learning rates are taken."""
    if not isinstance(parameters := _at(memory, "parameters"), dict):
        return memory
    taken = dict(parameters)
    for name, own in agent.get_parameters().items():
        if "param_groups" in own and isinstance(found := parameters.get(name), dict):
            rates = [_at(group, "lr") for group in _list(found, "param_groups")]
            pairs = zip(own["param_groups"], rates, strict=False)
            taken[name] = {**found, "param_groups": [group | {"lr": rate} for group, rate in pairs]}
    return {**memory, "parameters": taken}


def _own(agent: Any, memory: Any) -> Memory:
    """What a memory of this agent is like, its lists as long as those of one; ships begin an episode."""
    agent._last_obs = agent._last_original_obs = agent.env.reset()
    agent._last_episode_starts = np.zeros(agent.n_envs, np.bool_)
    agent.ep_info_buffer = [{"r": 0.0, "l": 0, "t": 0.0} for _ in _list(memory, "episodes")]
    agent.ep_success_buffer = [0.0 for _ in _list(memory, "successes")]
    own = take(agent)
    for name, one in own["parameters"].items():
        if "param_groups" in one:  # an optimiser: Adam keeps this of each weight that had a step
            groups, known = (
                recursive_getattr(agent, name).param_groups,
                _at(memory, "parameters", name, "state"),
            )
            moments = enumerate(weight.data for group in groups for weight in group["params"])
            one["state"] = {
                number: {"step": torch.zeros(()), "exp_avg": weight, "exp_avg_sq": weight}
                for number, weight in moments
                if not isinstance(known, dict) or number in known
            }
    for name in STORED if own["replay"] else ():
        own["replay"][name] = getattr(agent.replay_buffer, name)[: len(_list(memory, "replay", name))]
    own["random"]["python"] = (*own["random"]["python"][:2], _number(memory, "random", "python", 2))
    return own


def _at(value: Any, *path: Any) -> Any:
    """What stands in a place within a value of any kind; None if there is no such place."""
    for key in path:
        try:
            value = value[key]
        except (LookupError, TypeError):
            return None
    return value


def _list(value: Any, *path: Any) -> Any:
    """A list, or an array of rows, in such a place; an empty one for anything else."""
    found = _at(value, *path)
    return found if getattr(found, "ndim", isinstance(found, list)) else []


def _number(value: Any, *path: Any) -> float | None:
    """What is expected where a number or none may stand."""
    return None if _at(value, *path) is None else 0.0


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
    filled = buffer.buffer_size if memory["full"] else memory["pos"]
    if memory["pos"] >= buffer.buffer_size or any(len(memory[name]) != filled for name in STORED):
        raise ValueError(f"agent.replay: not the {filled} steps that its position {memory['pos']} says")
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
    _, key, position, *_ = memory["numpy"]
    if position > len(key):  # NumPy would read what lies behind
        raise ValueError(f"agent.random.numpy: position {position} found, expected at most {len(key)}")
    try:
        random.setstate(memory["python"])
        np.random.set_state(memory["numpy"])
        torch.set_rng_state(memory["torch"])
        agent.action_space.np_random.bit_generator.state = memory["actions"]
    except (OverflowError, RuntimeError) as error:
        raise ValueError(f"agent.random: {error}") from None
