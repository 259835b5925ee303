"""What was taken out of the trials for current and wind: sentences, and tracks through the water."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.fit import Fit
from identification.regression.still_water import SIGNIFICANT
from shipgym.plots import LIMIT, MEASURED, MODEL, axis, label, layout, line, subplots

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

KNOT = 1852.0 / 3600.0
NORMAL_95 = 1.96
SOURCES = {
    "all trials": "one of all trials",
    "trial": "its own",
    "given": "as given",
    "columns": "of its columns",
}


def sea_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """Which current and wind the trials had, by the provenance of a model, and what became of them."""
    of_trials: dict[str, list[str]] = {}
    for name, row in provenance.get("currents", {}).items():
        of_trials.setdefault(_current(row), []).append(PurePath(name).name)
    found = [f"{', '.join(names)}: {text}" for text, names in of_trials.items()]
    wind = provenance.get("wind", {})
    if "mean_speeds" in wind:
        speeds = wind["mean_speeds"].values()
        name = "blendermann" if wind["option"] == "auto" else wind["option"]
        name = name.get("coefficients", "blendermann") if isinstance(name, Mapping) else name
        name = "a table of coefficients" if isinstance(name, Mapping) else f"{name} coefficients"
        found.append(
            f"wind of {min(speeds):.2g} to {max(speeds):.2g} m/s on average: its forces by {name} taken out"
        )
    for name, row in wind.get("accelerations", {}).items():
        parts = [
            f"{'sway' if 'v' in axis else 'yaw'} {value:.2g} {'m/s²' if 'v' in axis else 'rad/s²'}"
            for axis, value in row.items()
        ]
        found.append(f"{PurePath(name).name}: constant acceleration taken out, {', '.join(parts)}")
    return found


def _current(row: Mapping[str, Any]) -> str:
    """One current in words."""
    knots, towards = row["speed"] / KNOT, f"{row['towards']:03.0f} deg"
    text = f"current of {row['speed']:.2f} m/s ({knots:.2f} knots) towards {towards}"
    if "standard_errors" in row:
        north, east = (NORMAL_95 * error for error in row["standard_errors"])
        text += (
            f" (north {row['north']:.3f} ± {north:.3f}, east {row['east']:.3f} ± {east:.3f} m/s, 95 %), "
            f"{SOURCES[row['source']]}, which "
            + ("differs from zero" if row["probability"] < SIGNIFICANT else "does not differ from zero")
        )
    else:
        text += f", {SOURCES[row['source']]}"
    return text + ("; taken out" if row["taken_out"] else "; left in")


def track_figure(fit: Fit) -> Figure | None:
    """Tracks over ground and through the water, and the way of the current; None where none was taken out."""
    rows = {n: row for n, row in (fit.model.provenance or {}).get("currents", {}).items() if row["taken_out"]}
    trials = [trial for trial in fit.trials if trial.name in rows and {"x", "y"} <= trial.channels.keys()]
    if not trials:
        return None
    titles = [
        f"{PurePath(t.name).name}: {rows[t.name]['speed']:.2f} m/s towards {rows[t.name]['towards']:03.0f}°"
        for t in trials
    ]
    lines, columns = -(-len(trials) // 2), min(len(trials), 2)
    figure = subplots(lines, columns, titles=titles, vertical_spacing=0.36 / max(lines, 2))
    for k, trial in enumerate(trials):
        place, row = {"row": k // 2 + 1, "col": k % 2 + 1}, rows[trial.name]
        x, y = trial["x"] - trial["x"][0], trial["y"] - trial["y"][0]
        drift = np.array([row["north"], row["east"]]) * trial.duration
        over = trial.raw
        tracks = (
            (over["y"] - over["y"][0], over["x"] - over["x"][0], "over ground", MEASURED),
            (y, x, "through the water", MODEL),
            ([y[-1], y[-1] + drift[1]], [x[-1], x[-1] + drift[0]], "the water meanwhile", LIMIT),
        )
        for east, north, name, colour in tracks:
            figure.add_trace(line(east, north, name, colour, 1.7, showlegend=k == 0), **place)
        label(
            figure, "east, m", axis("north, m", scaleanchor=f"x{k + 1 if k else ''}", scaleratio=1), **place
        )
    figure.update_layout(layout(300 * lines + 80, titled=True, hovermode="closest"))
    return figure
