"""Controllers and learned policies as C99: their laws translated, the network of a policy as a table."""

from typing import Any

from agents.controllers.controller import Controller
from agents.controllers.guided import Guided
from agents.controllers.law import Law, Nothing
from agents.controllers.registry import controller_class, controller_kinds
from agents.deployment.autopilot import (
    VARIABLES,
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
from agents.deployment.c99 import Source, Variable, checked_name, comment, render
from agents.deployment.c_expression import Translated
from agents.deployment.c_structures import kind_of, numbers_of, record_kind
from agents.deployment.c_syntax import Kind
from agents.deployment.translator import Translator
from agents.policies.policy import ORDERS, LearnedPolicy, combined, toward
from shipgym import InputError
from shipgym.checks import quoted

#: In C, the output of a layer y[i] after its activation.
ACTIVATIONS = {
    "relu": "y[i] > 0.0f ? y[i] : 0.0f",
    "tanh": "tanhf(y[i])",
    "linear": "",
}
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
)


def autopilot_source(agent: Any, name: str | None = None) -> Source:
    """Write a controller or a learned policy as C99, with the integral of the heading error.

    Raises InputError for a controller that does not steer by its `law` alone, for a law
    of more than can be translated, and for a name that C does not take.
    """
    needed = needed_inputs(agent)
    inputs = {one: Variable(*VARIABLES["autopilot_input"][one]) for one in needed}
    outputs = {
        one: Variable(*about) for one, about in VARIABLES["autopilot_output"].items()
    }
    p = bridge_parameters(agent)
    name = checked_name(name or agent.name)
    c = Translator({}, name)
    if isinstance(agent, LearnedPolicy):
        template, data = "policy.c.j2", policy_data(c, agent, p)
    else:
        template, data = "autopilot.c.j2", controller_data(c, agent, p)

    title = f"Autopilot '{agent.name}' for model '{agent.model_name}'"
    data |= {
        "title": comment(title),
        "inputs": inputs,
        "interval": p.dt,
        "limit": p.limit,
        "given_type": c.structures.type(BridgeInput),
        "structures": c.structures.texts,
        "functions": c.functions,
    }
    return Source(
        name=name,
        header=render("autopilot.h.j2", name, **data),
        source=render(template, name, **data),
        inputs=inputs,
        outputs=outputs,
        step=p.dt,
        ship=False,
    )


def controller_data(c: Translator, agent: Any, p: BridgeParameters) -> dict[str, Any]:
    """Data of the templates for a controller."""
    state = state_kind(agent)
    c.structures.declare(state, f"{c.structures.prefix}_state")
    header, c.structures.texts = c.structures.texts, []

    kind = kind_of(p)
    step = steering_step(c, agent, state, kind, path_step)
    return {
        "policy": None,
        "state_structures": header,
        "step": step.name,
        "step_type": c.structures.type(step.returns),
        "constants": {
            "PARAMETERS": (
                c.structures.type(kind),
                c.structures.initialiser(kind, numbers_of(p)),
            )
        },
    }


def policy_data(
    c: Translator, policy: LearnedPolicy, p: BridgeParameters
) -> dict[str, Any]:
    """Data of the templates for a learned policy, with or without a base."""
    c.structures.declare(POLICY_STATE, f"{c.structures.prefix}_own")
    base_state = None
    if policy.base is not None:
        base_state = state_kind(policy.base)
        c.structures.declare(base_state, f"{c.structures.prefix}_base")
    header, c.structures.texts = c.structures.texts, []

    kind = kind_of(p)
    observe = c.function(policy_observations, BridgeInput, POLICY_STATE, kind)
    finish = c.function(limited, float, POLICY_STATE, kind)
    data = {
        "policy": policy,
        "state_structures": header,
        "has_base": policy.base is not None,
        "observe": observe.name,
        "observe_type": c.structures.type(observe.returns),
        "own_observations_type": c.structures.type(OwnObservations),
        "finish": finish.name,
        "step_type": c.structures.type(finish.returns),
        "rows": observation_rows(policy),
        "activations": layer_activations(policy),
        "orders": ORDERS,
        "constants": {
            "PARAMETERS": (
                c.structures.type(kind),
                c.structures.initialiser(kind, numbers_of(p)),
            )
        },
    }
    if policy.action != "rudder-discrete":
        data["toward"] = c.function(toward, float, float, float).name
    if policy.base is not None:
        base_step = steering_step(c, policy.base, base_state, kind, base_path_step)
        data["combined"] = c.function(combined, float, float, float).name
        data["base_step"] = base_step.name
        data["base_step_type"] = c.structures.type(base_step.returns)
    return data


def steering_step(
    c: Translator, agent: Any, state: Kind, parameters: Kind, along_path: Any
) -> Translated:
    """Write one step of a controller; of guidance the function `along_path` with its law and the autopilot's."""
    guide, pilot = parts_of(agent)
    if guide is None:
        return c.function(heading_step, BridgeInput, state, parameters, law_of(pilot))
    laws = law_of(guide), law_of(pilot)
    return c.function(along_path, BridgeInput, state, parameters, *laws)


def parts_of(agent: Any) -> tuple[Any, Any]:
    """Guidance, if it is any, and the heading autopilot; InputError if one is not a closed-form law."""
    guide = agent if isinstance(agent, Guided) else None
    pilot = agent.autopilot if isinstance(agent, Guided) else agent
    for part in (guide, pilot):
        if part is not None:
            check_closed_form(part)
    return guide, pilot


def check_closed_form(part: Any) -> None:
    """Refuse what does not steer by its `law` alone, with an InputError that lists what does."""
    if isinstance(part, Controller) and part.is_closed_form():
        return
    closed = [
        kind for kind in controller_kinds() if controller_class(kind).is_closed_form()
    ]
    name = getattr(part, "name", type(part).__name__)
    raise InputError(
        "controller: expected a closed-form law, which can be written as C, or a learned"
        f" policy, got '{name}'; closed-form are {quoted(closed)}"
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
    )


def observation_rows(policy: LearnedPolicy) -> list[dict[str, Any]]:
    """What a policy observes: a value in C, its scale and bounds, and the input that it is, if it is one."""
    rows = []
    for name, scale in zip(
        policy.observation_names, policy.observation_scales, strict=True
    ):
        own = name in OwnObservations._fields
        low, high = observation_bounds()[name]
        row = {
            "value": f"own.{name}" if own else f"given.{name}",
            "given": None if own else name,
            "scale": scale,
            "low": low,
            "high": high,
        }
        rows.append(row)
    return rows


def layer_activations(policy: LearnedPolicy) -> list[str]:
    """Activation of each layer's output in C; empty where there is none."""
    network = policy.network
    hidden = [ACTIVATIONS[network.activation]] * (len(network.layers) - 1)
    return [*hidden, ACTIVATIONS[network.output]]
