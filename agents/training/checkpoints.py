"""All of a training that the steps to come depend on: taken at a rollout's boundary, and put back.

Networks and optimisers, the store of past steps, counters, random numbers, scales of
the rewards, and the ships where they are. A run that is put back goes on as if it had
never stopped, bit for bit on the same machine; so checkpoints may be taken at any time
without changing what is learned.
"""

import random
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.save_util import recursive_getattr, recursive_setattr
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
WHOLE, REAL = 0, 0.0  # what numbers of a kind are like
STORED = (
    "observations",
    "next_observations",
    "actions",
    "rewards",
    "dones",
    "timeouts",
)
#: What is kept of the scales of rewards, and where they have it.
SCALES = {
    "mean": "ret_rms.mean",
    "var": "ret_rms.var",
    "count": "ret_rms.count",
    "returns": "returns",
    "old_obs": "old_obs",
}


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
        "random": {
            "python": random.getstate(),
            "numpy": np.random.get_state(),
            "torch": torch.get_rng_state(),
            "actions": agent.action_space.np_random.bit_generator.state,
        },
    }


def put_back(agent: Any, memory: Memory) -> None:
    """Let an agent made alike go on from what `take` gave, by `learn(..., reset_num_timesteps=False)`.

    Raises ValueError, naming the first difference, if that has other names, kinds or
    shapes than the agent's own, or a number that is infinite or NaN where the agent's
    own is finite.
    """
    memory = _with_own_settings(agent, memory)
    check_like(memory, _own(agent), "agent")
    _check_weights(memory["parameters"])
    if not all(map(agent.observation_space.contains, memory["counters"]["_last_obs"])):
        raise ValueError(
            "counters._last_obs: expected numbers within the bounds of the observations"
        )
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
                place = f"parameters.{part}.{name}"
                if not bool((one.abs() <= most).all()):
                    raise ValueError(
                        f"{place}: expected numbers of magnitude {most:g} at most"
                    )


def check_record(record: Any) -> None:
    """Raise ValueError, naming the place, unless this is what a training tells of its evaluations."""
    row: Memory = {"steps": WHOLE, "seconds": REAL, "cost": REAL, "mean_return": _maybe}
    own = {
        "best_cost": _maybe,
        "best_steps": WHOLE,
        "curve": _every(row),
        "seconds": REAL,
    }
    check_like(record, own, "run")


def _maybe(found: Any) -> float | None:
    """What is expected where a number or none may stand."""
    return None if found is None else REAL


def _every(one: Any) -> Callable[[Any], list[Any]]:
    """A list of any length, each entry like this one."""
    return lambda found: [one] * (len(found) if isinstance(found, list) else 0)


def _with_own_settings(agent: Any, memory: Any) -> Any:
    """A memory with an agent's own settings of optimisers; of the memory's only learning rates are taken."""
    try:
        taken = dict(memory["parameters"])
        for name, own in agent.get_parameters().items():
            if "param_groups" in own:
                pairs = zip(
                    own["param_groups"], taken[name]["param_groups"], strict=True
                )
                groups = [group | {"lr": found["lr"]} for group, found in pairs]
                taken[name] = {**taken[name], "param_groups": groups}
        return {**memory, "parameters": taken}
    except (LookupError, TypeError, ValueError):  # `check_like` says where
        return memory


def _own(agent: Any) -> Memory:
    """What a memory of this agent is like; its ships begin an episode."""
    agent._last_obs = agent._last_original_obs = agent.env.reset()
    agent._last_episode_starts = np.zeros(agent.n_envs, np.bool_)
    agent.ep_info_buffer = agent.ep_success_buffer = ()
    own = take(agent)
    own["episodes"], own["successes"] = (
        _every({"r": REAL, "l": WHOLE, "t": REAL}),
        _every(REAL),
    )
    for name, one in own["parameters"].items():
        if "param_groups" in one:
            groups = recursive_getattr(agent, name).param_groups
            one["state"] = _moments(
                [weight.data for group in groups for weight in group["params"]]
            )
    for name in STORED if own["replay"] else ():
        own["replay"][name] = _beginning(getattr(agent.replay_buffer, name))
    own["random"]["python"] = (*own["random"]["python"][:2], _maybe)
    return own


def _moments(weights: list[torch.Tensor]) -> Callable[[Any], dict[int, Memory]]:
    """What an optimiser, Adam, keeps of each weight that had a step."""
    kept = [
        {"step": torch.zeros(()), "exp_avg": one, "exp_avg_sq": one} for one in weights
    ]
    return lambda found: {
        k: one
        for k, one in enumerate(kept)
        if not isinstance(found, dict) or k in found
    }


def _beginning(stored: Any) -> Callable[[Any], Any]:
    """As much of a store of past steps as is found."""
    return lambda found: stored[: len(found) if getattr(found, "ndim", 0) else 0]


def _layers(env: Any) -> list[Any]:
    """An environment and those inside of it."""
    layers = [env]
    while isinstance(layers[-1], VecEnvWrapper):
        layers.append(layers[-1].venv)
    return layers


def _layer_memory(layer: Any) -> Memory:
    if isinstance(layer, VecNormalize):
        return {name: recursive_getattr(layer, place) for name, place in SCALES.items()}
    return dict(layer.memory())


def _put_layer_back(layer: Any, memory: Memory) -> None:
    if isinstance(layer, VecNormalize):
        for name, place in SCALES.items():
            recursive_setattr(layer, place, memory[name])
    else:
        layer.remember(memory)


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
    if memory["pos"] >= buffer.buffer_size or any(
        len(memory[name]) != filled for name in STORED
    ):
        raise ValueError(
            f"agent.replay: not the {filled} steps that its position {memory['pos']}"
            " says"
        )
    buffer.pos, buffer.full = memory["pos"], memory["full"]
    for name in STORED:
        getattr(buffer, name)[: len(memory[name])] = memory[name]


def _put_random_back(agent: Any, memory: Memory) -> None:
    _, key, position, *_ = memory["numpy"]
    if position > len(key):  # NumPy would read what lies behind
        raise ValueError(
            f"agent.random.numpy: position {position} found, expected at most"
            f" {len(key)}"
        )
    try:
        random.setstate(memory["python"])
        np.random.set_state(memory["numpy"])
        torch.set_rng_state(memory["torch"])
        agent.action_space.np_random.bit_generator.state = memory["actions"]
    except (OverflowError, RuntimeError) as error:
        raise ValueError(f"agent.random: {error}") from None
