"""The figures of the report."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from agents.verification.tracks import Track
from identification.report.view import RUDDER
from shipgym.arrays import Floats
from shipgym.manoeuvres import Criterion
from shipgym.manoeuvres.quantiles import band_95
from shipgym.plots import (
    LIMIT,
    MEASURED,
    MODEL,
    MUTED,
    Panel,
    axis,
    line,
    points,
    translucent,
)

PILOT_COLOURS = ("#0f8a7e", "#a1478f", "#d9822b", "#6b7a1e", "#3b5b92", "#8c564b")
CRITERIA = {
    "advance": "Advance",
    "tactical_diameter": "Tactical diameter",
    "initial_turning": "Initial turning",
    "overshoot_1_10_10": "First overshoot",
    "overshoot_2_10_10": "Second overshoot",
    "overshoot_1_20_20": "First overshoot",
    "stopping": "Track reach, full astern stop",
}


def criterion_name(name: str, criterion: Criterion) -> str:
    """A criterion in words, with its manoeuvre."""
    words = CRITERIA[name]
    return f"{words} ({criterion.manoeuvre})" if criterion.manoeuvre else words


def in_words(criteria: Mapping[str, Criterion]) -> dict[str, Criterion]:
    """Criteria by their names in words."""
    return {criterion_name(name, one): one for name, one in criteria.items()}


def band(t: Floats, values: Floats, name: str, colour: str, **more: Any) -> Any:
    """The 95 % interval of `values`, shape (n_draws, n_samples), as a filled band."""
    low, high = band_95(values)
    return line(
        np.concatenate([t, t[::-1]]),
        np.concatenate([high, low[::-1]]),
        name,
        colour,
        0,
        fill="toself",
        fillcolor=translucent(colour, 0.18),
        hoverinfo="skip",
        **more,
    )


def criteria_panel(criteria: Mapping[str, Criterion]) -> Panel:
    """Criteria of every draw in per cent of their limits, a row each."""
    jitter = np.random.default_rng(0)
    traces = []
    names = []
    for row, (name, criterion) in enumerate(criteria.items()):
        traces += [_draws_of(criterion, row, jitter), *_marks_of(criterion, row)]
        names.append(criterion_name(name, criterion))
    rows = list(range(len(names)))
    end = len(names) - 0.5
    ends = [-0.5, end]
    limit = [100.0, 100.0]
    traces.append(
        line(
            limit,
            ends,
            "IMO limit",
            LIMIT,
            1.8,
            line_dash="dash",
        )
    )
    names_axis = axis(
        tickvals=rows,
        ticktext=names,
        range=ends[::-1],
        showgrid=False,
    )
    shares_axis = axis("per cent of the limit", rangemode="tozero", ticksuffix=" %")
    return Panel(traces, shares_axis, names_axis)


def _draws_of(criterion: Criterion, row: int, jitter: np.random.Generator) -> Any:
    """A dot for each draw that has a value, scattered only to separate them."""
    values = np.empty(0)
    if criterion.drawn is not None:
        values = criterion.drawn.values
    finite = values[np.isfinite(values)]
    shares = 100.0 * finite / criterion.limit
    heights = row + jitter.uniform(-0.22, 0.22, len(shares))
    return points(
        shares,
        heights,
        "models drawn",
        translucent(MODEL, 0.3),
        5,
        hovertemplate="%{x:.1f} %<extra></extra>",
    )


def _marks_of(criterion: Criterion, row: int) -> list[Any]:
    """A line for what was measured and one for the identified model."""
    known = [
        ("measured", criterion.measured, RUDDER),
        ("identified model", criterion.value, MEASURED),
    ]
    marks = []
    for name, value, colour in known:
        if value is not None:
            share = 100.0 * value / criterion.limit
            heights = [row - 0.32, row + 0.32]
            marks.append(line([share, share], heights, name, colour, 2.2))
    return marks


def step_panels(
    t: Floats, responses: Mapping[str, tuple[Floats, Floats]], step_deg: float
) -> tuple[Panel, Panel]:
    """Change of course under each autopilot: heading above, rudder below.

    `t`: s, shape (n_samples,); `responses`: by autopilot heading and rudder, each of
    shape (1 + n_draws, n_samples), rad, the identified model first; `step_deg`: the
    change of course, degrees.
    """
    headings = []
    rudders = []
    for (name, response), colour in zip(responses.items(), PILOT_COLOURS, strict=False):
        heading, rudder = response
        headings += _step_lines(t, np.degrees(heading), name, colour)
        rudders += _step_lines(t, np.degrees(rudder), name, colour)

    ends = [t[0], t[-1]]
    course = [step_deg, step_deg]
    headings.append(line(ends, course, "set course", MUTED, 1.2, line_dash="dot"))
    return (
        Panel(headings, "time, s", "heading change, deg"),
        Panel(rudders, "time, s", axis("rudder, deg", zero=True)),
    )


def _step_lines(t: Floats, angles: Floats, name: str, colour: str) -> list[Any]:
    """The band of the models drawn below the line of the identified one."""
    own = line(t, angles[0], name, colour, 2.1)
    if len(angles) == 1:
        return [own]
    return [
        band(t, angles[1:], name, colour, showlegend=False),
        own,
    ]


def track_panels(tracks: Mapping[str, Track], length: float) -> tuple[Panel, Panel]:
    """Tracks of the identified model under each path autopilot, and their errors."""
    first = next(iter(tracks.values()))
    waypoints = _path_line(
        first.waypoints / length,
        name="waypoints",
        colour=MUTED,
        width=1.2,
        line_dash="dot",
    )
    paths = [waypoints]
    errors = []
    for (name, track), colour in zip(tracks.items(), PILOT_COLOURS, strict=False):
        paths.append(_path_line(track.positions / length, name, colour, 2.0))
        errors.append(_error_line(track, length, name, colour))

    north_axis = axis("north, ship lengths", scaleanchor="x", scaleratio=1)
    aside = axis("m, positive to starboard", zero=True)
    return (
        Panel(paths, "east, ship lengths", north_axis, "Track"),
        Panel(errors, "way, ship lengths", aside, "Cross-track error"),
    )


def _path_line(
    places: Floats, name: str, colour: str, width: float, **more: Any
) -> Any:
    """A line through places, shape (n, 2), north and east."""
    north, east = places.T
    return line(east, north, name, colour, width, **more)


def _error_line(track: Track, length: float, name: str, colour: str) -> Any:
    """Cross-track error of a track over the way sailed, in ship lengths."""
    steps = np.diff(track.positions / length, axis=0)
    distances = np.hypot(*steps.T)
    sailed = np.append(0.0, np.cumsum(distances))
    return line(sailed, track.cross_track, name, colour, 1.6)
