"""Conversion of a log's frame and origin to body-frame velocities at midship."""

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.conventions import AS_LOGGED, Conventions, Installation
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.instrument_offsets import DISTINCT_COURSES, correct_offsets
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

    if installation != AS_LOGGED:
        correct_offsets(log, installation)
    _derive_turning(log)
    if is_earth and (log.has("u") or log.has("v")):
        _earth_to_body(log)
    if conventions.origin == "cg":
        _cg_to_midship(log, conventions.xg or 0.0)
    if not log.has("u", "v") or _needs_moving(log, installation):
        to_midship(log, installation)


def _needs_moving(log: Log, installation: Installation) -> bool:
    """Return whether velocities have to be derived from GNSS and a speed log."""
    is_elsewhere = not installation.is_at_midship
    return is_elsewhere or log.has("ground_north") or log.has("stw")


def _derive_turning(log: Log) -> None:
    """Derive yaw rate from heading or, without positions, heading from yaw rate."""
    if log.has("psi", "r"):
        return
    if log.has("psi"):
        psi = log.channels["psi"]
        rate = time_derivative(log.t, psi)
        log.derive("r", rate)
        return
    has_position = log.has("x") or log.has("y")
    if log.has("r") and not has_position:
        heading = _heading_from_start(log)
        log.derive("psi", heading)


def _heading_from_start(log: Log) -> Floats:
    """Integral of the yaw rate by a spline, rad."""
    from scipy.interpolate import make_interp_spline

    t = log.t
    degree = min(3, t.size - 1)
    rate = make_interp_spline(t, log.channels["r"], k=degree)
    turned = rate.antiderivative()
    heading = turned(t)
    from_start: Floats = heading - heading[0]
    return from_start


def _earth_to_body(log: Log) -> None:
    """Turn north and east velocities by the recorded heading."""
    for name in ("u", "v", "psi"):
        is_recorded = log.has(name) and name not in log.derived
        if not is_recorded:
            raise InputError(
                f'{log.where}: velocity_frame = "earth": expected u (north), v (east)'
                f" and the heading psi, got no recorded {name}; name their columns, or"
                " leave u and v out"
            )
    channels = log.channels
    channels["u"], channels["v"] = rotate_to_body(
        north=channels["u"],
        east=channels["v"],
        psi=channels["psi"],
    )


def _cg_to_midship(log: Log, xg: float) -> None:
    """Move position, sway and yaw moment from the centre of gravity to midship.

    The centre of gravity is `xg` m forward of midship.
    """
    needed = {"v": "r", "x": "psi", "y": "psi", "N": "Y"}
    for name, other in needed.items():
        if log.has(name) and not log.has(other):
            raise InputError(
                f'{log.where}: origin = "cg": expected {other} to move {name} to'
                " midship, got none; name its column"
            )

    channels = log.channels
    moved = {}
    if log.has("v"):
        moved["v"] = channels["v"] - xg * channels["r"]
    if log.has("x"):
        north = xg * np.cos(channels["psi"])
        moved["x"] = channels["x"] - north
    if log.has("y"):
        east = xg * np.sin(channels["psi"])
        moved["y"] = channels["y"] - east
    if log.has("N"):
        moved["N"] = channels["N"] + xg * channels["Y"]
    channels |= moved


def to_midship(log: Log, installation: Installation) -> None:
    """Move GNSS positions and velocities to midship and derive surge and sway.

    Velocity over ground gives u and v, else positions; a speed through the water takes
    the place of u, and the current that it shows is taken out of v. Raises InputError
    for GNSS without a heading.
    """
    is_elsewhere = not installation.is_at_midship
    needs_heading = is_elsewhere or log.has("ground_north")
    is_track_alone = log.has("x") and not log.has("psi") and not log.has("delta")
    if is_track_alone and not is_elsewhere:
        log.channels.pop("ground_north", None)
        log.channels.pop("ground_east", None)
    elif needs_heading and not log.has("psi"):
        raise InputError(
            f"{log.where}: expected a column psi, the heading, with positions or"
            " velocities of GNSS, got none"
        )
    if is_elsewhere and log.has("x", "y"):
        _move_positions(log.channels, installation)

    velocity = _velocity(log, installation)
    water = log.channels.pop("stw", None)
    if water is not None:
        log.channels["u"] = water
    if velocity is None:
        return
    u, v = velocity
    if water is not None and not log.magnetic:
        # leeway is what is left of the sway without the current
        v = _sway_through_water(log, water, u, v)
    if not log.has("u"):
        log.derive("u", u)
    if not log.has("v"):
        log.derive("v", v)


def _move_positions(channels: dict[str, Floats], installation: Installation) -> None:
    """Move positions from the antenna to midship."""
    to_earth = -channels["psi"]
    north, east = rotate_to_body(
        installation.forward,
        installation.starboard,
        to_earth,
    )
    channels["x"] = channels["x"] - north
    channels["y"] = channels["y"] - east


def _velocity(log: Log, installation: Installation) -> tuple[Floats, Floats] | None:
    """Surge and sway of midship over ground, by GNSS velocities or else positions.

    None without a heading, and where both were logged.
    """
    channels = log.channels
    if log.has("ground_north"):
        north = channels.pop("ground_north")
        east = channels.pop("ground_east")
        u, v = rotate_to_body(north, east, channels["psi"])
        # of the antenna, which the yaw rate moves too
        r = channels["r"]
        surge = u + installation.starboard * r
        sway = v - installation.forward * r
        return surge, sway

    are_logged = log.has("u", "v")
    if are_logged or not log.has("x", "y", "psi"):
        return None
    north = time_derivative(log.t, channels["x"])
    east = time_derivative(log.t, channels["y"])
    return rotate_to_body(north, east, channels["psi"])


def _sway_through_water(log: Log, water: Floats, u: Floats, v: Floats) -> Floats:
    """Sway over ground less the current that a speed log shows; adds a note of it.

    The current explains best the difference of both speeds along the ship; on nearly
    one course the part across is taken from the mean sway, as if there were no leeway.
    """
    psi = log.channels["psi"]
    c = np.cos(psi)
    s = np.sin(psi)
    rows = np.column_stack([c, s])
    values = u - water
    if np.ptp(psi) < DISTINCT_COURSES:
        across = np.column_stack([-s, c])
        rows = np.vstack([rows, across])
        values = np.concatenate([values, v])

    current, *_ = np.linalg.lstsq(rows, values, rcond=None)
    north, east = current.tolist()
    unexplained = np.std(values - rows @ current)
    log.notes.append(
        "set and drift by the speed log against the ground:"
        f" {set_and_drift(north, east)}, {unexplained:.2f} m/s unexplained; removed"
        " from the sway"
    )
    _, sway = rotate_to_body(north, east, psi)
    return np.asarray(v - sway)
