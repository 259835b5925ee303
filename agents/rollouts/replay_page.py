"""The replay page: recorded episodes in one HTML file that works offline."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from agents.output import check_page
from shipgym import Episode, InputError, Trial
from shipgym.envs.rendering import hull_outline
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.plots import Panel, line, line_styles, panels
from shipgym.plots.style import MUTED, Figure
from shipgym.plots.trials import history_panel, path_panel
from shipgym.tasks.guidance import wrapped

FRAMES = 200  # places of the slider
#: Channels in the order of the page; what no episode has is left out.
CHANNELS = ("psi", "delta", "delta_command", "u", "r", "phi", "n", "wind_speed")


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
    trials = {name: episode.to_trial(name) for name, episode in runs.items()}
    page = render(
        "agents.rollouts/replay.html",
        runs=runs,
        outcome=_outcome,
        chart=_chart(runs, trials),
        histories=_histories(runs, trials),
    )
    write_text(page, target)


def _chart(runs: Mapping[str, Episode], trials: Mapping[str, Trial]) -> Figure:
    """Tracks and paths from above, with a frame for each place of the slider."""
    panel = path_panel(trials)
    plans = [run.path for run in runs.values() if run.path is not None]
    for plan in {plan.tobytes(): plan for plan in plans}.values():  # often shared
        north, east = plan.T
        path = line(east, north, "path", MUTED, 1.2, line_dash="dash")
        panel.traces.append(path)

    first_ship = len(panel.traces)
    styles = line_styles(runs)
    for name, run in runs.items():
        hull = _hull(run, 0.0)
        size = [0] * len(hull["x"])
        size[0] = 8  # the bow, where the ship is too small to be seen
        ship = {
            **line(hull["x"], hull["y"], name, **styles[name]),
            "mode": "lines+markers",
            "marker": {"size": size},
            "fill": "toself",
            "showlegend": False,
        }
        panel.traces.append(ship)

    figure = panels([panel], 620, hovermode="closest")
    end = max(trial.duration for trial in trials.values())
    ships = list(range(first_ship, len(panel.traces)))
    frames = {}
    for time in np.linspace(0.0, end, FRAMES).tolist():
        frames[f"{time:.1f}"] = {
            "data": [_hull(run, time) for run in runs.values()],
            "traces": ships,
        }
    figure.frames = [{"name": name, **frame} for name, frame in frames.items()]
    return _with_slider(figure, list(frames))


def _with_slider(figure: Figure, times: Sequence[str]) -> Figure:
    """A figure with a slider over its frames, and a button that plays them."""
    still = {"mode": "immediate", "frame": {"duration": 0, "redraw": False}}
    playing = {"frame": {"duration": 50, "redraw": False}, "fromcurrent": True}
    steps = [
        {"label": time, "method": "animate", "args": [[time], still]} for time in times
    ]
    play = {"label": "Play", "method": "animate", "args": [None, playing]}
    figure.update_layout(
        sliders=[{"steps": steps, "currentvalue": {"prefix": "time, s: "}, "x": 0.1}],
        updatemenus=[{"type": "buttons", "buttons": [play], "x": 0.06, "y": -0.1}],
        margin_b=130,
    )
    return figure


def _hull(episode: Episode, time: float) -> dict[str, list[float]]:
    """Outline of a ship at a time, x east and y north; at its end it stays."""
    states = episode.states
    t = episode.t
    place = [np.interp(time, t, states[name]) for name in ("x", "y")]
    heading = float(np.interp(time, t, np.unwrap(states["psi"])))
    outline = hull_outline(place, heading, episode.length, episode.beam)
    north, east = np.round(outline, 2).T
    return {"x": east.tolist(), "y": north.tolist()}


def _histories(runs: Mapping[str, Episode], trials: Mapping[str, Trial]) -> Figure:
    """Quantities over time, a panel each; the heading with the one ordered, dotted."""
    heading, *others = [history_panel(trials, channel) for channel in CHANNELS]
    styles = line_styles(runs)
    errors = []
    rewards = []
    for name, run in runs.items():
        psi = trials[name]["psi"]
        if "set_point" in run.states:
            ordered = np.degrees(psi + wrapped(run.states["set_point"] - psi))
            dotted = line(run.t, ordered, name, **styles[name], line_dash="dot")
            heading.traces.append(dotted)
        if "cross_track" in run.info:
            errors.append(line(run.t, run.info["cross_track"], name, **styles[name]))
        earned = np.append(0.0, np.cumsum(run.rewards))
        rewards.append(line(run.t, earned, name, **styles[name]))
    shown = [
        heading,
        Panel(errors, "time, s", "cross-track error, m"),
        *others,
        Panel(rewards, "time, s", "reward so far"),
    ]
    # without what is 0 throughout
    drawn = [one for one in shown if any(np.any(line["y"]) for line in one.traces)]
    return panels(drawn, 190 * ((len(drawn) + 1) // 2) + 80, 2)


def _outcome(episode: Episode) -> str:
    """End of an episode, in a word or two."""
    if episode.success:
        return "success"
    if episode.terminated:
        return "terminated"
    ended = "time limit" if episode.truncated else "cut off"
    return ended if episode.success is None else f"{ended}, no success"
