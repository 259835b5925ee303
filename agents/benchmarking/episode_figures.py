"""Figures of what controllers do in one episode: their paths, and histories."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
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
    first, *_ = episodes.values()
    traces = _path_traces(first)
    for name, episode in episodes.items():
        kept = _thinned(episode.n_steps)
        north = episode.states["x"][kept]
        east = episode.states["y"][kept]
        track = controller_line(east, north, name, look[name], width=1.8)
        traces.append(track)

    # one metre is as long in both directions
    y_axis = axis("north, m", scaleanchor="x", scaleratio=1)
    panel = Panel(traces, "east, m", y_axis)
    return page_panels([panel], height=480, hovermode="closest")


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
    outlines = []
    gap = np.full(2, np.nan)  # between outlines
    for begin, end in pairwise(path):
        north, east = end - begin
        length = np.hypot(north, east)
        if length > 0.0:
            side = half_width / length * np.array([-east, north])
            outlines += [begin + side, end + side, end - side, begin - side, gap]

    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = half_width * np.column_stack([np.cos(angles), np.sin(angles)])
    for point in path[1:-1]:
        outlines += [*(point + circle), gap]
    return np.array(outlines).T


def histories_figure(episodes: Mapping[str, Episode], names: Sequence[str]) -> Figure:
    """Return cross-track error, or heading, and rudder over time in one episode.

    For the parameters see `tracks_figure`.
    """
    longest = max(episodes.values(), key=lambda episode: episode.n_steps)
    has_path = longest.waypoints is not None
    look = looks(names)
    courses = []
    rudders = []
    for name, episode in episodes.items():
        kept = _thinned(episode.n_steps)
        time = episode.dt * kept
        course = _course(episode, has_path)[kept]
        rudder = np.degrees(episode.states["delta"])[kept]
        courses.append(controller_line(time, course, name, look[name], width=1.7))
        rudders.append(controller_line(time, rudder, name, look[name], width=1.2))
    if not has_path:
        courses.append(_ordered_course(longest))

    quantity = "cross-track error, m" if has_path else "heading, deg"
    upper = Panel(courses, "", quantity)
    lower = Panel(rudders, "time, s", axis("rudder, deg", zero=True))
    grid = {
        "shared_xaxes": True,
        "vertical_spacing": 0.05,
        "row_heights": [0.58, 0.42],
    }
    figure = page_panels([upper, lower], height=480, grid=grid)
    if has_path and longest.corridor:
        _add_bounds(figure, longest.corridor)
    return figure


def _course(episode: Episode, has_path: bool) -> Floats:
    """Cross-track error, m, of an episode with a path, otherwise heading, deg."""
    if has_path:
        return episode.info["cross_track"]
    return np.degrees(np.unwrap(episode.states["psi"]))


def _add_bounds(figure: Figure, corridor: float) -> None:
    """Add lines at the bounds of a corridor to the upper panel."""
    bound = {"color": GREEN, "width": 1.2, "dash": "dash"}
    for y in (-corridor, corridor):
        figure.add_hline(y=y, line=bound, row=1, col=1)


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
