"""Controllers and learned policies as C99: laws translated, networks as tables."""

from itertools import repeat
from typing import Any

from agents.controllers.controller import Controller
from agents.controllers.guided import Guided
from agents.controllers.law import Nothing
from agents.controllers.memory import from_columns
from agents.controllers.registry import controller_class, controller_kinds
from agents.export.autopilot import (
    AUTOPILOT_INPUTS,
    AUTOPILOT_OUTPUTS,
    BridgeInput,
    BridgeParameters,
    BridgeState,
    OwnObservations,
    base_path_step,
    bridge_parameters,
    heading_step,
    limited,
    needed_inputs,
    observation_bounds,
    path_step,
    policy_observations,
)
from agents.export.c_structures import leaf_paths
from agents.export.c_syntax import comment
from agents.export.source import Source, c_source, checked_name, hash_text, render
from agents.export.translator import Translated, Translator
from agents.policies.policy import ORDERS, LearnedPolicy, combined
from shipgym import InputError
from shipgym.checks import quoted
from shipgym.envs.pace import toward

NO_INPUT = BridgeInput(0.0, 0.0)


def autopilot_source(agent: Any, name: str | None = None) -> Source:
    """Write a controller or a learned policy as C99.

    The integral of the heading error is part of it. Raises InputError for a controller
    that does not steer by its `law` alone, for a law of more than can be translated,
    and for a name that C does not take.
    """
    inputs = {name: AUTOPILOT_INPUTS[name] for name in needed_inputs(agent)}
    p = bridge_parameters(agent)
    name = checked_name(name or agent.name)
    c = Translator({}, name)
    data_of = policy_data if isinstance(agent, LearnedPolicy) else controller_data
    data = data_of(c, agent, p)
    title = f"Autopilot '{agent.name}' for model '{agent.model_name}'"
    data |= {
        "title": comment(title),
        "sha256": hash_text(agent.model_sha256),
        "inputs": inputs,
        "interval": p.dt,
        "limit": p.limit,
        "given_type": c.structures.type(c.structures.kind_of(NO_INPUT)),
        "structures": c.structures.texts,
        "functions": c.functions,
    }
    return Source(
        name=name,
        header=render("autopilot.h.j2", name, **data),
        source=c_source("autopilot.c.j2", name, **data),
        inputs=inputs,
        outputs=AUTOPILOT_OUTPUTS,
        step=p.dt,
        ship=False,
        title=title,
        sha256=data["sha256"],
    )


def controller_data(c: Translator, agent: Any, p: BridgeParameters) -> dict[str, Any]:
    """Data of the templates for a controller."""
    structures = c.structures
    state = first_state(agent)
    header = structures.declared(own=state, parameters=p)
    step = steering_step(c, agent, state, p, path_step)
    return {
        "policy": None,
        "state_structures": header,
        "state_paths": list(leaf_paths(state, "own.")),
        "step": step.name,
        "step_type": structures.type(step.returns),
        "parameters": structures.initialiser(p),
    }


def policy_data(
    c: Translator, policy: LearnedPolicy, p: BridgeParameters
) -> dict[str, Any]:
    """Data of the templates for a learned policy, with or without a base."""
    structures = c.structures
    own = bridge_state(Nothing, Nothing)
    states = {"own": own}
    if policy.base is not None:
        states["base"] = first_state(policy.base)
    header = structures.declared(**states, parameters=p)

    observe = c.function(policy_observations, NO_INPUT, own, p)
    finish = c.function(limited, 0.0, own, p)
    state_paths: list[str] = []
    for name, state in states.items():
        state_paths += leaf_paths(state, f"{name}.")
    data = {
        "policy": policy,
        "state_structures": header,
        "has_base": policy.base is not None,
        "state_paths": state_paths,
        "observe": observe.name,
        "observe_type": structures.type(observe.returns),
        "own_observations_type": structures.type(observe.returns.kinds[0]),
        "finish": finish.name,
        "step_type": structures.type(finish.returns),
        "rows": observation_rows(policy),
        "activations": layer_activations(policy),
        "orders": ORDERS,
        "parameters": structures.initialiser(p),
    }
    if policy.action != "rudder-discrete":
        data["toward"] = c.function(toward, 0.0, 0.0, 0.0).name
    if policy.base is not None:
        step = steering_step(c, policy.base, states["base"], p, base_path_step)
        data["combined"] = c.function(combined, 0.0, 0.0, 0.0).name
        data["base_step"] = step.name
        data["base_step_type"] = structures.type(step.returns)
    return data


def steering_step(
    c: Translator, agent: Any, state: BridgeState, p: BridgeParameters, along_path: Any
) -> Translated:
    """Write one step of a controller, of guidance the function `along_path`."""
    law = agent.law
    if not isinstance(agent, Guided):
        return c.function(heading_step, NO_INPUT, state, p, law)
    pilot: Any = agent.autopilot
    return c.function(along_path, NO_INPUT, state, p, law, pilot.law)


def first_state(agent: Any) -> BridgeState:
    """Memory of a controller at the beginning; InputError without a law for C."""
    check_closed_form(agent)
    if not isinstance(agent, Guided):
        return bridge_state(agent.memory_record, Nothing)
    pilot: Any = agent.autopilot
    check_closed_form(pilot)
    return bridge_state(pilot.memory_record, agent.memory_record)


def bridge_state(memory: Any, guidance: Any) -> BridgeState:
    """What an autopilot on a bridge remembers when it is switched on."""
    law, guide = (from_columns(one, repeat(0.0)) for one in (memory, guidance))
    return BridgeState(0.0, 0.0, 0.0, law, guide)


def check_closed_form(part: Any) -> None:
    """Refuse what does not steer by its `law` alone; InputError lists what does."""
    if isinstance(part, Controller) and part.is_closed_form():
        return
    closed = []
    for kind in controller_kinds():
        if controller_class(kind).is_closed_form():
            closed.append(kind)
    name = getattr(part, "name", type(part).__name__)
    raise InputError(
        "controller: expected a closed-form law, which can be written as C, or a"
        f" learned policy, got '{name}'; closed-form are {quoted(closed)}"
    )


def observation_rows(policy: LearnedPolicy) -> list[dict[str, Any]]:
    """Observations of a policy: value in C, scale, bounds and name of the input."""
    rows = []
    scales = zip(policy.observation_names, policy.observation_scales, strict=True)
    for name, scale in scales:
        low, high = observation_bounds()[name]
        is_own = name in OwnObservations._fields
        value = f"own.{name}" if is_own else f"given.{name}"
        given = None if is_own else name
        row = {"value": value, "given": given, "scale": scale, "low": low, "high": high}
        rows.append(row)
    return rows


def layer_activations(policy: LearnedPolicy) -> list[str]:
    """Activation of each layer's output in C; empty where there is none."""
    network = policy.network
    # In C, the output of a layer y[i] after its activation.
    written = {
        "relu": "y[i] > 0.0f ? y[i] : 0.0f",
        "tanh": "tanhf(y[i])",
        "linear": "",
    }
    n_hidden = len(network.layers) - 1
    return [written[network.activation]] * n_hidden + [written[network.output]]
