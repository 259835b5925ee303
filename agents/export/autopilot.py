"""An autopilot on a bridge: measurements of one ship in, rudder order out.

It adds plain functions on records to a controller's law; `agents.export.autopilot_c99`
writes both as C. All numbers are in SI units.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.guided import COURSE_ERROR, Guided, shown_course
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
from agents.export.source import Variable, Variables, variables_of
from shipgym import InputError
from shipgym.engine.records import field_types
from shipgym.tasks import path_following
from shipgym.tasks.contract import ObservationSpec
from shipgym.tasks.scales import rounded_interval
from shipgym.tasks.steering import Extras, SteeringSignals


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
    task_lookahead: float  # m, of the environment that a policy learned in
    path_radius: float  # m
    law: Any  # parameters of its law
    guide: Any  # parameters of its guidance law


class OwnObservations(NamedTuple):
    """Observations that an autopilot derives from its set-point and its memory."""

    heading_error_sin: Number
    heading_error_cos: Number
    last_command: Number  # rad
    heading_error_integral: Number  # rad s
    course_error_sin: Number
    course_error_cos: Number


Step = tuple[Number, BridgeState]


def heading_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, law: Law
) -> Step:
    """Order of an autopilot that keeps a heading, and its next state."""
    error = wrapped(given.set_point - given.heading)
    order, after = heading_order(
        error,
        given,
        state,
        p,
        law=law,
    )
    return limited(order, after, p)


def path_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, guide: Law, law: Law
) -> Step:
    """Order of guidance and its next state.

    The set-point is the direction of the path beside the ship.
    """
    error = wrapped(given.set_point - given.heading)
    order, after = path_order(
        error,
        given,
        state,
        p,
        guide=guide,
        law=law,
    )
    return limited(order, after, p)


def base_path_step(
    given: BridgeInput, state: BridgeState, p: BridgeParameters, guide: Law, law: Law
) -> Step:
    """Order of guidance that a policy adds to, and its next state.

    The set-point is the course that the policy's environment shows.
    """
    error = wrapped(given.set_point - given.heading)
    seen = path_signals(error, given)
    course = shown_course(seen, p.task_lookahead, p.path_radius)
    from_path = wrapped(error - course)
    order, after = path_order(
        from_path,
        given,
        state,
        p,
        guide=guide,
        law=law,
    )
    return limited(order, after, p)


def heading_order(
    error: Number, given: BridgeInput, state: BridgeState, p: BridgeParameters, law: Law
) -> Step:
    """Rudder for a heading error, rad, not yet limited."""
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
    return order, state._replace(integral=integral, memory=memory)


def path_order(
    error: Number,
    given: BridgeInput,
    state: BridgeState,
    p: BridgeParameters,
    guide: Law,
    law: Law,
) -> Step:
    """Rudder for a heading error, rad, against the path; it is not yet limited."""
    seen = path_signals(error, given)
    course, guidance = guide(seen, state.guidance, p.guide)
    to_course = wrapped(error + course)
    order, after = heading_order(to_course, given, state, p, law)
    return order, after._replace(guidance=guidance)


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


def limited(order: Number, state: BridgeState, p: BridgeParameters) -> Step:
    """Order within the limit, and the state in which it is the last command."""
    command = np.clip(order, -p.limit, p.limit)
    return command, state._replace(last_command=command, started=1.0)


def own_observations(
    error: Number, integral: Number, given: BridgeInput, last_command: Number
) -> OwnObservations:
    """Observations of the error of heading, rad, and of the course over ground."""
    course_error = given.set_point - given.course
    return OwnObservations(
        heading_error_sin=np.sin(error),
        heading_error_cos=np.cos(error),
        last_command=last_command,
        heading_error_integral=integral,
        course_error_sin=np.sin(course_error),
        course_error_cos=np.cos(course_error),
    )


def policy_observations(
    given: BridgeInput, state: BridgeState, p: BridgeParameters
) -> tuple[OwnObservations, BridgeState]:
    """Observations of a policy's set-point and memory, and its next state."""
    error = wrapped(given.set_point - given.heading)
    integral = gathered(
        state.integral,
        error,
        started=state.started,
        dt=p.dt,
        reach=p.reach,
    )
    own = own_observations(error, integral, given, state.last_command)
    return own, state._replace(integral=integral)


@cache
def observation_bounds() -> dict[str, tuple[float, float]]:
    """Bounds of observations by name, in multiples of their scale."""
    kinds: dict[str, Any] = {}
    for record in (SteeringSignals, Extras, path_following.Observation):
        kinds |= field_types(record, notes=True)

    bounds = {}
    for name, kind in kinds.items():
        for note in getattr(kind, "__metadata__", ()):
            if isinstance(note, ObservationSpec):
                bounds[name] = (note.low, note.high)
    return bounds


def bridge_parameters(agent: Any) -> BridgeParameters:
    """Parameters of a controller, or of a policy and the base that it adds to."""
    scales = dict(zip(agent.observation_names, agent.observation_scales, strict=True))
    if isinstance(agent, Controller):
        controller: Any = agent
        dt: Any = agent.design["dt"]
    else:
        controller = getattr(agent, "base", None)
        dt = getattr(agent, "env_options", {}).get("dt")
        dt = dt or rounded_interval(1.0 / scales["yaw_rate"])

    without_guidance = BridgeParameters(
        dt=float(dt),
        reach=float(scales["heading_error_integral"]),
        limit=float(scales["rudder"]),
        task_lookahead=1.0,
        path_radius=1.0,
        law=_law_parameters(controller),
        guide=Nothing(),
    )
    if not isinstance(controller, Guided):
        return without_guidance
    return without_guidance._replace(
        task_lookahead=controller.gains["task_lookahead"],
        path_radius=controller.path_radius,
        law=_law_parameters(controller.autopilot),
        guide=controller.parameters,
    )


def _law_parameters(agent: Any) -> Any:
    """Parameters of a controller's law; none of a policy."""
    return agent.parameters if isinstance(agent, Controller) else Nothing()


def needed_inputs(agent: Any) -> list[str]:
    """Inputs that an autopilot reads, in the order of `BridgeInput`.

    Raises InputError for one that commands the shaft too, or reads what no ship is
    known to show.
    """
    known = BridgeInput._fields
    names = {"set_point", "heading", *_needed(agent)}
    action = getattr(agent, "action", "rudder")
    if action == "rudder-shaft" or not names <= set(known):
        read = ", ".join(sorted(names))
        readable = ", ".join(known)
        raise InputError(
            "autopilot: expected a policy that commands the rudder alone, by"
            f" {readable}, got one that commands {action} and"
            f" reads {read[:200]}"
        )
    return [name for name in known if name in names]


def _needed(agent: Any) -> set[str]:
    """Names of inputs that an autopilot reads beside set-point and heading."""
    if isinstance(agent, Controller):
        names = set(agent.needed_signals)
    else:
        names = set(agent.observation_names)
    by_course = ("drift", *COURSE_ERROR)  # which the course over ground shows
    shown = {"course" if name in by_course else name for name in names}

    inner = getattr(agent, "autopilot", None) or getattr(agent, "base", None)
    if inner is not None:
        shown |= _needed(inner)
    return shown - set(OwnObservations._fields)
