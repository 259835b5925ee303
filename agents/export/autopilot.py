"""An autopilot on a bridge: measurements of one ship in, rudder order out.

It adds plain functions on records to a controller's law; `agents.export.autopilot_c99`
writes both as C. All numbers are in SI units.
"""

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
from agents.export.source import Variable, Variables, variables_of
from shipgym.checks import check_choice


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
    pilot = controller.autopilot if isinstance(controller, Guided) else controller
    guide = controller.parameters if isinstance(controller, Guided) else Nothing()
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
