"""The network of a trained agent of stable-baselines3, and what it observed, as fields of a `LearnedPolicy`.

PPO and A2C have the mean of their action, SAC and TQC the hyperbolic tangent of it, TD3
and DDPG a network that ends so. Whatever else is found (other extractors of features,
layers or wrappers) is refused, not guessed.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, count, takewhile
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller, model_hash
from agents.policies.network import Network
from agents.policies.weights_file import as_json
from shipgym import InputError
from shipgym.checks import quoted
from shipgym.envs.registration import env_id
from shipgym.tasks.definition import TASKS

#: What acts in a policy: its hidden layers, the last one where it stands apart, what
#: follows that, and the usual activation; PPO and A2C, SAC and TQC, TD3 and DDPG.
ACTORS = (
    ("mlp_extractor.policy_net", "action_net", "linear", "Tanh"),
    ("actor.latent_pi", "actor.mu", "tanh", "ReLU"),
    ("actor.mu", "", "tanh", "ReLU"),
)
NOT_ACTING = (
    "mlp_extractor.value_net.",
    "value_net.",
    "log_std",
    "actor.log_std.",
    "actor_target.",
    "critic",
)
DENSE = "dense layers with ReLU or Tanh between them"
SDE = "state-dependent exploration (use_sde) found, expected an agent without"
ACTIVATION_OF = {"ReLU": "relu", "Tanh": "tanh"}
#: Keywords of a vector environment that say how it runs, not what is asked.
RUNNING = (
    "model",
    "num_envs",
    "threads",
    "autoreset_mode",
    "vectorization_mode",
    "render_mode",
)
#: Wrappers that change observations.
REFUSED = ("VecFrameStack", "VecTransposeImage", "VecExtractDictObs")
#: What the wrapper has that adds to a controller.
RESIDUAL = {
    "authority": float,
    "frame_stack": int,
    "action_repeat": int,
    "rate_limit": float,
}
N_COMPARED = 16
AGREEMENT = 1e-4  # of the commands found with torch and without, far above rounding


def sb3_fields(agent: Any, env: Any = None) -> dict[str, Any]:
    """Fields of `LearnedPolicy` from an agent and its environment.

    `agent`: PPO, A2C, SAC, TD3, DDPG or TQC with "MlpPolicy"; `env`: the environment
    that it learned in, with its wrappers; by default the agent's own. Raises InputError
    for an agent or a wrapper that cannot be written as a learned policy.
    """
    given = agent.get_env() if env is None else env
    if given is None:
        raise InputError(
            "env: none found and the agent has none, expected the environment it"
            " learned in"
        )
    stack = list(_stack(given))
    _check_wrappers(stack)
    found = {**_environment(stack[-1]), **_residual(stack)}
    network = _network(agent)
    _check_extraction(network, agent, found["action"])
    return {"network": network, **found}


def _stack(env: Any) -> Iterator[Any]:
    """The environment and what it wraps, down to the ships."""
    while env is not None:
        yield env
        held = vars(env)
        inner = held.get("vector_env")  # of ShipVecEnv
        if "envs" in held:  # of DummyVecEnv
            inner = env.envs[0]
        env = held.get("venv", held.get("env", inner))


def _check_wrappers(stack: Sequence[Any]) -> None:
    for wrapper in stack:
        name = type(wrapper).__name__
        if name == "VecNormalize" and wrapper.norm_obs:
            raise InputError(
                "env: VecNormalize that scales observations found, expected"
                " VecNormalize(norm_obs=False): the environments scale them already"
            )
        if name in REFUSED or isinstance(
            wrapper, gymnasium.ObservationWrapper | gymnasium.ActionWrapper
        ):
            raise InputError(
                f"env: wrapper {name} found, expected none that changes observations or"
                " actions but ResidualVecEnv, whose frame_stack shows past ones"
            )


def _residual(stack: Sequence[Any]) -> dict[str, Any]:
    """History, base and authority of the wrapper that adds to a controller, if there is one."""
    for wrapper in stack:
        if vars(wrapper).keys() >= {"base", *RESIDUAL}:
            base = wrapper.base
            if base is not None and not isinstance(base, Controller):
                raise InputError(
                    f"base: {type(base).__name__} found, expected a controller of"
                    " shipgym, which a file can hold"
                )
            return {
                "base": base,
                **{
                    name: kind(getattr(wrapper, name))
                    for name, kind in RESIDUAL.items()
                },
            }
    return {}


def _environment(ships: Any) -> dict[str, Any]:
    """What is observed and commanded, and where."""
    if not hasattr(ships, "observation_names"):
        raise InputError(
            f"env: {type(ships).__name__} found, expected an environment of shipgym,"
            " such as ShipVecEnv"
        )
    model, spec = ships.model, ships.spec
    kwargs = dict(spec.kwargs) if spec is not None else {}
    return {
        "observation_names": tuple(ships.observation_names),
        "observation_scales": tuple(float(scale) for scale in ships.observation_scales),
        "action": ships.task.action,
        "env_id": (
            env_id(task_showing(ships.observation_names)) if spec is None else spec.id
        ),
        "env_options": {
            name: as_json(value)
            for name, value in kwargs.items()
            if name not in RUNNING and not (name == "task" and value in TASKS)
        },
        "model_name": model.name,
        "model_sha256": model_hash(model),
    }


def task_showing(names: Sequence[str]) -> str:
    """The task of the package that shows these quantities."""
    return "PathFollowing" if "cross_track" in names else "CourseKeeping"


def _network(agent: Any) -> Network:
    """The layers from observation to command."""
    policy = agent.policy
    actor: Any = getattr(policy, "actor", None)
    name = type(
        getattr(policy if actor is None else actor, "features_extractor", None)
    ).__name__
    if name not in ("FlattenExtractor", "NoneType"):
        raise InputError(
            f"agent: features extractor {name} found, expected none: use 'MlpPolicy' as"
            " it is"
        )
    if getattr(agent, "use_sde", False):
        raise InputError(f"agent: {SDE}")
    what = f"{type(agent).__name__} with {type(policy).__name__}"
    activation = getattr(getattr(policy, "activation_fn", None), "__name__", None)
    return actor_network(policy.state_dict(), activation, what)


def actor_network(
    weights: Mapping[str, Any], activation: str | None, what: str
) -> Network:
    """The network that commands, of the tensors of a policy by name.

    `activation`: torch's class between the layers, by default the algorithm's own;
    `what`: whose they are. Raises InputError for those of another algorithm, and for
    what is no dense layer.
    """
    found = [one for one in ACTORS if f"{one[1] or one[0] + '.0'}.weight" in weights]
    if not found:
        raise InputError(
            f"agent: {what} found, expected PPO, A2C, SAC, TD3, DDPG or TQC with"
            " 'MlpPolicy'"
        )
    body, head, output, own = found[0]
    if (between := activation or own) not in ACTIVATION_OF:
        raise InputError(
            f"agent: layer 1 of the network is {between}, expected {DENSE}"
        )
    hidden = takewhile(
        lambda layer: f"{layer}.weight" in weights, (f"{body}.{2 * i}" for i in count())
    )
    layers = [
        (f"{layer}.weight", f"{layer}.bias")
        for layer in (*hidden, *filter(None, [head]))
    ]
    odd = set(chain(*layers)) ^ {
        name for name in weights if not name.startswith(NOT_ACTING)
    }
    if odd:
        raise InputError(
            f"agent: weights {quoted(sorted(odd))} missing or not known, expected"
            f" {DENSE}"
        )
    pairs = tuple(
        (_array(weights[weight]), _array(weights[bias])) for weight, bias in layers
    )
    return Network(pairs, ACTIVATION_OF[between], output)


def _array(parameter: Any) -> NDArray[np.float32]:
    return np.ascontiguousarray(
        parameter.detach().cpu().numpy(), dtype=np.float32
    ).copy()


def _check_extraction(network: Network, agent: Any, action: str) -> None:
    """The network must command what the agent does, on observations at random."""
    inputs = (
        np.random.default_rng(0)
        .uniform(-1.0, 1.0, (N_COMPARED, network.sizes[0]))
        .astype(np.float32)
    )
    if agent.observation_space.shape != inputs.shape[1:]:
        raise InputError(
            f"agent: observations of shape {agent.observation_space.shape} found,"
            f" expected {inputs.shape[1:]}, as its network has inputs"
        )
    theirs, _ = agent.predict(inputs, deterministic=True)
    output = network(inputs)
    if action == "rudder-discrete":
        agrees = bool((output.argmax(axis=-1) == theirs).all())
    else:
        agrees = bool(np.abs(np.clip(output, -1.0, 1.0) - theirs).max() < AGREEMENT)
    if not agrees:
        raise InputError(
            f"agent: {type(agent.policy).__name__} gives other commands than its layers"
            " do, expected 'MlpPolicy' with actions in [-1, 1]"
        )
