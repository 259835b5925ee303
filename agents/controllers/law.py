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
    last_order: Number  # rad, of the rudder


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


class Biquad(NamedTuple):
    """Filter of second order, by its coefficients on the last three numbers."""

    in_0: Number = 1.0
    in_1: Number = 0.0
    in_2: Number = 0.0
    out_1: Number = 0.0
    out_2: Number = 0.0


class Helm(NamedTuple):
    """Filters of an order, and the steering gear that it is given to."""

    wave: Biquad  # takes the waves out
    update: float  # share of a new order in a low-pass
    band: float  # rad, by which an order is to differ from the last one
    gear_share: float  # of the way to its order that the rudder moves in an interval
    gear_step: float  # rad, by which it moves at most
    limit: float  # rad, largest rudder


class HelmMemory(NamedTuple):
    """Memory of `given_order`; angles from the neutral rudder."""

    rudder: Number  # rad, by the model of the gear, as the last order was given
    given: Number  # rad, the order that the gear was given
    order: Number  # rad, the last one
    smooth: Number  # rad, order after its low-pass
    wave_1: Number  # rad, of the wave filter
    wave_2: Number  # rad
    started: Number  # 0 where an episode begins, else 1


class LinearFeedback(NamedTuple):
    """Parameters of `linear_law`."""

    gains: Gains
    neutral_rudder: float  # rad
    neutral_sway: float  # m/s
    service_speed: float  # m/s, at which the gains are as they stand
    schedule: float  # 1 for gains by the measured speed, 0 for the same at all speeds
    helm: Helm


def linear_law(
    seen: Signals, memory: HelmMemory, p: LinearFeedback
) -> tuple[Number, HelmMemory]:
    """Rudder order from the deviations of straight running.

    A ship at another speed does the same in the time that she needs for her length, so
    that time scales the gains. The rudder that is fed back is that of a model of the
    gear: where it were measured, its feedback would eat up the margins of the order.
    """
    rudder = known_rudder(seen, memory, p)
    slowness = slowness_of(seen.surge, p.service_speed, p.schedule)
    gains = p.gains
    asked = (
        gains.sway * slowness * (seen.sway - p.neutral_sway)
        + gains.yaw_rate * slowness * seen.yaw_rate
        + gains.heading_error * seen.heading_error
        + gains.rudder * rudder
        + gains.heading_error_integral / slowness * seen.heading_error_integral
    )
    return given_order(asked, memory._replace(rudder=rudder), p)


def known_rudder(seen: Signals, memory: HelmMemory, p: LinearFeedback) -> Number:
    """Rudder by the model of the gear, from the neutral angle; at first the order."""
    helm = p.helm
    way = helm.gear_share * (memory.given - memory.rudder)
    rudder = memory.rudder + clipped(way, -helm.gear_step, helm.gear_step)
    last_order = seen.last_order - p.neutral_rudder
    return np.where(memory.started > 0.0, rudder, last_order)


def slowness_of(speed: Number, service_speed: Number, schedule: Number) -> Number:
    """Service speed over speed as gains follow it; 1 for a schedule of 0."""
    known = clipped(speed, 0.25 * service_speed, 2.0 * service_speed)
    return 1.0 + schedule * (service_speed / known - 1.0)


def given_order(
    asked: Number, memory: HelmMemory, p: LinearFeedback
) -> tuple[Number, HelmMemory]:
    """Order after its filters, within the limit, and the next memory.

    `memory.rudder` is that of now.
    """
    helm = p.helm
    has_started = memory.started > 0.0
    calm, wave_1, wave_2 = filtered(asked, memory, helm.wave)
    smooth = memory.smooth + helm.update * (calm - memory.smooth)
    smooth = np.where(has_started, smooth, calm)
    is_small = np.abs(smooth - memory.order) <= helm.band
    order = np.where(
        has_started & is_small,
        memory.order,
        smooth,
    )

    given = clipped(p.neutral_rudder + order, -helm.limit, helm.limit)
    return given, HelmMemory(
        rudder=memory.rudder,
        given=given - p.neutral_rudder,
        order=order,
        smooth=smooth,
        wave_1=wave_1,
        wave_2=wave_2,
        started=1.0,
    )


def filtered(
    value: Number, memory: HelmMemory, p: Biquad
) -> tuple[Number, Number, Number]:
    """Number after a filter, and its memory; at the beginning it is at rest."""
    has_started = memory.started > 0.0
    at_rest = (p.in_2 - p.out_2) * value
    first = np.where(has_started, memory.wave_1, (p.in_1 - p.out_1) * value + at_rest)
    second = np.where(has_started, memory.wave_2, at_rest)
    after = p.in_0 * value + first
    return (
        after,
        p.in_1 * value - p.out_1 * after + second,
        p.in_2 * value - p.out_2 * after,
    )


def clipped(value: Number, low: Number, high: Number) -> Number:
    """Return a number within bounds; faster than `np.clip` for few ships."""
    return np.minimum(np.maximum(value, low), high)


def wrapped(angle: Number) -> Number:
    """Return the same angle in [-pi, pi)."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def rotated(ahead: Number, aside: Number, angle: Number) -> tuple[Number, Number]:
    """Vector in axes turned to starboard by an angle, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return ahead * cosine + aside * sine, aside * cosine - ahead * sine


def gathered(
    integral: Number, error: Number, started: Number, dt: float, reach: float
) -> Number:
    """Integral of the heading error an interval later, rad s, as environments have it.

    `started`: 0 in the first interval of an episode, which does not count, else 1;
    `reach`: largest integral, rad s.
    """
    counts = (np.abs(error) <= INTEGRAL_ZONE) & (started > 0.0)
    return clipped(integral + np.where(counts, error * dt, 0.0), -reach, reach)
