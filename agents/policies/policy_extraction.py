"""Fields of a `LearnedPolicy` from a trained agent of stable-baselines3.

PPO and A2C have the mean of their action, SAC and TQC the hyperbolic tangent of it, TD3
and DDPG a network that ends so, DQN the value of each discrete order. An agent that
commands otherwise than these layers, as one with an extractor of features does, is
refused.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.controllers.interface import model_hash
from agents.policies.network import Layer, Network
from shipgym import InputError
from shipgym.envs.environment import PACE
from shipgym.envs.episode import as_json
from shipgym.envs.pace import NO_LIMIT, Pace
from shipgym.envs.registration import env_id
from shipgym.tasks.definition import TASKS


class Actor(NamedTuple):
    """Names of the layers that act in a policy of stable-baselines3."""

    body: str  # hidden layers
    head: str  # last layer; empty where it is the last of the body
    output: str  # what follows it
    activation: str  # usual one between the layers


#: Of PPO and A2C; SAC and TQC; TD3 and DDPG; DQN.
ACTORS = (
    Actor("mlp_extractor.policy_net", "action_net", "linear", "Tanh"),
    Actor("actor.latent_pi", "actor.mu", "tanh", "ReLU"),
    Actor("actor.mu", "", "tanh", "ReLU"),
    Actor("q_net.q_net", "", "linear", "ReLU"),
)
#: Wrappers that change observations.
REFUSED = ("VecFrameStack", "VecTransposeImage", "VecExtractDictObs")


def sb3_fields(agent: Any, env: Any = None) -> dict[str, Any]:
    """Fields of `LearnedPolicy` from an agent and its environment.

    `agent`: PPO, A2C, SAC, TD3, DDPG, TQC or DQN with "MlpPolicy"; `env`: the
    environment that it learned in, with its wrappers; by default the agent's own.
    Raises InputError for an agent or a wrapper that cannot be written as a learned
    policy.
    """
    outermost = agent.get_env() if env is None else env
    if outermost is None:
        raise InputError(
            "env: expected the environment that the agent learned in, got none; give it"
            " with env="
        )
    stack = list(_stack(outermost))
    for wrapper in stack:
        _check_wrapper(wrapper)
    learned_in = _environment(stack[-1])

    network = _network(agent)
    _check_extraction(network, agent, learned_in["action"])
    return {
        "network": network,
        **learned_in,
        **(_residual(stack) or _paced(stack[-1].pace, learned_in["action"])),
    }


def _stack(env: Any) -> Iterator[Any]:
    """Environment and what it wraps, down to the ships."""
    while env is not None:
        yield env
        attributes = vars(env)
        inner = attributes.get("vector_env")  # of ShipVecEnv
        if "envs" in attributes:  # of DummyVecEnv
            inner = env.envs[0]
        env = attributes.get("venv", attributes.get("env", inner))


def _check_wrapper(wrapper: Any) -> None:
    """Refuse a wrapper that changes observations or actions."""
    name = type(wrapper).__name__
    scales = name == "VecNormalize" and wrapper.norm_obs
    changing = gymnasium.ObservationWrapper | gymnasium.ActionWrapper
    if scales or name in REFUSED or isinstance(wrapper, changing):
        raise InputError(
            "env: expected no wrapper that changes observations or actions but"
            " ResidualVecEnv, whose frame_stack shows past ones, and VecNormalize with"
            f" norm_obs=False, got {name}"
        )


def _residual(stack: Sequence[Any]) -> dict[str, Any]:
    """Base and other settings of the wrapper that adds to a controller, if any."""
    names = ("authority", "action_repeat", "rate_limit")
    for wrapper in stack:
        if not vars(wrapper).keys() >= {"base", *names}:
            continue
        if not isinstance(wrapper.base, Controller):
            raise InputError(
                "base: expected a controller of shipgym, which a file can hold, got"
                f" {type(wrapper.base).__name__}"
            )
        return {name: getattr(wrapper, name) for name in ("base", *names)}
    return {}


def _paced(pace: Pace, action: str) -> dict[str, Any]:
    """Settings of a policy that learned among ships of a pace."""
    limit = pace.rate_limit
    if pace.frame_stack > 1 and pace.action_repeat > 1:
        raise InputError(
            "env: a learned policy stacks the observations of control intervals:"
            f" expected frame_stack or action_repeat, got both, {pace}"
        )
    if limit is not None and "shaft" in action:
        raise InputError(
            f"env: expected no rate_limit with action {action!r}, got {limit:g}: a"
            " learned policy limits the rudder's rate alone"
        )
    return {
        "frame_stack": pace.frame_stack,
        "action_repeat": pace.action_repeat,
        "rate_limit": NO_LIMIT if limit is None else min(float(limit), NO_LIMIT),
    }


def _environment(ships: Any) -> dict[str, Any]:
    """Observations, action and environment of a policy, by keyword."""
    if not hasattr(ships, "observation_names"):
        raise InputError(
            "env: expected an environment of shipgym, such as ShipVecEnv, got"
            f" {type(ships).__name__}"
        )
    names = tuple(ships.observation_names)
    task = "PathFollowing" if "cross_track" in names else "CourseKeeping"
    if "others_0_dcpa" in names:
        task = "Encounter"
    name_of_env, options = env_id(task), {}
    if ships.spec is not None:
        name_of_env = ships.spec.id
        options = _options(ships.spec.kwargs)

    return {
        "observation_names": names,
        "observation_scales": tuple(float(scale) for scale in ships.observation_scales),
        "action": ships.task.action,
        "env_id": name_of_env,
        "env_options": options,
        "model_name": ships.model.name,
        "model_sha256": model_hash(ships.model),
    }


def _options(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Keywords that say what is asked of the ships, as JSON has them."""
    # Keywords of a vector environment that say how it runs, not what is asked.
    running = (
        "model",
        "num_envs",
        "autoreset_mode",
        "vectorization_mode",
        "render_mode",
        *PACE,  # the policy's own
    )
    return {
        name: as_json(value)
        for name, value in keywords.items()
        if name not in running and not (name == "task" and value in TASKS)
    }


def _network(agent: Any) -> Network:
    """Layers from observation to command."""
    policy = agent.policy
    modules = dict(policy.named_modules())
    actor = next((one for one in ACTORS if one.body in modules), None)
    if actor is None:
        raise InputError(
            "agent: expected PPO, A2C, SAC, TD3, DDPG, TQC or DQN with 'MlpPolicy', got"
            f" {type(agent).__name__} with {type(policy).__name__}"
        )
    activation = getattr(policy, "activation_fn", None)
    between = getattr(activation, "__name__", actor.activation)
    dense = [one for one in modules[actor.body].modules() if hasattr(one, "weight")]
    if actor.head:
        dense.append(modules[actor.head])
    layers = tuple(Layer(_array(one.weight), _array(one.bias)) for one in dense)
    return Network(layers, between.lower(), actor.output)


def _array(parameter: Any) -> NDArray[np.float32]:
    numbers = parameter.detach().cpu().numpy()
    return np.array(numbers, dtype=np.float32, order="C")


def _check_extraction(network: Network, agent: Any, action: str) -> None:
    """Refuse a network that differs from its agent at random observations."""
    shape = agent.observation_space.shape
    drawn = np.random.default_rng(0).uniform(-1.0, 1.0, (16, *shape))
    shown = drawn.astype(np.float32)
    commands, _ = agent.predict(shown, deterministic=True)
    agrees = np.prod(shape) == network.sizes[0]
    if agrees:
        output = network(shown.reshape(len(shown), -1))
        if action == "rudder-discrete":
            agrees = np.array_equal(output.argmax(axis=-1), commands)
        else:
            agrees = np.abs(np.clip(output, -1.0, 1.0) - commands).max() < 1e-5
    if not agrees:
        raise InputError(
            "agent: expected 'MlpPolicy' with actions in [-1, 1], got"
            f" {type(agent.policy).__name__}, which commands otherwise than its layers"
        )
