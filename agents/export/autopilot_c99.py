"""Controllers as C99, translated from their laws."""

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
    BridgeState,
    bridge_parameters,
    heading_step,
    needed_inputs,
    path_step,
)
from agents.export.c_structures import leaf_paths
from agents.export.c_syntax import comment
from agents.export.source import Source, c_source, checked_name, hash_text, render
from agents.export.translator import Translator
from shipgym import InputError
from shipgym.checks import quoted

NO_INPUT = BridgeInput(0.0, 0.0)


def autopilot_source(agent: Any, name: str | None = None) -> Source:
    """Write a controller as C99.

    The integral of the heading error is part of it. Raises InputError for what does not
    steer by its `law` alone, such as a learned policy, for a law of more than can be
    translated, and for a name that C does not take.
    """
    state = first_state(agent)
    inputs = {name: AUTOPILOT_INPUTS[name] for name in needed_inputs(agent)}
    p = bridge_parameters(agent)
    name = checked_name(name or agent.name)
    c = Translator({}, name)
    structures = c.structures
    header = structures.declared(own=state, parameters=p)
    if isinstance(agent, Guided):
        laws = (agent.law, agent.autopilot.law)
        step = c.function(path_step, NO_INPUT, state, p, *laws)
    else:
        step = c.function(heading_step, NO_INPUT, state, p, agent.law)
    title = f"Autopilot '{agent.name}' for model '{agent.model_name}'"
    data: dict[str, Any] = {
        "title": comment(title),
        "sha256": hash_text(agent.model_sha256),
        "inputs": inputs,
        "interval": p.dt,
        "limit": p.limit,
        "state_structures": header,
        "state_paths": list(leaf_paths(state, "own.")),
        "step": step.name,
        "step_type": structures.type(step.returns),
        "given_type": structures.type(structures.kind_of(NO_INPUT)),
        "parameters": structures.initialiser(p),
        "structures": structures.texts,
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


def first_state(agent: Any) -> BridgeState:
    """Memory of a controller when it is switched on; InputError without a law for C."""
    check_closed_form(agent)
    if not isinstance(agent, Guided):
        return bridge_state(agent.memory_record, Nothing)
    check_closed_form(agent.autopilot)
    return bridge_state(agent.autopilot.memory_record, agent.memory_record)


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
        "controller: expected a closed-form law, which can be written as C, got"
        f" '{name}'; closed-form are {quoted(closed)}; a learned policy leaves as ONNX"
    )
