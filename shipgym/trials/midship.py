"""From what a log holds to the project's frame and origin: velocities in the body frame, at midship."""

import math
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.trials.conventions import Conventions
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.installation import AS_LOGGED, Installation
from shipgym.trials.instrument_offsets import DISTINCT_COURSES, correct_offsets
from shipgym.trials.navigation import rotate_to_body
from shipgym.trials.resampling import Log
from shipgym.trials.units import KNOT


def to_project_conventions(log: Log, conventions: Conventions) -> None:
    """Convert frame and origin of a log, and derive the channels that follow from others.

    The channels are in the file's frame, the heading without jumps, the rudder positive
    to starboard. The yaw rate is derived from the heading, surge and sway from velocity
    over ground or position, the heading (relative to the start) from the yaw rate where
    no position is recorded. Raises InputError where a channel is missing.
    """
    channels = log.channels
    installation = conventions.installation
    is_earth = conventions.velocity_frame == "earth"
    if "stw" in channels:
        log.over_ground = False
    elif is_earth and "u" in channels:
        log.over_ground = True
    if installation != AS_LOGGED:
        correct_offsets(log, installation)
    if "psi" in channels and "r" not in channels:
        log.derive("r", time_derivative(log.t, channels["psi"]))
    elif "r" in channels and not {"psi", "x", "y"} & channels.keys():
        log.derive("psi", _heading_from_start(log))

    if is_earth and {"u", "v"} & channels.keys():
        _earth_to_body(log)
    if conventions.origin == "cg":
        _cg_to_midship(log, conventions.xg or 0.0)
    is_complete = {"u", "v"} <= channels.keys()
    has_gnss = "ground_north" in channels or not installation.is_at_midship
    if has_gnss or "stw" in channels or not is_complete:
        to_midship(log, installation)


def _heading_from_start(log: Log) -> Floats:
    """Integral of the yaw rate by a spline, rad."""
    from scipy.interpolate import make_interp_spline

    degree = min(3, log.t.size - 1)
    rate = make_interp_spline(log.t, log.channels["r"], k=degree)
    heading = rate.antiderivative()(log.t)
    from_start: Floats = heading - heading[0]
    return from_start


def _earth_to_body(log: Log) -> None:
    """Turn north and east velocities by the recorded heading."""
    channels = log.channels
    for name in ("u", "v", "psi"):
        if name not in channels or name in log.derived:
            raise InputError(
                f'{log.where}: velocity_frame = "earth": expected u (north), v (east)'
                f" and the heading psi, got no recorded {name}; name their columns, or"
                " leave u and v out"
            )
    u, v, psi = (channels[name] for name in ("u", "v", "psi"))
    channels["u"], channels["v"] = rotate_to_body(u, v, psi)


def _cg_to_midship(log: Log, xg: float) -> None:
    """Move position, sway and yaw moment from the centre of gravity, `xg` forward of midship, to midship."""
    channels = log.channels
    needed = {"v": "r", "x": "psi", "y": "psi", "N": "Y"}
    for name, other in needed.items():
        if name in channels and other not in channels:
            raise InputError(
                f'{log.where}: origin = "cg": expected {other} to move {name} to'
                " midship, got none; name its column"
            )
    changes = {}
    if "v" in channels:
        changes["v"] = -channels["r"]
    if "x" in channels:
        changes["x"] = -np.cos(channels["psi"])
    if "y" in channels:
        changes["y"] = -np.sin(channels["psi"])
    if "N" in channels:
        changes["N"] = channels["Y"]
    for name, change in changes.items():
        channels[name] = channels[name] + xg * change


def to_midship(log: Log, installation: Installation) -> None:
    """Move positions and velocities of GNSS to midship and make surge and sway of what was logged.

    Velocity over ground gives u and v, else positions; a speed through the water takes
    the place of u, and the current that it shows is taken out of v. Raises InputError
    for GNSS without a heading.
    """
    channels = log.channels
    has_gnss = "ground_north" in channels or not installation.is_at_midship
    if has_gnss and "psi" not in channels:
        raise InputError(
            f"{log.where}: expected a column psi, the heading, with positions or"
            " velocities of GNSS, got none"
        )
    if not installation.is_at_midship and {"x", "y"} <= channels.keys():
        _move_positions(channels, installation)

    velocity = _velocity(log, installation)
    water = channels.pop("stw", None)
    if water is not None:
        channels["u"] = water
    if velocity is None:
        return
    u, v = velocity
    if water is not None:
        u, v = water, _sway_through_water(log, water, u, v)
    for name, values in (("u", u), ("v", v)):
        if name not in channels:
            log.derive(name, values)


def _move_positions(channels: dict[str, Floats], installation: Installation) -> None:
    """Move positions from the antenna to midship."""
    forward, starboard = installation.forward, installation.starboard
    to_earth = -channels["psi"]
    north, east = rotate_to_body(forward, starboard, to_earth)
    channels["x"] = channels["x"] - north
    channels["y"] = channels["y"] - east


def _velocity(log: Log, installation: Installation) -> tuple[Floats, Floats] | None:
    """Surge and sway of midship over ground, by GNSS velocities or else positions.

    None without a heading, and where both were logged.
    """
    channels = log.channels
    north = channels.pop("ground_north", None)
    east = channels.pop("ground_east", None)
    if "psi" not in channels:
        return None
    psi = channels["psi"]
    if north is not None and east is not None:
        u, v = rotate_to_body(north, east, psi)
        r = channels["r"]
        return u + installation.starboard * r, v - installation.forward * r
    are_logged = {"u", "v"} <= channels.keys()
    if are_logged or not {"x", "y"} <= channels.keys():
        return None
    north = time_derivative(log.t, channels["x"])
    east = time_derivative(log.t, channels["y"])
    return rotate_to_body(north, east, psi)


def _sway_through_water(log: Log, water: Floats, u: Floats, v: Floats) -> Floats:
    """Sway over ground less the current that a speed log shows, which a note tells."""
    psi = log.channels["psi"]
    current = set_and_drift(psi, water, (u, v))
    log.notes.append(current.note)
    _, across = rotate_to_body(current.north, current.east, psi)
    return np.asarray(v - across)


class SetAndDrift(NamedTuple):
    """A current, m/s, by a speed log against the velocity over ground."""

    north: float
    east: float
    unexplained: float  # standard deviation of what it does not explain

    @property
    def note(self) -> str:
        """The current in words."""
        speed = math.hypot(self.north, self.east)
        toward = math.degrees(math.atan2(self.east, self.north)) % 360.0
        return (
            f"set and drift by the speed log against the ground: {speed:.2f} m/s"
            f" ({speed / KNOT:.2f} kn) toward {toward:03.0f} deg,"
            f" {self.unexplained:.2f} m/s unexplained; removed from the sway"
        )


def set_and_drift(
    psi: Floats, water: Floats, ground: tuple[Floats, Floats]
) -> SetAndDrift:
    """Current that a speed through the water shows against surge and sway over ground, m/s.

    It explains best the difference of both along the ship; on nearly one course the
    part across is taken from the mean sway, as if there were no leeway.
    """
    surge, sway = ground
    c, s = np.cos(psi), np.sin(psi)
    # along the ship, and on one course across her too
    rows = np.column_stack([c, s])
    values = surge - water
    if np.ptp(psi) < DISTINCT_COURSES:
        across = np.column_stack([-s, c])
        rows = np.vstack([rows, across])
        values = np.concatenate([values, sway])

    current, *_ = np.linalg.lstsq(rows, values, rcond=None)
    left = values - rows @ current
    return SetAndDrift(
        north=float(current[0]),
        east=float(current[1]),
        unexplained=float(np.std(left)),
    )
