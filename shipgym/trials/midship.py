"""Conversion of a log's frame and origin to body-frame velocities at midship."""

import math
from typing import Any

import numpy as np

from shipgym.arrays import Floats
from shipgym.trials.conventions import Conventions, Installation
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import rotate_to_body, set_and_drift
from shipgym.trials.resampling import Log


def to_project_conventions(log: Log, conventions: Conventions) -> None:
    """Convert frame and origin of a log, and derive channels that follow from others.

    The channels are in the file's frame, the heading without jumps, the rudder positive
    to starboard. The yaw rate is derived from the heading, surge and sway from velocity
    over ground or position, the heading (relative to the start) from the yaw rate where
    no position is recorded. Raises InputError where a channel is missing.
    """
    installation = conventions.installation
    is_earth = conventions.velocity_frame == "earth"
    if log.has("stw"):
        log.over_ground = False
    elif is_earth and log.has("u"):
        log.over_ground = True

    offsets = {"psi": installation.heading_offset, "delta": installation.rudder_offset}
    for name in offsets.keys() & log.channels.keys():
        log.channels[name] = log.channels[name] - offsets[name]
    _derive_turning(log)
    if is_earth and (log.has("u") or log.has("v")):
        _earth_to_body(log)
    if conventions.origin == "cg":
        _cg_to_midship(log, conventions.xg or 0.0)
    _to_midship(log, installation)


def _derive_turning(log: Log) -> None:
    """Derive yaw rate from heading or, without positions, heading from yaw rate."""
    if log.has("psi") and not log.has("r"):
        log.derive("r", time_derivative(log.t, log.channels["psi"]))
    elif log.has("r") and not log.has("psi") and not log.has("x"):
        log.derive("psi", log.heading)


def _earth_to_body(log: Log) -> None:
    """Turn north and east velocities by the recorded heading."""
    what = 'u and v of velocity_frame = "earth"'
    recorded = (log.needed(name, what) for name in ("u", "v", "psi"))
    log.channels["u"], log.channels["v"] = rotate_to_body(*recorded)


def _cg_to_midship(log: Log, xg: float) -> None:
    """Move position, sway and yaw moment from the centre of gravity to midship.

    The centre of gravity is `xg` m forward of midship.
    """
    moves: dict[str, tuple[str, Any]] = {
        "v": ("r", np.negative),
        "x": ("psi", lambda psi: -np.cos(psi)),
        "y": ("psi", lambda psi: -np.sin(psi)),
        "N": ("Y", np.positive),
    }
    channels = log.channels
    for name in moves.keys() & channels.keys():
        other, factor = moves[name]
        if other not in channels:
            log.needed(other, f'{name} of origin = "cg"')
        arm = xg * factor(channels[other])
        channels[name] = channels[name] + arm


def _to_midship(
    log: Log,
    installation: Installation,
) -> None:
    """Move GNSS positions and velocities to midship and derive surge and sway.

    Velocity over ground gives u and v, else positions; a speed through the water takes
    the place of u, and the current that it shows is taken out of v and, on courses that
    differ enough to tell it, of x and y. Raises InputError for GNSS without a heading.
    """
    channels = log.channels
    is_elsewhere = installation.forward or installation.starboard
    is_moved = log.has("x", "y") and is_elsewhere
    is_track_alone = log.has("x") and not log.has("delta")
    if is_moved or (log.has("ground_north") and not is_track_alone):
        log.needed("psi", "positions or velocities of GNSS")
    if is_moved:
        north, east = rotate_to_body(
            installation.forward,
            installation.starboard,
            -channels["psi"],
        )
        channels["x"] = channels["x"] - north
        channels["y"] = channels["y"] - east

    velocity = _velocity(log, installation)
    water = channels.pop("stw", None)
    if water is not None:
        channels["u"] = water
    if velocity is None:
        return
    u, v = velocity
    if water is not None and not log.magnetic:
        v = _through_water(log, water, u, v)
    for name, values in (("u", u), ("v", v)):
        if not log.has(name):
            log.derive(name, values)


def _velocity(log: Log, installation: Installation) -> tuple[Floats, Floats] | None:
    """Surge and sway of midship over ground, by GNSS velocities or else positions.

    None without a heading, and where both were logged.
    """
    is_logged = log.has("ground_north", "psi")
    if not is_logged and (log.has("u", "v") or not log.has("x", "y", "psi")):
        return None
    u, v = rotate_to_body(*log.ground_velocity, log.channels["psi"])
    if is_logged:  # of the antenna, which the yaw rate moves too
        r = log.channels["r"]
        u = u + installation.starboard * r
        v = v - installation.forward * r
    return u, v


def _through_water(log: Log, water: Floats, u: Floats, v: Floats) -> Floats:
    """Sway over ground less the current that a speed log shows; adds a note of it.

    The current explains best the difference of both speeds along the ship; on nearly
    one course the part across is taken from the mean sway, as if there were no leeway,
    else it is taken out of the track too.
    """
    psi = log.channels["psi"]
    c = np.cos(psi)
    s = np.sin(psi)
    rows = np.column_stack([c, s])
    values = u - water
    is_known = np.ptp(psi) >= math.radians(60.0)
    if not is_known:
        across = np.column_stack([-s, c])
        rows = np.vstack([rows, across])
        values = np.concatenate([values, v])

    current, *_ = np.linalg.lstsq(rows, values, rcond=None)
    north, east = current.tolist()
    unexplained = np.std(values - rows @ current)
    log.notes.append(
        "set and drift by the speed log against the ground:"
        f" {set_and_drift(north, east)}, {unexplained:.2f} m/s unexplained; removed"
        f" from the sway{' and the track' if is_known else ''}"
    )
    if is_known:
        for name, speed in (("x", north), ("y", east)):
            if log.has(name):
                drifted = speed * (log.t - log.t[0])
                log.channels[name] = log.channels[name] - drifted
    _, sway = rotate_to_body(north, east, psi)
    return np.asarray(v - sway)
