"""What the replay page shows of an episode: its states in the units in which they are read."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from shipgym import Episode
from shipgym.arrays import Floats
from shipgym.files import shipped_toml
from shipgym.tasks.guidance import wrapped

# significant, of the numbers in the page: a millimetre in a kilometre; nine decimals at
# most
DIGITS = 7
BEAM = 1.0 / 6.5  # of the length, drawn where the beam is not known
COURSE_ORDERS = (
    "set_point",
    "course_order",
    "heading_order",
    "desired_course",
    "los_course",
)
FACTS = (
    "environment",
    "model",
    "number",
    "dt",
    "length",
    "corridor",
)  # of an episode, as they are
SHOWN = ("x", "y", "psi", "r", "phi", "delta", "n", "heading_error")  # each by itself
CROSS_TRACK = ("cross_track_error", "cross_track")


#: What may be shown, in this order; a quantity that no episode has is left out.
QUANTITIES = shipped_toml("agents.rollouts", "quantities.toml")["quantity"]
TOLD = ("label", "unit", "decimals", "line", "order", "short")  # of a quantity


def run(name: str, episode: Episode) -> dict[str, Any]:
    """An episode ready for the page's JSON.

    `name`: what the legend calls it. Returns what it is, the ship to draw, the path,
    series of n + 1 values each, and under `other` what was recorded besides, SI units.
    """
    recorded = {**episode.info, **episode.states}
    shown = {*SHOWN, _first(COURSE_ORDERS, recorded), _first(CROSS_TRACK, recorded)}
    other = {key: values for key, values in recorded.items() if key not in shown}
    return {
        "name": name,
        **{fact: getattr(episode, fact) for fact in FACTS},
        "seed": (
            None if episode.seed is None else str(episode.seed)
        ),  # too long for a number in a browser
        "steps": episode.n_steps,
        "beam": BEAM * episode.length if episode.beam is None else episode.beam,
        "rudderLimit": float(np.degrees(episode.rudder_limit)),
        "outcome": outcome(episode),
        "total": float(np.sum(episode.rewards)),
        "waypoints": None if episode.waypoints is None else rounded(episode.waypoints),
        "path": None if episode.path is None else rounded(episode.path),
        "series": {key: rounded(values) for key, values in series(episode).items()},
        "parts": {
            key: rounded(np.append(0.0, values))
            for key, values in episode.reward_parts.items()
        },
        "rewards": rounded(np.append(0.0, episode.rewards)),
        "other": {key: rounded(values) for key, values in other.items()},
    }


def series(episode: Episode) -> dict[str, Floats]:
    """What is shown over time, each of shape (n_steps + 1,); angles in degrees.

    Headings go through north without a jump, from one within 0 to 360 degrees at the
    start.
    """
    states, commands = episode.states, episode.commands
    heading = np.unwrap(states["psi"])
    heading -= 2.0 * np.pi * np.floor(heading[0] / (2.0 * np.pi))
    found: dict[str, Floats] = {
        "x": states["x"],
        "y": states["y"],
        "psi": np.degrees(heading),
        "delta": np.degrees(states["delta"]),
        "reward_so_far": np.append(0.0, np.cumsum(episode.rewards)),
    }
    if "u" in states:
        found["speed"] = (
            np.hypot(states["u"], states["v"]) if "v" in states else np.abs(states["u"])
        )
    for shown, name in (("yaw_rate", "r"), ("heel", "phi")):
        if name in states:
            found[shown] = np.degrees(states[name])
    if "delta" in commands:
        found["rudder_order"] = np.degrees(_before_steps(commands["delta"]))
    if "n" in states:
        found["shaft_speed"] = 60.0 * states["n"]
    elif "n" in commands:
        found["shaft_speed"] = 60.0 * _before_steps(commands["n"])
    if order := _first(COURSE_ORDERS, states):
        error = wrapped(states[order] - heading)
        found["heading_error"] = np.degrees(error)
        found["course_order"] = np.degrees(
            heading + error
        )  # without a jump from the heading
    recorded = {**episode.info, **states}
    if cross_track := _first(CROSS_TRACK, recorded):
        found["cross_track_error"] = recorded[cross_track]
    return {**found, **_weather(states)}


def quantities(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The histories and read-outs that some of the runs have."""
    shown = [
        one for one in QUANTITIES if any(one["line"] in run["series"] for run in runs)
    ]
    return [{name: one.get(name) for name in TOLD} for one in shown]


def outcome(episode: Episode) -> str:
    """How an episode ended, in a word or two."""
    if episode.success:
        return "success"
    if episode.terminated:
        return "terminated"
    ended = "time limit" if episode.truncated else "cut off"
    return ended if episode.success is None else f"{ended}, no success"


def _first(names: Sequence[str], states: Mapping[str, Floats]) -> str | None:
    """The first of some names that is recorded."""
    return next((name for name in names if name in states), None)


def _weather(states: Mapping[str, Floats]) -> dict[str, Floats]:
    """Wind and current where they are recorded and not zero throughout."""
    found: dict[str, Floats] = {}
    if {"wind_speed", "wind_from"} <= states.keys() and np.any(states["wind_speed"]):
        found["wind_speed"] = states["wind_speed"]
        found["wind_from"] = np.degrees(states["wind_from"]) % 360.0
    if {"current_north", "current_east"} <= states.keys():
        north, east = states["current_north"], states["current_east"]
        if np.any(north) or np.any(east):
            found["current_speed"] = np.hypot(north, east)
            found["current_towards"] = np.degrees(np.arctan2(east, north)) % 360.0
    return found


def _before_steps(values: Floats) -> Floats:
    """Orders at the samples from which on they apply; the last one up to the end."""
    return np.append(values, values[-1:])


def rounded(values: Floats) -> list[Any]:
    """Numbers with the digits that the page keeps."""
    array = np.asarray(values, dtype=float)
    size = np.floor(np.log10(np.maximum(np.abs(array), np.finfo(float).tiny)))
    power = 10.0 ** np.clip(DIGITS - 1.0 - size, 0.0, DIGITS + 2.0)
    short: list[Any] = (np.round(array * power) / power).tolist()
    return short
