"""Inputs, states and outputs of exported ships and autopilots, in their order."""

from collections.abc import Mapping
from typing import NamedTuple


class Variable(NamedTuple):
    """A number that is given to an exported ship or autopilot, or read of it."""

    unit: str
    meaning: str
    start: float = 0.0  # value at the beginning

    @property
    def largest(self) -> float:
        """Largest magnitude that is taken; beyond it a number is no measurement."""
        # far beyond ships, but small enough to compute with
        by_unit = {"m": 1e8, "rad": 1e4, "m/s": 1e3, "rad/s": 1e2, "1/s": 1e4}
        return by_unit[self.unit]


Variables = Mapping[str, Variable]

#: Given to an exported ship, held over a step.
SHIP_INPUTS: Variables = {
    "rudder": Variable("rad", "rudder order, to starboard positive"),
    "shaft": Variable("1/s", "ordered shaft speed"),
    "current_north": Variable("m/s", "current"),
    "current_east": Variable("m/s", "current"),
    "wind_speed": Variable("m/s", "10 m above the sea; 0: no wind forces"),
    "wind_from": Variable("rad", "direction the wind comes from"),
}

#: State of an exported ship, with the fields of `Motion`.
SHIP_STATES: Variables = {
    "x": Variable("m", "north"),
    "y": Variable("m", "east"),
    "psi": Variable("rad", "heading"),
    "u": Variable("m/s", "surge"),
    "v": Variable("m/s", "sway"),
    "r": Variable("rad/s", "yaw rate"),
    "p": Variable("rad/s", "roll rate"),
    "phi": Variable("rad", "heel"),
    "q": Variable("rad/s2", "memory of yaw"),
    "delta": Variable("rad", "rudder angle"),
    "n": Variable("1/s", "shaft speed"),
}

#: Quantities that an autopilot may read, with the fields of `BridgeInput`.
AUTOPILOT_INPUTS: Variables = {
    "set_point": Variable(
        "rad",
        "heading to steer, clockwise from north; of guidance the direction of the path"
        " beside the ship",
    ),
    "heading": Variable("rad", "clockwise from north"),
    "yaw_rate": Variable("rad/s", "to starboard positive"),
    "sway": Variable("m/s", "through the water, to starboard positive"),
    "surge": Variable("m/s", "through the water"),
    "rudder": Variable("rad", "measured angle, to starboard positive"),
    "rate_of_turn": Variable(
        "rad/s",
        "ordered rate of turn, to starboard positive; 0: to keep the heading to steer",
    ),
    "cross_track": Variable(
        "m", "distance from the leg or arc, to starboard of it positive"
    ),
    "course": Variable("rad", "over ground, clockwise from north"),
    "roll": Variable("rad", "heel"),
    "roll_rate": Variable("rad/s", "of heel"),
    "shaft_speed": Variable("1/s", "measured"),
    "next_turn_distance": Variable(
        "m", "along the path to where the next turn begins; negative on its arc"
    ),
    "next_turn_angle": Variable(
        "rad", "change of course that is left of it, to starboard positive"
    ),
    "second_turn_distance": Variable(
        "m", "along the path to where the turn after that begins"
    ),
    "second_turn_angle": Variable(
        "rad", "change of course there, to starboard positive"
    ),
}

#: Answer of an autopilot.
AUTOPILOT_OUTPUTS: Variables = {
    "order": Variable("rad", "ordered rudder, to starboard positive"),
}
