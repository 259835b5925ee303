"""Series that the replay page shows of an episode, in the units of a reader."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from shipgym import Episode
from shipgym.arrays import Floats
from shipgym.tasks.guidance import wrapped

COURSE_ORDERS = (
    "set_point",
    "course_order",
    "heading_order",
    "desired_course",
    "los_course",
)
CROSS_TRACK = ("cross_track_error", "cross_track")


class ReplayQuantity(NamedTuple):
    """A quantity that the page may show over time and as a read-out."""

    label: str
    unit: str
    decimals: int
    line: str  # series that is drawn
    order: str | None = None  # series of its order, drawn dashed
    short: str | None = None  # short name


#: In the order of the page; a quantity that no episode has is left out.
QUANTITIES = (
    ReplayQuantity("heading", "deg", 1, "psi", order="course_order"),
    ReplayQuantity(
        "cross-track error", "m", 1, "cross_track_error", short="cross-track"
    ),
    ReplayQuantity("heading error", "deg", 1, "heading_error"),
    ReplayQuantity("rudder", "deg", 1, "delta", order="rudder_order"),
    ReplayQuantity("speed through water", "m/s", 2, "speed", short="speed"),
    ReplayQuantity("yaw rate", "deg/s", 2, "yaw_rate"),
    ReplayQuantity("heel", "deg", 1, "heel"),
    ReplayQuantity("shaft speed", "1/min", 1, "shaft_speed"),
    ReplayQuantity("reward so far", "", 2, "reward_so_far"),
)


def run(name: str, episode: Episode) -> dict[str, Any]:
    """An episode ready for the page's JSON.

    `name`: what the legend calls it. Returns what it is, the ship to draw, the path,
    series of n + 1 values each, and under `other` what was recorded besides, SI units.
    """
    parts = {}
    for part, values in episode.reward_parts.items():
        parts[part] = np.append(0.0, values)
    return {
        "name": name,
        **_facts(episode),
        "outcome": outcome(episode),
        "total": float(np.sum(episode.rewards)),
        "corridor": episode.corridor,
        "waypoints": _points(episode.waypoints),
        "path": _points(episode.path),
        "series": _rounded_all(series(episode)),
        "parts": _rounded_all(parts),
        "rewards": rounded(np.append(0.0, episode.rewards)),
        "other": _rounded_all(_other(episode)),
    }


def _facts(episode: Episode) -> dict[str, Any]:
    """Numbers that say which episode it is, and of which ship."""
    beam = episode.beam
    if not beam:  # it is not known
        beam_share = 1.0 / 6.5  # of the length
        beam = beam_share * episode.length
    rudder_limit_deg = np.degrees(episode.rudder_limit)
    seed = None if episode.seed is None else str(episode.seed)
    return {
        "environment": episode.environment,
        "model": episode.model,
        "number": episode.number,
        "seed": seed,  # a string: too long for a number in a browser
        "dt": episode.dt,
        "steps": episode.n_steps,
        "length": episode.length,
        "beam": beam,
        "rudderLimit": float(rudder_limit_deg),
    }


def _points(points: Floats | None) -> list[Any] | None:
    return None if points is None else rounded(points)


def _other(episode: Episode) -> dict[str, Floats]:
    """Recorded histories that no series shows."""
    recorded = {**episode.info, **episode.states}
    order = _first(COURSE_ORDERS, recorded)
    cross_track = _first(CROSS_TRACK, recorded)
    # What is not listed under `other`, because a series shows it.
    usual = ("x", "y", "psi", "r", "phi", "delta", "n", "heading_error")
    shown = {*usual, order, cross_track}
    other = {}
    for name, values in recorded.items():
        if name not in shown:
            other[name] = values
    return other


def series(episode: Episode) -> dict[str, Floats]:
    """Histories that are shown, each of shape (n_steps + 1,); angles in degrees."""
    states = episode.states
    found: dict[str, Floats] = {
        "x": states["x"],
        "y": states["y"],
        "reward_so_far": np.append(0.0, np.cumsum(episode.rewards)),
    }
    if "u" in states:
        sway = states.get("v", 0.0)
        found["speed"] = np.hypot(states["u"], sway)
    recorded = {**episode.info, **states}
    cross_track = _first(CROSS_TRACK, recorded)
    if cross_track is not None:
        found["cross_track_error"] = recorded[cross_track]

    return {
        **found,
        **_angles(states),
        **_orders(episode),
        **_weather(states),
    }


def _angles(states: Mapping[str, Floats]) -> dict[str, Floats]:
    """Angles of the ship and the course to steer, degrees.

    Headings go through north without a jump, from one within 0 to 360 degrees at the
    start.
    """
    full_turn = 2.0 * np.pi
    heading = np.unwrap(states["psi"])
    whole_turns = np.floor(heading[0] / full_turn)
    heading = heading - full_turn * whole_turns

    radians = {"psi": heading, "delta": states["delta"]}
    if "r" in states:
        radians["yaw_rate"] = states["r"]
    if "phi" in states:
        radians["heel"] = states["phi"]
    order = _first(COURSE_ORDERS, states)
    if order is not None:
        error = wrapped(states[order] - heading)
        radians["heading_error"] = error
        radians["course_order"] = heading + error  # without a jump from the heading

    in_degrees = {}
    for name, values in radians.items():
        in_degrees[name] = np.degrees(values)
    return in_degrees


def _orders(episode: Episode) -> dict[str, Floats]:
    """Rudder that is ordered, degrees, and shaft speed, 1/min."""
    found: dict[str, Floats] = {}
    commands = episode.commands
    if "delta" in commands:
        rudder = _before_steps(commands["delta"])
        found["rudder_order"] = np.degrees(rudder)
    if "n" in episode.states:
        found["shaft_speed"] = 60.0 * episode.states["n"]
    elif "n" in commands:
        found["shaft_speed"] = 60.0 * _before_steps(commands["n"])
    return found


def _before_steps(values: Floats) -> Floats:
    """Orders at the samples from which on they apply; the last one up to the end."""
    return np.append(values, values[-1:])


def _weather(states: Mapping[str, Floats]) -> dict[str, Floats]:
    """Wind and current where they are recorded and not zero throughout."""
    found: dict[str, Floats] = {}
    speed = states.get("wind_speed")
    origin = states.get("wind_from")
    if speed is not None and origin is not None and np.any(speed):
        found["wind_speed"] = speed
        found["wind_from"] = np.degrees(origin) % 360.0

    north = states.get("current_north")
    east = states.get("current_east")
    if north is None or east is None:
        return found
    drift = np.hypot(north, east)
    if np.any(drift):
        towards = np.arctan2(east, north)
        found["current_speed"] = drift
        found["current_towards"] = np.degrees(towards) % 360.0
    return found


def quantities(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Histories and read-outs that some of the runs have."""
    recorded: set[str] = set()
    for one in runs:
        names = one["series"]
        recorded.update(names)

    shown = []
    for quantity in QUANTITIES:
        if quantity.line in recorded:
            shown.append(quantity._asdict())
    return shown


def outcome(episode: Episode) -> str:
    """End of an episode, in a word or two."""
    if episode.success:
        return "success"
    if episode.terminated:
        return "terminated"
    ended = "time limit" if episode.truncated else "cut off"
    return ended if episode.success is None else f"{ended}, no success"


def _first(names: Iterable[str], recorded: Mapping[str, Floats]) -> str | None:
    """The first of some names that is recorded."""
    for name in names:
        if name in recorded:
            return name
    return None


def _rounded_all(histories: Mapping[str, Floats]) -> dict[str, list[Any]]:
    return {name: rounded(values) for name, values in histories.items()}


def rounded(values: Floats) -> list[Any]:
    """Numbers with the digits that the page keeps."""
    array = np.asarray(values, dtype=np.float64)
    smallest = np.finfo(np.float64).tiny  # zero has no logarithm
    size = np.maximum(np.abs(array), smallest)
    magnitude = np.floor(np.log10(size))
    before_point = 1.0 + magnitude
    # significant digits of the numbers in the page: a millimetre in a kilometre
    digits = 7
    most_decimals = 9
    decimals = np.clip(digits - before_point, 0.0, most_decimals)

    factor = 10.0**decimals
    scaled = np.round(array * factor)
    short: list[Any] = (scaled / factor).tolist()
    return short
