"""How channels of a trial are drawn: titles and units of their axes."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.checks import check_choice
from shipgym.extras import axes_of


class ChannelAxis(NamedTuple):
    """The axis on which a channel is drawn."""

    title: str
    factor: float = 1.0  # from SI units


_IN_DEGREES = 180.0 / math.pi

#: Axis of each channel, and of what u and v give; m/s and degrees.
CHANNEL_AXES = {
    "x": ChannelAxis("north, m"),
    "y": ChannelAxis("east, m"),
    "psi": ChannelAxis("heading, deg", _IN_DEGREES),
    "u": ChannelAxis("surge, m/s"),
    "v": ChannelAxis("sway, m/s"),
    "r": ChannelAxis("yaw rate, deg/s", _IN_DEGREES),
    "p": ChannelAxis("roll rate, deg/s", _IN_DEGREES),
    "phi": ChannelAxis("heel, deg", _IN_DEGREES),
    "delta": ChannelAxis("rudder, deg", _IN_DEGREES),
    "delta_command": ChannelAxis("rudder order, deg", _IN_DEGREES),
    "n": ChannelAxis("shaft, rev/s"),
    "n_command": ChannelAxis("shaft order, rev/s"),
    "speed": ChannelAxis("speed, m/s"),
    "drift": ChannelAxis("drift angle, deg", _IN_DEGREES),
    "wind_speed": ChannelAxis("wind, m/s"),
}


def quantity(channels: Mapping[str, Floats], name: str) -> Floats | None:
    """Channel of a trial, or speed (m/s) or drift angle (rad); None without them.

    The drift angle is positive where the ship moves to port of her heading.
    """
    if name in channels:
        return channels[name]
    if "u" not in channels or "v" not in channels:
        return None
    u = channels["u"]
    v = channels["v"]
    return {"speed": np.hypot(u, v), "drift": np.arctan2(-v, u)}.get(name)


def plot(
    t: Floats, channels: Mapping[str, Floats], name: str, ax: Any, **line: Any
) -> Any:
    """Draw a channel over time, or "path", on axes of matplotlib; see `Trial.plot`."""
    known = [one for one in CHANNEL_AXES if quantity(channels, one) is not None]
    if {"x", "y"} <= channels.keys():
        known.append("path")
    check_choice(name, known, "channel")
    ax = axes_of(ax)
    if name == "path":
        ax.plot(channels["y"], channels["x"], **line)
        ax.set(xlabel=CHANNEL_AXES["y"].title, ylabel=CHANNEL_AXES["x"].title)
        ax.set_aspect("equal", "datalim")
    else:
        axis = CHANNEL_AXES[name]
        ax.plot(t, axis.factor * np.asarray(quantity(channels, name)), **line)
        ax.set(xlabel="time, s", ylabel=axis.title)
    return ax
