"""The replay page: recorded episodes in one HTML file that works offline."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from agents.output import check_page
from shipgym import Episode, InputError
from shipgym.arrays import Floats
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.plots import Panel, axis, line, panels, points
from shipgym.plots.style import MUTED, PALETTE, Figure
from shipgym.tasks.guidance import wrapped

DEGREES = 180.0 / np.pi
FRAMES = 200  # places of the slider


class ReplayQuantity(NamedTuple):
    """A quantity that the page shows over time."""

    label: str
    name: str  # of a state, command or entry of `info`
    factor: float = 1.0  # from SI to the unit that is shown
    order: str = ""  # name of the angle that is ordered, drawn dotted


#: In the order of the page; what no episode has, or is 0 throughout, is left out.
QUANTITIES = (
    ReplayQuantity("heading, deg", "psi", DEGREES, order="set_point"),
    ReplayQuantity("cross-track error, m", "cross_track"),
    ReplayQuantity("rudder, deg", "delta", DEGREES, order="delta_order"),
    ReplayQuantity("speed through water, m/s", "u"),
    ReplayQuantity("yaw rate, deg/s", "r", DEGREES),
    ReplayQuantity("heel, deg", "phi", DEGREES),
    ReplayQuantity("shaft speed, 1/min", "n", 60.0),
    ReplayQuantity("wind speed, m/s", "wind_speed"),
    ReplayQuantity("wind from, deg", "wind_from", DEGREES),
    ReplayQuantity("current to the north, m/s", "current_north"),
    ReplayQuantity("current to the east, m/s", "current_east"),
    ReplayQuantity("reward so far", "reward"),
)


def write_replay(paths: Sequence[str | Path], out: str | Path) -> None:
    """Write the replay page of recorded episodes.

    Raises InputError if there is no episode, one cannot be read, the page cannot be
    written, or plotly is not installed; nothing is written then.

    Parameters
    ----------
    paths : sequence of str or Path
        Episode files, of one ship or of several; the page shows them together.
    out : str or Path
        The HTML file; one that exists is replaced.
    """
    target = Path(out)
    check_page(target, plots=True)
    if not paths:
        raise InputError("episodes: expected at least one, got none")
    files = [Path(path) for path in paths]
    episodes = [Episode.load(path) for path in files]
    folder = os.path.commonpath([file.absolute().parent for file in files])
    titles = [os.path.relpath(file.with_suffix(""), folder) for file in files]
    runs = dict(zip(titles, episodes, strict=True))
    page = render(
        "agents.rollouts/replay.html",
        runs=runs,
        outcome=_outcome,
        chart=_chart(runs),
        histories=_histories(runs),
    )
    write_text(page, target)


def _chart(runs: Mapping[str, Episode]) -> Figure:
    """Tracks and paths from above, with a frame for each place of the slider."""
    paths = {}  # runs often share theirs
    tracks = []
    for number, (name, episode) in enumerate(runs.items()):
        states = episode.states
        if episode.path is not None:
            paths[episode.path.tobytes()] = episode
        track = line(states["y"], states["x"], name, _colour(number), 1.2)
        tracks.append(track)

    traces = []
    for episode in paths.values():
        north, east = np.asarray(episode.path).T
        traces.append(line(east, north, "path", MUTED, 1.2, line_dash="dash"))
        if episode.waypoints is not None:
            north, east = np.asarray(episode.waypoints).T
            traces.append(points(east, north, "waypoints", MUTED))
    traces += tracks

    first_ship = len(traces)
    for number, (name, episode) in enumerate(runs.items()):
        hull = _hull(episode, 0.0)
        bow = {"size": [8, 0, 0, 0, 0, 0]}  # where the ship is too small to be seen
        ship = line(
            hull["x"],
            hull["y"],
            name,
            _colour(number),
            mode="lines+markers",
            marker=bow,
        )
        traces.append(ship.update(fill="toself", showlegend=False))

    north_axis = axis("north, m", scaleanchor="x", scaleratio=1)
    figure = panels([Panel(traces, "east, m", north_axis)], 620, hovermode="closest")
    end = max(episode.n_steps * episode.dt for episode in runs.values())
    ships = list(range(first_ship, len(traces)))
    labels = []
    frames = []
    for time in np.linspace(0.0, end, FRAMES).tolist():
        hulls = [_hull(episode, time) for episode in runs.values()]
        labels.append(f"{time:.1f}")
        frames.append({"name": labels[-1], "data": hulls, "traces": ships})
    figure.frames = frames
    return _with_slider(figure, labels)


def _with_slider(figure: Figure, times: Sequence[str]) -> Figure:
    """A figure with a slider over its frames, and buttons to play and to pause."""
    at_once = {"mode": "immediate", "transition": {"duration": 0}}
    still = {**at_once, "frame": {"duration": 0, "redraw": False}}
    playing = {
        **at_once,
        "frame": {"duration": 50, "redraw": False},
        "fromcurrent": True,
    }
    steps = []
    for time in times:
        steps.append({"label": time, "method": "animate", "args": [[time], still]})
    play = {"label": "Play", "method": "animate", "args": [None, playing]}
    pause = {"label": "Pause", "method": "animate", "args": [[None], still]}
    buttons = {"type": "buttons", "direction": "left", "buttons": [play, pause]}
    slider = {"steps": steps, "currentvalue": {"prefix": "time, s: "}, "x": 0.15}
    figure.update_layout(
        sliders=[{**slider, "len": 0.85, "pad": {"t": 45}}],
        updatemenus=[{**buttons, "x": 0.1, "y": -0.12, "showactive": False}],
        margin_b=130,
    )
    return figure


def _hull(episode: Episode, time: float) -> dict[str, list[float]]:
    """Outline of a ship at a time, x east and y north; at its end it stays."""
    t = episode.dt * np.arange(episode.n_steps + 1)
    states = episode.states
    heading = np.interp(time, t, np.unwrap(states["psi"]))
    shape = [(0.5, 0.0), (0.2, 0.5), (-0.5, 0.4), (-0.5, -0.4), (0.2, -0.5), (0.5, 0.0)]
    slender = episode.length / 6.5  # a beam that is not known
    outline = np.array(shape) * [episode.length, episode.beam or slender]
    ahead, aside = outline.T
    sine, cosine = np.sin(heading), np.cos(heading)
    north = np.interp(time, t, states["x"]) + ahead * cosine - aside * sine
    east = np.interp(time, t, states["y"]) + ahead * sine + aside * cosine
    return {"x": np.round(east, 2).tolist(), "y": np.round(north, 2).tolist()}


def _histories(runs: Mapping[str, Episode]) -> Figure:
    """Quantities over time, a panel each: the runs, and their orders dotted."""
    series = {name: _series(episode) for name, episode in runs.items()}
    shown = list(QUANTITIES)
    for part in sorted({part for run in runs.values() for part in run.reward_parts}):
        words = part.removeprefix("reward_").replace("_", " ")
        shown.append(ReplayQuantity(f"{words}, reward so far", part))

    drawn = []
    for quantity in shown:
        traces = []
        for number, (name, episode) in enumerate(runs.items()):
            t = episode.dt * np.arange(episode.n_steps + 1)
            for values, dash in _lines(quantity, series[name]):
                colour = _colour(number)
                traces.append(line(t, values, name, colour, 1.4, line_dash=dash))
        if any(np.any(trace.y) for trace in traces):
            drawn.append(Panel(traces, "time, s", "", quantity.label))
    return panels(drawn, 190 * ((len(drawn) + 1) // 2) + 80, 2, outer=True)


def _lines(
    quantity: ReplayQuantity, series: Mapping[str, Floats]
) -> list[tuple[Floats, str]]:
    """Values of a quantity and of its order, in the unit shown, with their dashes."""
    if quantity.name not in series:
        return []
    values = series[quantity.name]
    lines = [(quantity.factor * values, "solid")]
    if quantity.order in series:
        # without a jump from what follows it
        ahead = wrapped(series[quantity.order] - values)
        ordered = values + ahead
        lines.append((quantity.factor * ordered, "dot"))
    return lines


def _series(episode: Episode) -> dict[str, Floats]:
    """Histories by name, each of shape (n_steps + 1,), SI units."""
    sums = {"reward": episode.rewards, **episode.reward_parts}
    held = {name: np.append(v, v[-1:]) for name, v in episode.commands.items()}
    found = {name: np.append(0.0, np.cumsum(values)) for name, values in sums.items()}
    found |= {**held, **episode.info, **episode.states}
    if "delta" in held:
        found["delta_order"] = held["delta"]
    heading = np.unwrap(found["psi"])  # from one within 0 to 360 degrees
    turns = np.floor(heading[0] / (2.0 * np.pi))
    found["psi"] = heading - 2.0 * np.pi * turns
    return found


def _colour(number: int) -> str:
    return PALETTE[number % len(PALETTE)]


def _outcome(episode: Episode) -> str:
    """End of an episode, in a word or two."""
    if episode.success:
        return "success"
    if episode.terminated:
        return "terminated"
    ended = "time limit" if episode.truncated else "cut off"
    return ended if episode.success is None else f"{ended}, no success"
