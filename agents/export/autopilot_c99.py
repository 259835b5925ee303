"""Controllers and learned policies as C99: laws translated, networks as tables."""

import re
from typing import Any

from agents.controllers.controller import Controller
from agents.controllers.guided import Guided
from agents.controllers.law import Law, Nothing
from agents.controllers.registry import controller_class, controller_kinds
from agents.export.autopilot import (
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
from agents.export.c99 import Source, c_source, checked_name, hash_text, render
from agents.export.c_expression import Translated
from agents.export.c_structures import (
    Parameter,
    kind_of,
    leaf_paths,
    numbers_of,
    parameters_of,
    record_kind,
)
from agents.export.c_syntax import Kind, comment
from agents.export.translator import Translator
from agents.export.variables import AUTOPILOT_INPUTS, AUTOPILOT_OUTPUTS
from agents.policies.policy import ORDERS, LearnedPolicy, combined, toward
from shipgym import InputError
from shipgym.checks import quoted

#: State of a policy beside what its base remembers.
POLICY_STATE = record_kind(
    "PolicyState",
    {
        "integral": float,
        "last_command": float,
        "started": float,
        "memory": Nothing,
        "guidance": Nothing,
    },
    noted=BridgeState,
)


def autopilot_source(
    agent: Any, name: str | None = None, real: str = "double"
) -> Source:
    """Write a controller or a learned policy as C99.

    The integral of the heading error is part of it; `real` is the type of its numbers,
    double or float. Raises InputError for a controller that does not steer by its `law`
    alone, for a law of more than can be translated, and for a name that C does not
    take.
    """
    inputs = {name: AUTOPILOT_INPUTS[name] for name in needed_inputs(agent)}
    p = bridge_parameters(agent)
    name = checked_name(name or agent.name)
    c = Translator({}, name, real)
    if isinstance(agent, LearnedPolicy):
        template, data = "policy.c.j2", policy_data(c, agent, p)
    else:
        template, data = "autopilot.c.j2", controller_data(c, agent, p)

    title = f"Autopilot '{agent.name}' for model '{agent.model_name}'"
    data |= {
        "title": comment(title),
        "sha256": hash_text(agent.model_sha256),
        "inputs": inputs,
        "interval": p.dt,
        "limit": p.limit,
        "given_type": c.structures.type(BridgeInput),
        "structures": c.structures.texts,
        "functions": c.functions,
    }
    source = c_source(template, name, real, **data)
    return Source(
        name=name,
        header=render("autopilot.h.j2", name, real=real, **data),
        source=source,
        inputs=inputs,
        outputs=AUTOPILOT_OUTPUTS,
        step=p.dt,
        ship=False,
        title=title,
        sha256=hash_text(agent.model_sha256),
        parameters=tunable(c, agent, p, source),
        tables=tuple(leaf_paths(kind_of(p), tables=True)),
    )


def tunable(
    c: Translator, agent: Any, p: BridgeParameters, source: str
) -> tuple[Parameter, ...]:
    """Parameters that have an effect in a source; its interval is part of the design.

    The integral of the heading error is always formed, but not always read.
    """
    without = set()
    base = getattr(agent, "base", None)
    if not isinstance(base, Guided):  # of the environment of a policy
        without |= {"task_lookahead", "path_radius"}
    if not re.search(r"\w\.heading_error_integral\b", source):
        without.add("reach")

    kept = []
    numbers = numbers_of(p)
    for parameter in parameters_of(c.structures, kind_of(p), numbers):
        is_interval = parameter.path.rpartition(".")[2] == "dt"
        if not is_interval and parameter.path not in without:
            kept.append(parameter)
    return tuple(kept)


def controller_data(c: Translator, agent: Any, p: BridgeParameters) -> dict[str, Any]:
    """Data of the templates for a controller."""
    structures = c.structures
    state = state_kind(agent)
    structures.declare(state, f"{structures.prefix}_own")
    kind = parameters_kind(c, p)
    header = structures.texts
    structures.texts = []

    step = steering_step(c, agent, state, kind, path_step)
    numbers = numbers_of(p)
    return {
        "policy": None,
        "state_structures": header,
        "own_paths": leaf_paths(state),
        "step": step.name,
        "step_type": structures.type(step.returns),
        "parameters": structures.initialiser(kind, numbers),
    }


def parameters_kind(c: Translator, p: BridgeParameters) -> Kind:
    """Kind of an autopilot's parameters, declared."""
    kind = kind_of(p)
    c.structures.declare(kind, f"{c.structures.prefix}_parameters")
    return kind


def policy_data(
    c: Translator, policy: LearnedPolicy, p: BridgeParameters
) -> dict[str, Any]:
    """Data of the templates for a learned policy, with or without a base."""
    structures = c.structures
    structures.declare(POLICY_STATE, f"{structures.prefix}_own")
    base_state = None
    base_paths: list[str] = []
    if policy.base is not None:
        base_paths = leaf_paths(state_kind(policy.base))
        base_state = state_kind(policy.base)
        structures.declare(base_state, f"{structures.prefix}_base")
    kind = parameters_kind(c, p)
    header, structures.texts = structures.texts, []

    observe = c.function(policy_observations, BridgeInput, POLICY_STATE, kind)
    finish = c.function(limited, float, POLICY_STATE, kind)
    data = {
        "policy": policy,
        "state_structures": header,
        "has_base": policy.base is not None,
        "own_paths": leaf_paths(POLICY_STATE),
        "base_paths": base_paths,
        "observe": observe.name,
        "observe_type": structures.type(observe.returns),
        "own_observations_type": structures.type(OwnObservations),
        "finish": finish.name,
        "step_type": structures.type(finish.returns),
        "rows": observation_rows(policy),
        "activations": layer_activations(policy),
        "orders": ORDERS,
        "parameters": structures.initialiser(kind, numbers_of(p)),
    }
    if policy.action != "rudder-discrete":
        data["toward"] = c.function(toward, float, float, float).name
    if policy.base is not None:
        data |= base_data(c, policy.base, base_state, kind)
    return data


def base_data(
    c: Translator, base: Any, state: Kind, parameters: Kind
) -> dict[str, Any]:
    """Data of the templates for the base that a policy adds to."""
    step = steering_step(c, base, state, parameters, base_path_step)
    sum_of_orders = c.function(combined, float, float, float)
    return {
        "combined": sum_of_orders.name,
        "base_step": step.name,
        "base_step_type": c.structures.type(step.returns),
    }


def steering_step(
    c: Translator, agent: Any, state: Kind, parameters: Kind, along_path: Any
) -> Translated:
    """Write one step of a controller, of guidance the function `along_path`."""
    guide, pilot = parts_of(agent)
    law = law_of(pilot)
    kinds = (BridgeInput, state, parameters)
    if guide is None:
        return c.function(heading_step, *kinds, law)
    guidance = law_of(guide)
    return c.function(along_path, *kinds, guidance, law)


def parts_of(agent: Any) -> tuple[Any, Any]:
    """Guidance or None, and the heading autopilot; InputError if one has no law."""
    check_closed_form(agent)
    if not isinstance(agent, Guided):
        return None, agent
    check_closed_form(agent.autopilot)
    return agent, agent.autopilot


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


def law_of(controller: Controller) -> Law:
    """Law of a controller, a plain function."""
    law: Law = type(controller).law
    return law


def state_kind(agent: Any) -> Kind:
    """Kind of what a controller remembers."""
    guide, pilot = parts_of(agent)
    numbers = ("integral", "last_command", "started")
    return record_kind(
        BridgeState.__name__,
        {
            **dict.fromkeys(numbers, float),
            "memory": pilot.memory_record,
            "guidance": Nothing if guide is None else guide.memory_record,
        },
        noted=BridgeState,
    )


def observation_rows(policy: LearnedPolicy) -> list[dict[str, Any]]:
    """Observations of a policy: value in C, scale, bounds and name of the input."""
    scales = dict(zip(policy.observation_names, policy.observation_scales, strict=True))
    rows = []
    for name, scale in scales.items():
        low, high = observation_bounds()[name]
        row = {
            "value": f"given.{name}",
            "given": name,
            "scale": scale,
            "low": low,
            "high": high,
        }
        if name in OwnObservations._fields:
            row |= {"value": f"own.{name}", "given": None}
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
    hidden = written[network.activation]
    n_hidden = len(network.layers) - 1
    return [hidden] * n_hidden + [written[network.output]]
