"""Named records of control laws, and functions of numbers that several laws share.

A law is a plain function `law(seen, memory, parameters) -> (order, memory)` of
arithmetic, NumPy's functions and `np.where`. Each number in its records is a float, or
an array with one entry for each of many ships, so that Python steers one ship or many;
`agents.export.translator` writes the same function as C99. A memory of zeros is
that of an episode that begins.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from shipgym.tasks.scales import INTEGRAL_ZONE

#: A float, or an array of shape (n,) with one for each of many ships.
Number: TypeAlias = Any
Law: TypeAlias = Callable[[Any, Any, Any], tuple[Number, Any]]


class Signals(NamedTuple):
    """Measurements of a ship for an autopilot that keeps a heading."""

    sway: Number  # m/s, through the water
    yaw_rate: Number  # rad/s
    heading_error: Number  # rad, course to steer less heading
    rudder: Number  # rad
    heading_error_integral: Number  # rad s
    surge: Number  # m/s, through the water


class Turns(NamedTuple):
    """The next two turns of a path, which are arcs."""

    next_distance: Number  # m, along the path to where it begins
    next_angle: Number  # rad, what is left of it, to starboard; 0 if there is none
    second_distance: Number  # m
    second_angle: Number  # rad


class PathSignals(NamedTuple):
    """Measurements of a ship and of the path beside her, for guidance."""

    heading_error: Number  # rad, direction of the path less heading
    cross_track: Number  # m, to starboard of the path
    drift: Number  # rad, course over ground less heading
    sway: Number  # m/s, through the water
    surge: Number  # m/s
    yaw_rate: Number  # rad/s
    rudder: Number  # rad
    roll: Number  # rad
    roll_rate: Number  # rad/s
    turns: Turns


class Nothing(NamedTuple):
    """Memory of a law that remembers nothing, or parameters where there are none."""


class Gains(NamedTuple):
    """Rudder per unit of each signal, rad, in the order of linear designs."""

    sway: float  # rad s/m
    yaw_rate: float  # s
    heading_error: float  # rad/rad
    rudder: float  # rad/rad
    heading_error_integral: float  # 1/s


class LinearFeedback(NamedTuple):
    """Parameters of `linear_law`."""

    gains: Gains
    neutral_rudder: float  # rad
    neutral_sway: float  # m/s


def linear_law(
    seen: Signals, memory: Nothing, p: LinearFeedback
) -> tuple[Number, Nothing]:
    """Rudder order from the deviations of straight running."""
    gains = p.gains
    order = (
        p.neutral_rudder
        + gains.sway * (seen.sway - p.neutral_sway)
        + gains.yaw_rate * seen.yaw_rate
        + gains.heading_error * seen.heading_error
        + gains.rudder * (seen.rudder - p.neutral_rudder)
        + gains.heading_error_integral * seen.heading_error_integral
    )
    return order, memory


def clipped(value: Number, low: Number, high: Number) -> Number:
    """Return a number within bounds; faster than `np.clip` for few ships."""
    return np.minimum(np.maximum(value, low), high)


def wrapped(angle: Number) -> Number:
    """Return the same angle in [-pi, pi)."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def gathered(
    integral: Number, error: Number, started: Number, dt: float, reach: float
) -> Number:
    """Integral of the heading error an interval later, rad s, as environments have it.

    `started`: 0 in the first interval of an episode, which does not count, else 1;
    `reach`: largest integral, rad s.
    """
    counts = (np.abs(error) <= INTEGRAL_ZONE) & (started > 0.0)
    return clipped(integral + np.where(counts, error * dt, 0.0), -reach, reach)
