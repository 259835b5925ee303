"""What was removed from the trials for current and wind: sentences, and tracks through the water."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.fit import Fit
from identification.regression.velocities import SIGNIFICANT
from shipgym.plots import LIMIT, MEASURED, MODEL, Panel, axis, line, panels
from shipgym.plots.style import Figure
from shipgym.trials.units import KNOT

NORMAL_95 = 1.96
SOURCES = {
    "all trials": "one for all",
    "trial": "its own",
    "given": "as given",
    "columns": "from columns",
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
        found.append(
            f"wind of {min(speeds):.2g} to {max(speeds):.2g} m/s on average: its forces"
            " are removed"
        )
    for name, row in wind.get("accelerations", {}).items():
        units = {"wind_vdot": "m/s²", "wind_rdot": "rad/s²"}
        parts = [f"{name[5:]} {value:.2g} {units[name]}" for name, value in row.items()]
        found.append(
            f"{PurePath(name).name}: constant acceleration removed, {', '.join(parts)}"
        )
    return found


def _current(row: Mapping[str, Any]) -> str:
    """One current in words: set and drift, interval, and whether there is one."""
    text = f"current of {_set_and_drift(row)}, {SOURCES[row['source']]}"
    if "standard_errors" in row:
        north, east = (NORMAL_95 * error for error in row["standard_errors"])
        text += (
            f", north {row['north']:.3f} ± {north:.3f}, east {row['east']:.3f} ±"
            f" {east:.3f} m/s (95 %)"
        )
        text += (
            ", which"
            f" {'differs' if row['probability'] < SIGNIFICANT else 'does not differ'}"
            " from zero"
        )
    elif row["source"] in ("trial", "all trials"):
        text += ", a guess without an interval, as the trials keep to one heading"
    return text + ("; removed" if row["taken_out"] else "; left in")


def _set_and_drift(row: Mapping[str, Any]) -> str:
    speed, towards = (
        np.hypot(row["north"], row["east"]),
        np.degrees(np.arctan2(row["east"], row["north"])),
    )
    return (
        f"{speed:.2f} m/s ({speed / KNOT:.2f} knots) towards"
        f" {towards % 360.0:03.0f} deg"
    )


def track_figure(fit: Fit) -> Figure | None:
    """Tracks over ground and through the water, and the way of the current; None where none was removed."""
    rows = {
        n: row
        for n, row in (fit.model.provenance or {}).get("currents", {}).items()
        if row["taken_out"]
    }
    if not (
        trials := [
            t for t in fit.trials if t.name in rows and {"x", "y"} <= t.channels.keys()
        ]
    ):
        return None
    shown = []
    for k, trial in enumerate(trials):
        row = rows[trial.name]
        east, north = (
            np.array([0.0, row[way] * trial.duration]) for way in ("east", "north")
        )
        tracks = [
            line(trial.raw["y"], trial.raw["x"], "over ground", MEASURED, 1.7),
            line(trial["y"], trial["x"], "through the water", MODEL, 1.7),
            line(
                trial["y"][-1] + east,
                trial["x"][-1] + north,
                "the water meanwhile",
                LIMIT,
                1.7,
            ),
        ]
        north_axis = axis(
            "north, m", scaleanchor=f"x{k + 1 if k else ''}", scaleratio=1
        )
        title = f"{PurePath(trial.name).name}: {_set_and_drift(row)}"
        shown.append(Panel(tracks, "east, m", north_axis, title))
    return panels(shown, 300 * -(-len(shown) // 2) + 80, 2, hovermode="closest")
