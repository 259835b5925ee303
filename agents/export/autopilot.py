"""Controllers as C99: measurements of one ship in, rudder order out.

Plain functions on records are added to a controller's law, and translated with it. All
numbers are in SI units.
"""

from itertools import repeat
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.guided import Guided
from agents.controllers.law import (
    Law,
    Nothing,
    Number,
    PathSignals,
    Signals,
    Turns,
    gathered,
    wrapped,
)
from agents.controllers.memory import from_columns
from agents.controllers.registry import controller_class, controller_kinds
from agents.export.c_structures import leaf_paths
from agents.export.c_syntax import comment
from agents.export.source import (
    Source,
    Variable,
    Variables,
    c_source,
    checked_name,
    hash_text,
    render,
    variables_of,
)
from agents.export.translator import Translator
from shipgym import InputError
from shipgym.checks import check_choice, quoted


class BridgeInput(NamedTuple):
    """What an autopilot may read."""

    # rad, heading to steer, clockwise from north; of guidance the direction of the path
    # beside the ship
    set_point: Number
    heading: Number  # rad, clockwise from north
    yaw_rate: Number = 0.0  # rad/s, to starboard positive
    sway: Number = 0.0  # m/s, through the water, to starboard positive
    surge: Number = 0.0  # m/s, through the water
    rudder: Number = 0.0  # rad, measured angle, to starboard positive
    # m, distance from the leg or arc, to starboard of it positive
    cross_track: Number = 0.0
    course: Number = 0.0  # rad, over ground, clockwise from north
    roll: Number = 0.0  # rad, heel
    roll_rate: Number = 0.0  # rad/s, of heel
    shaft_speed: Number = 0.0  # 1/s, measured
    # m, along the path to where the next turn begins; negative on its arc
    next_turn_distance: Number = 0.0
    # rad, change of course that is left of it, to starboard positive
    next_turn_angle: Number = 0.0
    # m, along the path to where the turn after that begins
    second_turn_distance: Number = 0.0
    # rad, change of course there, to starboard positive
    second_turn_angle: Number = 0.0


AUTOPILOT_INPUTS = variables_of(BridgeInput)
#: Answer of an autopilot.
AUTOPILOT_OUTPUTS: Variables = {
    "order": Variable("rad", "ordered rudder, to starboard positive"),
}


class BridgeState(NamedTuple):
    """Memory of an autopilot; all zeros when it is switched on."""

    integral: Number  # rad s, of the heading error
    last_command: Number  # rad
    started: Number  # 0 before the first step, else 1
    memory: Any  # of its law
    guidance: Any  # of its guidance law


class BridgeParameters(NamedTuple):
    """Constants of an autopilot that the functions below read."""

    dt: float  # s
    reach: float  # rad s, largest integral of the heading error
    limit: float  # rad, largest rudder
    law: Any  # parameters of its law
    guide: Any  # parameters of its guidance law


Step = tuple[Number, BridgeState]


def heading_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, law: Law
) -> Step:
    """Order of an autopilot that keeps a heading, and its next state."""
    error = wrapped(given.set_point - given.heading)
    return steered(error, given, state, p, law)


def path_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, guide: Law, law: Law
) -> Step:
    """Order of guidance and its next state.

    The set-point is the direction of the path beside the ship.
    """
    error = wrapped(given.set_point - given.heading)
    seen = path_signals(error, given)
    course, guidance = guide(seen, state.guidance, p.guide)
    to_course = wrapped(error + course)
    order, after = steered(to_course, given, state, p, law)
    return order, after._replace(guidance=guidance)


def steered(
    error: Number, given: BridgeInput, state: BridgeState, p: BridgeParameters, law: Law
) -> Step:
    """Rudder for a heading error, rad, within its limit, and the next state."""
    integral = gathered(
        state.integral,
        error,
        started=state.started,
        dt=p.dt,
        reach=p.reach,
    )
    seen = Signals(
        sway=given.sway,
        yaw_rate=given.yaw_rate,
        heading_error=error,
        rudder=given.rudder,
        heading_error_integral=integral,
        surge=given.surge,
        last_order=state.last_command,
    )
    order, memory = law(seen, state.memory, p.law)
    command = np.clip(order, -p.limit, p.limit)
    return command, BridgeState(integral, command, 1.0, memory, state.guidance)


def path_signals(error: Number, given: BridgeInput) -> PathSignals:
    """Signals of guidance by the inputs of the autopilot."""
    turns = Turns(
        next_distance=given.next_turn_distance,
        next_angle=given.next_turn_angle,
        second_distance=given.second_turn_distance,
        second_angle=given.second_turn_angle,
    )
    return PathSignals(
        heading_error=error,
        cross_track=given.cross_track,
        drift=wrapped(given.course - given.heading),
        sway=given.sway,
        surge=given.surge,
        yaw_rate=given.yaw_rate,
        rudder=given.rudder,
        roll=given.roll,
        roll_rate=given.roll_rate,
        turns=turns,
    )


def bridge_parameters(controller: Controller) -> BridgeParameters:
    """Parameters of a controller."""
    scales = dict(
        zip(controller.observation_names, controller.observation_scales, strict=True)
    )
    pilot, guide = controller, Nothing()
    if isinstance(controller, Guided):
        pilot, guide = controller.autopilot, controller.parameters
    return BridgeParameters(
        dt=float(controller.design["dt"]),
        reach=float(scales["heading_error_integral"]),
        limit=float(scales["rudder"]),
        law=pilot.parameters,
        guide=guide,
    )


def needed_inputs(controller: Controller) -> list[str]:
    """Inputs that a controller reads, in the order of `BridgeInput`.

    Raises InputError for a signal that no ship is known to show.
    """
    needed = {"set_point", "heading", *controller.needed_signals}
    if isinstance(controller, Guided):
        needed |= set(controller.autopilot.needed_signals)
    # the course over ground shows the drift
    inputs = {"course" if name == "drift" else name for name in needed}
    for name in inputs:
        check_choice(name, BridgeInput._fields, f"{controller.kind}: reads")
    return [name for name in BridgeInput._fields if name in inputs]


NO_INPUT = BridgeInput(0.0, 0.0)


def autopilot_source(agent: Any, name: str | None = None) -> Source:
    """Write a controller as C99.

    The integral of the heading error is part of it. Raises InputError for what does not
    steer by its `law` alone, such as a learned policy, for a law of more than can be
    translated, and for a name that C does not take.
    """
    state = first_state(agent)
    inputs = {name: AUTOPILOT_INPUTS[name] for name in needed_inputs(agent)}
    if "surge" in inputs:
        surge = inputs["surge"]
        speed = agent.service_speed  # for which the gains are
        meaning = f"{surge.meaning}; where it is not measured {speed:.4g}"
        inputs["surge"] = surge._replace(meaning=meaning, start=speed)
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
    records: tuple[Any, Any] = (agent.memory_record, Nothing)
    if isinstance(agent, Guided):
        check_closed_form(agent.autopilot)
        records = (agent.autopilot.memory_record, agent.memory_record)
    law, guide = (from_columns(one, repeat(0.0)) for one in records)
    return BridgeState(0.0, 0.0, 0.0, law, guide)


def check_closed_form(part: Any) -> None:
    """Refuse what does not steer by its `law` alone; InputError lists what does."""
    if isinstance(part, Controller) and part.is_closed_form():
        return
    closed = [
        kind for kind in controller_kinds() if controller_class(kind).is_closed_form()
    ]
    name = getattr(part, "name", type(part).__name__)
    raise InputError(
        "controller: expected a closed-form law, which can be written as C, got"
        f" '{name}'; closed-form are {quoted(closed)}; a learned policy leaves as ONNX"
    )
