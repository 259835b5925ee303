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
    traces = _path_traces(next(iter(episodes.values())))
    for name, episode in episodes.items():
        kept = _thinned(episode.n_steps)
        north, east = episode.states["x"][kept], episode.states["y"][kept]
        traces.append(controller_line(east, north, name, look[name], 1.8))
    north_axis = axis("north, m", scaleanchor="x", scaleratio=1)
    return page_panels([Panel(traces, "east, m", north_axis)], 480, hovermode="closest")


def _path_traces(episode: Episode) -> list[Any]:
    """Corridor, path and waypoints of an episode; none if there is no path."""
    if episode.waypoints is None or episode.path is None:
        return []
    north, east = _corridor(episode.path, episode.corridor or 0.0)
    area: dict[str, Any] = {"fill": "toself", "fillcolor": LIGHT_GREEN}
    path, marks = episode.path, episode.waypoints
    return [
        line(east, north, "corridor", GREEN, 0, hoverinfo="skip", **area),
        line(
            path[:, 1],
            path[:, 0],
            "path",
            GREEN,
            1.4,
            line_dash="dash",
            hoverinfo="skip",
        ),
        points(marks[:, 1], marks[:, 0], "waypoints", GREEN, 7, hoverinfo="skip"),
    ]


def _corridor(path: Floats, half_width: float) -> Floats:
    """Outline strips along the pieces of a path, and discs about the points between.

    Returns north and east, m, shape (2, n); NaN parts one outline from the next.
    """
    ahead = np.diff(path, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T), np.finfo(float).tiny)[:, None]
    aside = half_width * np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
    begins, ends = path[:-1], path[1:]
    corners = [begins + aside, ends + aside, ends - aside, begins - aside]
    strips = np.stack(corners, axis=1)

    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    circle = half_width * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    discs = path[1:-1, None] + circle
    outlines = [
        np.pad(one, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan).reshape(-1, 2)
        for one in (strips, discs)
    ]
    return np.concatenate(outlines).T


def histories_figure(episodes: Mapping[str, Episode], names: Sequence[str]) -> Figure:
    """Return cross-track error, or heading, and rudder over time in one episode.

    For the parameters see `tracks_figure`.
    """
    look = looks(names)
    longest = max(episodes.values(), key=lambda episode: episode.n_steps)
    has_path = longest.waypoints is not None
    upper = Panel([], "", "cross-track error, m" if has_path else "heading, deg")
    lower = Panel([], "time, s", axis("rudder, deg", zero=True))
    for name, episode in episodes.items():
        kept = _thinned(episode.n_steps)
        t, rudder = episode.dt * kept, np.degrees(episode.states["delta"])
        shown = _cross_track(episode) if has_path else _heading_deg(episode)
        upper.traces.append(controller_line(t, shown[kept], name, look[name], 1.7))
        lower.traces.append(controller_line(t, rudder[kept], name, look[name], 1.2))
    if not has_path:
        upper.traces.append(_ordered_course(longest))

    grid = {"shared_xaxes": True, "vertical_spacing": 0.05, "row_heights": [0.58, 0.42]}
    figure = page_panels([upper, lower], 480, grid=grid)
    if has_path and longest.corridor:
        bound = {"color": GREEN, "width": 1.2, "dash": "dash"}
        for y in (-longest.corridor, longest.corridor):
            figure.add_hline(y=y, line=bound, row=1, col=1)
    return figure


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
