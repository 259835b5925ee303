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
    check_like(memory, _own(agent, memory), "agent")
    parameters = {
        name: _with_rates(memory["parameters"][name], own) for name, own in agent.get_parameters().items()
    }
    agent.set_parameters(parameters, exact_match=True, device="cpu")
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


def check_record(record: Any) -> None:
    """Raise ValueError, naming the place, unless this is what a training tells of its evaluations."""
    row: Memory = {"steps": 0, "seconds": 0.0, "cost": 0.0}
    curve = [row | {"mean_return": _number(one, "mean_return")} for one in _list(record, "curve")]
    own = {"best_cost": _number(record, "best_cost"), "best_steps": 0, "curve": curve, "seconds": 0.0}
    check_like(record, own, "run")


def _own(agent: Any, memory: Any) -> Memory:
    """What a memory of this agent is like, its lists as long as those of one; ships begin an episode."""
    seen, drawn = agent.env.reset(), _random_memory(agent)
    shown = {"_last_obs": seen, "_last_original_obs": seen, "_last_episode_starts": np.zeros(len(seen), bool)}
    buffer, steps = getattr(agent, "replay_buffer", None), len(_list(memory, "replay", "dones"))
    names = agent._get_torch_save_params()[1]
    return {
        "parameters": {
            name: _own_parameters(own, agent, name, memory) for name, own in agent.get_parameters().items()
        },
        "variables": {name: recursive_getattr(agent, name) for name in names},
        "counters": dict.fromkeys(COUNTERS, 0) | shown,
        "episodes": [{"r": 0.0, "l": 0, "t": 0.0} for _ in _list(memory, "episodes")],
        "successes": [0.0 for _ in _list(memory, "successes")],
        "ships": [_layer_memory(layer) for layer in _layers(agent.env)],
        "replay": buffer and {"pos": 0, "full": False} | {n: getattr(buffer, n)[:steps] for n in STORED},
        "random": drawn | {"python": (*drawn["python"][:2], _number(memory, "random", "python", 2))},
    }


def _own_parameters(own: Memory, agent: Any, name: str, memory: Any) -> Memory:
    """Parameters of a network as they are; of an optimiser what Adam keeps of weights that had a step."""
    if "param_groups" not in own:
        return own
    state, groups = (_at(memory, "parameters", name, key) for key in ("state", "param_groups"))
    weights = [one.data for group in recursive_getattr(agent, name).param_groups for one in group["params"]]
    moments = {
        i: {"step": torch.zeros(()), "exp_avg": one, "exp_avg_sq": one} for i, one in enumerate(weights)
    }
    rated = len(_list(groups)) == len(own["param_groups"]) and all(
        type(_at(one, "lr")) is float for one in groups
    )
    return {
        "state": {i: one for i, one in moments.items() if not isinstance(state, dict) or i in state},
        "param_groups": groups if rated else own["param_groups"],  # of these only the rates are put back
    }


def _at(value: Any, *path: Any) -> Any:
    """What stands in a place within a value of any kind; None if there is no such place."""
    for key in path:
        try:
            value = value[key]
        except (LookupError, TypeError):
            return None
    return value


def _list(value: Any, *path: Any) -> Any:
    found = _at(value, *path)
    return found if isinstance(found, list | np.ndarray) else []


def _number(value: Any, *path: Any) -> float | None:
    """What is expected where a number or none may stand."""
    return None if _at(value, *path) is None else 0.0


def _with_rates(found: Memory, own: Memory) -> Memory:
    """Parameters of a memory; of an optimiser's settings only the learning rates are the memory's."""
    if "param_groups" not in own:
        return found
    pairs = zip(own["param_groups"], found["param_groups"], strict=True)
    return {**found, "param_groups": [group | {"lr": given["lr"]} for group, given in pairs]}


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
