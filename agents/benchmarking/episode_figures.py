"""Figures of what controllers do in one episode: their paths, and histories."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agents.benchmarking.page_figures import controller_line, looks, page_panels
from shipgym.arrays import Floats, Integers
from shipgym.envs.episode import Episode
from shipgym.plots import INK, Panel, axis, line, points
from shipgym.plots.style import Figure
from shipgym.tasks.guidance import wrapped

MOST_SAMPLES = 240  # of a line
GREEN, LIGHT_GREEN = "#2f6b3c", "#e3efe5"  # of the path to follow
GAP = np.full(2, np.nan)  # between outlines
HISTORIES_GRID = {
    "shared_xaxes": True,
    "vertical_spacing": 0.05,
    "row_heights": [0.58, 0.42],
}


def tracks_figure(episodes: Mapping[str, Episode], names: Sequence[str]) -> Figure:
    """Return the paths over ground of controllers in one episode.

    The path to follow and its corridor are shown below them.

    Parameters
    ----------
    episodes : mapping of str to Episode
        By controller.
    names : sequence of str
        All controllers of the page, which gives each its colour.
    """
    look = looks(names)
    first = next(iter(episodes.values()))
    traces = _path_traces(first)
    for name, episode in episodes.items():
        kept = _thinned(episode.n_steps)
        north = episode.states["x"][kept]
        east = episode.states["y"][kept]
        traces.append(controller_line(east, north, name, look[name], 1.8))

    return page_panels(
        [Panel(traces, "east, m", axis("north, m", scaleanchor="x", scaleratio=1))],
        height=480,
        hovermode="closest",
    )


def _path_traces(episode: Episode) -> list[Any]:
    """Corridor, path and waypoints of an episode; none if there is no path."""
    if episode.waypoints is None or episode.path is None:
        return []
    north, east = _corridor(episode.path, episode.corridor or 0.0)
    path_north, path_east = episode.path.T
    mark_north, mark_east = episode.waypoints.T
    corridor = line(
        east,
        north,
        "corridor",
        GREEN,
        0,
        hoverinfo="skip",
        fill="toself",
        fillcolor=LIGHT_GREEN,
    )
    path = line(
        path_east,
        path_north,
        "path",
        GREEN,
        1.4,
        hoverinfo="skip",
        line_dash="dash",
    )
    waypoints = points(
        mark_east,
        mark_north,
        "waypoints",
        GREEN,
        7,
        hoverinfo="skip",
    )
    return [corridor, path, waypoints]


def _corridor(path: Floats, half_width: float) -> Floats:
    """Outline strips along the pieces of a path, and discs about the points between.

    Returns north and east, m, shape (2, n); NaN parts one outline from the next.
    """
    begins, ends = path[:-1], path[1:]
    ahead = ends - begins
    lengths = np.hypot(*ahead.T)
    ahead /= np.maximum(lengths, np.finfo(float).tiny)[:, None]
    north, east = ahead.T
    aside = half_width * np.column_stack([-east, north])

    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = half_width * np.column_stack([np.cos(angles), np.sin(angles)])
    outlines = []
    for begin, end, side in zip(begins, ends, aside, strict=True):
        outlines += [begin + side, end + side, end - side, begin - side, GAP]
    for point in path[1:-1]:
        outlines += [*(point + circle), GAP]
    return np.array(outlines).T


def histories_figure(episodes: Mapping[str, Episode], names: Sequence[str]) -> Figure:
    """Return cross-track error, or heading, and rudder over time in one episode.

    For the parameters see `tracks_figure`.
    """
    longest = max(episodes.values(), key=lambda episode: episode.n_steps)
    has_path = longest.waypoints is not None
    look = looks(names)
    courses, rudders = [], []
    for name, episode in episodes.items():
        kept = _thinned(episode.n_steps)
        time = episode.dt * kept
        course = _cross_track(episode) if has_path else _heading_deg(episode)
        rudder = np.degrees(episode.states["delta"])
        courses.append(controller_line(time, course[kept], name, look[name], 1.7))
        rudders.append(controller_line(time, rudder[kept], name, look[name], 1.2))
    if not has_path:
        courses.append(_ordered_course(longest))

    figure = page_panels(
        [
            Panel(courses, "", "cross-track error, m" if has_path else "heading, deg"),
            Panel(rudders, "time, s", axis("rudder, deg", zero=True)),
        ],
        height=480,
        grid=HISTORIES_GRID,
    )
    if has_path and longest.corridor:
        _add_bounds(figure, longest.corridor)
    return figure


def _add_bounds(figure: Figure, corridor: float) -> None:
    """Add lines at the bounds of a corridor to the upper panel."""
    bound = {"color": GREEN, "width": 1.2, "dash": "dash"}
    for y in (-corridor, corridor):
        figure.add_hline(y=y, line=bound, row=1, col=1)


def _cross_track(episode: Episode) -> Floats:
    return episode.info["cross_track"]


def _heading_deg(episode: Episode) -> Floats:
    return np.degrees(np.unwrap(episode.states["psi"]))


def _ordered_course(episode: Episode) -> Any:
    heading = np.unwrap(episode.states["psi"])
    course = heading + wrapped(episode.states["set_point"] - heading)
    return line(
        episode.dt * np.arange(episode.n_steps + 1),
        np.degrees(course),
        "ordered course",
        INK,
        1.3,
        line_dash="dash",
        line_shape="hv",
    )


def _thinned(n_steps: int) -> Integers:
    """Return the numbers of the samples to draw, the first and the last among them."""
    n_samples = min(n_steps, MOST_SAMPLES) + 1
    samples = np.linspace(0, n_steps, n_samples).round()
    return np.unique(samples.astype(np.int64))
