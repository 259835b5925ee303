"""The replay page: recorded episodes in one HTML file that works offline."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.output import check_page
from shipgym import Episode, InputError
from shipgym.arrays import Floats
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.tasks.guidance import wrapped

COURSE_ORDERS = (
    "set_point",
    "course_order",
    "heading_order",
    "desired_course",
    "los_course",
)


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
    ReplayQuantity("wind speed", "m/s", 1, "wind_speed", short="wind"),
    ReplayQuantity("wind from", "deg", 0, "wind_from"),
    ReplayQuantity("current speed", "m/s", 2, "current_speed", short="current"),
    ReplayQuantity("current towards", "deg", 0, "current_towards", short="setting"),
    ReplayQuantity("reward so far", "", 2, "reward_so_far"),
)


def write_replay(paths: Sequence[str | Path], out: str | Path) -> None:
    """Write the replay page of recorded episodes.

    Raises InputError if there is no episode, one cannot be read, or the page cannot be
    written; nothing is written then.

    Parameters
    ----------
    paths : sequence of str or Path
        Episode files, of one ship or of several; the page shows them together.
    out : str or Path
        The HTML file; one that exists is replaced.
    """
    target = Path(out)
    check_page(target)
    if not paths:
        raise InputError("episodes: expected at least one, got none")
    files = [Path(path) for path in paths]
    episodes = [Episode.load(path) for path in files]
    runs = []
    for title, episode in zip(_titles(files), episodes, strict=True):
        runs.append(_run(title, episode))
    models = dict.fromkeys(episode.model for episode in episodes)
    page = render(
        "agents.rollouts/replay.html",
        title=f"Replay: {', '.join(models)}",
        data={"runs": runs, "quantities": _quantities(runs)},
    )
    write_text(page, target)


def _titles(paths: Sequence[Path]) -> list[str]:
    """Names of files without ending, with as many folders as tell them apart."""
    stems = [path.absolute().with_suffix("").parts for path in paths]
    n_files = len(set(stems))
    depth = 1
    while len({stem[-depth:] for stem in stems}) < n_files:
        depth += 1
    return ["/".join(stem[-depth:]) for stem in stems]


def _quantities(runs: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Quantities that some of the runs have."""
    recorded = {name for run in runs for name in run["series"]}
    shown = [quantity for quantity in QUANTITIES if quantity.line in recorded]
    return [quantity._asdict() for quantity in shown]


def _run(name: str, episode: Episode) -> dict[str, Any]:
    """An episode ready for the page's JSON: what it is, and series of n + 1 values."""
    slender = episode.length / 6.5  # a beam that is not known
    parts = {}
    for part, values in episode.reward_parts.items():
        parts[part] = _rounded(np.append(0.0, values))
    series = {}
    for quantity, values in _series(episode).items():
        series[quantity] = _rounded(values)
    path, waypoints = episode.path, episode.waypoints
    return {
        "name": name,
        "environment": episode.environment,
        "model": episode.model,
        "number": episode.number,
        # a string: too long for a number in a browser
        "seed": None if episode.seed is None else str(episode.seed),
        "dt": episode.dt,
        "steps": episode.n_steps,
        "length": episode.length,
        "beam": episode.beam or slender,
        "outcome": _outcome(episode),
        "total": float(np.sum(episode.rewards)),
        "corridor": episode.corridor,
        "waypoints": None if waypoints is None else _rounded(waypoints),
        "path": None if path is None else _rounded(path),
        "series": series,
        "parts": parts,
        "rewards": _rounded(np.append(0.0, episode.rewards)),
    }


def _series(episode: Episode) -> dict[str, Floats]:
    """Histories that are shown, each of shape (n_steps + 1,); angles in degrees."""
    states = episode.states
    recorded = {**episode.info, **states}
    found: dict[str, Floats] = {
        "x": states["x"],
        "y": states["y"],
        "reward_so_far": np.append(0.0, np.cumsum(episode.rewards)),
    }
    if "u" in states:
        found["speed"] = np.hypot(states["u"], states.get("v", 0.0))
    for name in ("cross_track_error", "cross_track"):
        if name in recorded:
            found.setdefault("cross_track_error", recorded[name])
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
    heading = np.unwrap(states["psi"])
    heading = heading - 2.0 * np.pi * np.floor(heading[0] / (2.0 * np.pi))
    radians = {"psi": heading, "delta": states["delta"]}
    if "r" in states:
        radians["yaw_rate"] = states["r"]
    if "phi" in states:
        radians["heel"] = states["phi"]
    orders = [states[name] for name in COURSE_ORDERS if name in states]
    if orders:
        error = wrapped(orders[0] - heading)
        radians["heading_error"] = error
        radians["course_order"] = heading + error  # without a jump from the heading
    return {name: np.degrees(values) for name, values in radians.items()}


def _orders(episode: Episode) -> dict[str, Floats]:
    """Rudder that is ordered, degrees, and shaft speed, 1/min."""
    found: dict[str, Floats] = {}
    held = {}  # from a sample on, the last one up to the end
    for name, values in episode.commands.items():
        held[name] = np.append(values, values[-1:])
    if "delta" in held:
        found["rudder_order"] = np.degrees(held["delta"])
    shaft_speed = episode.states.get("n", held.get("n"))
    if shaft_speed is not None:
        found["shaft_speed"] = 60.0 * shaft_speed
    return found


def _weather(states: Mapping[str, Floats]) -> dict[str, Floats]:
    """Wind and current where they are recorded and not zero throughout."""
    found: dict[str, Floats] = {}
    has_wind = {"wind_speed", "wind_from"} <= states.keys()
    if has_wind and np.any(states["wind_speed"]):
        found["wind_speed"] = states["wind_speed"]
        found["wind_from"] = np.degrees(states["wind_from"]) % 360.0
    if {"current_north", "current_east"} <= states.keys():
        north, east = states["current_north"], states["current_east"]
        drift = np.hypot(north, east)
        if np.any(drift):
            found["current_speed"] = drift
            found["current_towards"] = np.degrees(np.arctan2(east, north)) % 360.0
    return found


def _outcome(episode: Episode) -> str:
    """End of an episode, in a word or two."""
    if episode.success:
        return "success"
    if episode.terminated:
        return "terminated"
    ended = "time limit" if episode.truncated else "cut off"
    return ended if episode.success is None else f"{ended}, no success"


def _rounded(values: Floats) -> list[Any]:
    """Numbers with seven significant digits: a millimetre in a kilometre."""
    if values.ndim > 1:
        return [_rounded(row) for row in values]
    return [float(f"{value:.7g}") for value in values.tolist()]
