"""State of a training at a rollout's boundary: all that later steps depend on.

Networks and optimisers, the replay buffer, counters, random numbers, scales of the
rewards, and the ships where they are. A run that is restored goes on as if it had never
stopped, bit for bit on the same machine; so checkpoints may be taken at any time
without changing what is learned.
"""

import random
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.save_util import recursive_getattr, recursive_setattr
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize

from agents.training.likeness import check_like, list_of, optional_number

State = dict[str, Any]
#: Arrays of a replay buffer.
STORED = (
    "observations",
    "next_observations",
    "actions",
    "rewards",
    "dones",
    "timeouts",
)
#: Scales of rewards, and the attributes of `VecNormalize` that have them.
SCALES = {
    "mean": "ret_rms.mean",
    "var": "ret_rms.var",
    "count": "ret_rms.count",
    "returns": "returns",
    "old_obs": "old_obs",
}
COUNT = 0  # an integer, for `check_like`
NUMBER = 0.0


def agent_state(agent: Any) -> State:
    """State of an agent of stable-baselines3 and of its ships.

    `agent` is between a rollout and the next, its ships begun. Returns nested values
    for `nested_values.write_values`.
    """
    # Attributes of an agent that count its steps, and what it saw last.
    counters = (
        "num_timesteps",
        "_n_updates",
        "_episode_num",
        "_last_obs",
        "_last_episode_starts",
        "_last_original_obs",
    )
    _, names = agent._get_torch_save_params()
    variables = {name: recursive_getattr(agent, name) for name in names}
    ships = [_layer_state(layer) for layer in _layers(agent.env)]
    replay_buffer = getattr(agent, "replay_buffer", None)
    actions = agent.action_space.np_random
    return {
        "parameters": agent.get_parameters(),
        "variables": variables,
        "counters": {name: getattr(agent, name) for name in counters},
        "episodes": list(agent.ep_info_buffer),
        "successes": [float(success) for success in agent.ep_success_buffer],
        "ships": ships,
        "replay": _replay_state(replay_buffer),
        "random": {
            "python": random.getstate(),
            "numpy": np.random.get_state(),
            "torch": torch.get_rng_state(),
            "actions": actions.bit_generator.state,
        },
    }


def restore_agent(agent: Any, state: State) -> None:
    """Restore the state of an agent of the same plan.

    It goes on by `learn(..., reset_num_timesteps=False)`. Raises ValueError, naming the
    first difference, if the state has other names, kinds or shapes than the agent's
    own, or a number that is infinite or NaN where the agent's own is finite.
    """
    state = _with_own_settings(agent, state)
    check_like(state, _expected_state(agent), "agent")
    parameters = state["parameters"]
    counters = state["counters"]
    check_weights(parameters)
    _check_observations(agent, counters["_last_obs"])

    agent.set_parameters(parameters, exact_match=True, device="cpu")
    for name, value in state["variables"].items():
        variable = recursive_getattr(agent, name)
        variable.data.copy_(value)
    for name, value in counters.items():
        setattr(agent, name, value)
    window = agent._stats_window_size
    agent.ep_info_buffer = deque(state["episodes"], maxlen=window)
    agent.ep_success_buffer = deque(state["successes"], maxlen=window)
    for layer, kept in zip(_layers(agent.env), state["ships"], strict=True):
        _restore_layer(layer, kept)
    if state["replay"] is not None:
        _restore_replay(agent.replay_buffer, state["replay"])
    _restore_random_numbers(agent, state["random"])


def check_weights(parameters: State) -> None:
    """Raise ValueError for weights with which a network's outputs overflow."""
    for part, weights in parameters.items():
        for name, weight in weights.items():
            if not isinstance(weight, torch.Tensor) or not weight.is_floating_point():
                continue
            largest = 20.0 if "log_std" in name else 1e9
            is_small = weight.abs() <= largest
            if not is_small.all():
                raise ValueError(
                    f"parameters.{part}.{name}: expected numbers of magnitude"
                    f" {largest:g} at most"
                )


def _check_observations(agent: Any, observations: Any) -> None:
    if not all(map(agent.observation_space.contains, observations)):
        raise ValueError(
            "counters._last_obs: expected numbers within the bounds of the observations"
        )


def _with_own_settings(agent: Any, state: Any) -> Any:
    """Replace the settings of optimisers by an agent's own, but for learning rates."""
    try:
        parameters = dict(state["parameters"])
        for name, own in agent.get_parameters().items():
            if "param_groups" not in own:
                continue
            kept_groups = parameters[name]["param_groups"]
            groups = []
            for group, kept in zip(own["param_groups"], kept_groups, strict=True):
                groups.append({**group, "lr": kept["lr"]})
            parameters[name] = {**parameters[name], "param_groups": groups}
    except (LookupError, TypeError, ValueError):
        return state  # `check_like` says where it differs
    return {**state, "parameters": parameters}


def _expected_state(agent: Any) -> State:
    """Return a state like those of this agent; its ships begin an episode."""
    agent._last_obs = agent._last_original_obs = agent.env.reset()
    agent._last_episode_starts = np.zeros(agent.n_envs, np.bool_)
    agent.ep_info_buffer = agent.ep_success_buffer = ()
    own = agent_state(agent)
    own["episodes"] = list_of({"r": NUMBER, "l": COUNT, "t": NUMBER})
    own["successes"] = list_of(NUMBER)

    for name, weights in own["parameters"].items():
        if "param_groups" in weights:
            optimizer = recursive_getattr(agent, name)
            weights["state"] = _moments(optimizer)

    replay = own["replay"]
    if replay is not None:
        for name in STORED:
            stored = getattr(agent.replay_buffer, name)
            replay[name] = _as_much_of(stored)

    random_numbers = own["random"]
    version, words, _ = random_numbers["python"]
    random_numbers["python"] = (version, words, optional_number)
    return own


def _moments(optimizer: torch.optim.Optimizer) -> Callable[[Any], dict[int, State]]:
    """Return what Adam keeps of each weight that had a step."""
    moments: dict[int, State] = {}
    for group in optimizer.param_groups:
        for weight in group["params"]:
            moments[len(moments)] = {
                "step": torch.zeros(()),
                "exp_avg": weight.data,
                "exp_avg_sq": weight.data,
            }

    def of_weights_with_a_step(found: Any) -> dict[int, State]:
        if not isinstance(found, dict):
            return moments
        return {number: kept for number, kept in moments.items() if number in found}

    return of_weights_with_a_step


def _as_much_of(stored: Any) -> Callable[[Any], Any]:
    """Return as much of a replay buffer's array as is found."""

    def beginning(found: Any) -> Any:
        length = len(found) if getattr(found, "ndim", 0) else 0
        return stored[:length]

    return beginning


def _layers(env: Any) -> Iterator[Any]:
    """Yield an environment and those inside of it."""
    yield env
    while isinstance(env, VecEnvWrapper):
        env = env.venv
        yield env


def _layer_state(layer: Any) -> State:
    if isinstance(layer, VecNormalize):
        return {name: recursive_getattr(layer, place) for name, place in SCALES.items()}
    return dict(layer.memory())


def _restore_layer(layer: Any, state: State) -> None:
    if not isinstance(layer, VecNormalize):
        layer.remember(state)
        return
    for name, place in SCALES.items():
        recursive_setattr(layer, place, state[name])


def _replay_state(buffer: Any) -> State | None:
    """Return what a replay buffer holds so far."""
    if buffer is None:
        return None
    filled = buffer.buffer_size if buffer.full else buffer.pos
    state = {"pos": buffer.pos, "full": buffer.full}
    for name in STORED:
        stored = getattr(buffer, name)
        state[name] = stored[:filled].copy()
    return state


def _restore_replay(buffer: Any, state: Mapping[str, Any]) -> None:
    position = state["pos"]
    filled = buffer.buffer_size if state["full"] else position
    lengths = {len(state[name]) for name in STORED}
    if position >= buffer.buffer_size or lengths != {filled}:
        texts = [str(length) for length in sorted(lengths)]
        raise ValueError(
            f"agent.replay: expected {filled} steps by its position {position}, got"
            f" {', '.join(texts)}"
        )
    buffer.pos = position
    buffer.full = state["full"]
    for name in STORED:
        stored = getattr(buffer, name)
        stored[:filled] = state[name]


def _restore_random_numbers(agent: Any, state: State) -> None:
    _, key, position, *_ = state["numpy"]
    if position > len(key):  # NumPy would read what lies behind
        raise ValueError(
            f"agent.random.numpy: expected a position of at most {len(key)}, got"
            f" {position}"
        )
    try:
        random.setstate(state["python"])
        np.random.set_state(state["numpy"])
        torch.set_rng_state(state["torch"])
        agent.action_space.np_random.bit_generator.state = state["actions"]
    except (OverflowError, RuntimeError) as error:
        raise ValueError(f"agent.random: {error}") from None
