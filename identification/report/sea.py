"""Current and wind that were removed from trials: sentences, and tracks."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.fit import Fit
from identification.report.predictions import rows_of_two
from identification.samples.velocities import SIGNIFICANT
from shipgym import Trial
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.plots import LIMIT, MEASURED, MODEL, Panel, axis, line, panels
from shipgym.plots.style import Figure
from shipgym.trials.units import KNOT


def sea_sentences(provenance: Mapping[str, Any]) -> list[str]:
    """Current and wind of the trials, by the provenance of a model, in words."""
    sentences = list[str]()
    if "currents" in provenance:
        sentences += _current_sentences(provenance["currents"])
    if "wind" in provenance:
        sentences += _wind_sentences(provenance["wind"])
    return sentences


def _current_sentences(currents: Mapping[str, Any]) -> list[str]:
    """Trials of the same current together."""
    trials_of = defaultdict[str, list[str]](list)
    for trial, row in currents.items():
        text = current_text(row)
        name = PurePath(trial).name
        trials_of[text].append(name)

    sentences = []
    for text, names in trials_of.items():
        trials = ", ".join(names)
        sentences.append(f"{trials}: {text}")
    return sentences


def _wind_sentences(wind: Mapping[str, Any]) -> list[str]:
    sentences = []
    if "mean_speeds" in wind:
        speeds = wind["mean_speeds"].values()
        low = min(speeds)
        high = max(speeds)
        sentences.append(
            f"wind of {low:.2g} to {high:.2g} m/s on average: its forces are removed"
        )

    units = {"wind_vdot": "m/s²", "wind_rdot": "rad/s²"}
    accelerations = wind.get("accelerations", {})
    for trial, row in accelerations.items():
        parts = []
        for channel, value in row.items():
            motion = channel.removeprefix("wind_")
            unit = units[channel]
            parts.append(f"{motion} {value:.2g} {unit}")
        name = PurePath(trial).name
        removed = ", ".join(parts)
        sentences.append(f"{name}: constant acceleration removed, {removed}")
    return sentences


def current_text(row: Mapping[str, Any]) -> str:
    """One current in words: set and drift, interval, and whether there is one."""
    sources = {
        "all trials": "one for all",
        "trial": "its own",
        "given": "as given",
        "columns": "from columns",
    }
    set_and_drift = _set_and_drift(row["north"], row["east"])
    source = row["source"]
    parts = [f"current of {set_and_drift}", sources[source]]
    if "standard_errors" in row:
        parts += _current_interval(row)
    elif source in ("trial", "all trials"):
        parts.append("a guess without an interval, as the trials keep to one heading")

    text = ", ".join(parts)
    end = "removed" if row["taken_out"] else "left in"
    return f"{text}; {end}"


def _current_interval(row: Mapping[str, Any]) -> list[str]:
    """95 % interval of a current, and whether it differs from zero."""
    north, east = row["north"], row["east"]
    north_error, east_error = row["standard_errors"]
    north_margin = NORMAL_95 * north_error
    east_margin = NORMAL_95 * east_error
    differs = row["probability"] < SIGNIFICANT
    verb = "differs" if differs else "does not differ"
    return [
        f"north {north:.3f} ± {north_margin:.3f}",
        f"east {east:.3f} ± {east_margin:.3f} m/s (95 %)",
        f"which {verb} from zero",
    ]


def _set_and_drift(north: float, east: float) -> str:
    speed = np.hypot(north, east)
    knots = speed / KNOT
    bearing = np.arctan2(east, north)
    towards = np.degrees(bearing) % 360.0
    return f"{speed:.2f} m/s ({knots:.2f} knots) towards {towards:03.0f} deg"


def track_figure(fit: Fit) -> Figure | None:
    """Tracks over ground and through the water, and how the current moved the water.

    None where no current was removed.
    """
    provenance = fit.model.provenance or {}
    currents = provenance.get("currents", {})
    shown = list[Panel]()
    for trial in fit.trials:
        current = currents.get(trial.name)
        if current is None or not current["taken_out"]:
            continue
        if {"x", "y"} <= trial.channels.keys():
            panel = _track_panel(trial, current, number=len(shown))
            shown.append(panel)
    if not shown:
        return None

    return panels(
        shown,
        300 * rows_of_two(shown) + 80,
        columns=2,
        hovermode="closest",
    )


def _track_panel(trial: Trial, current: Mapping[str, Any], number: int) -> Panel:
    """Both tracks, and from their end how far the water moved in the meantime."""
    east, north = trial["y"], trial["x"]
    raw = trial.raw
    drift_east = current["east"] * trial.duration
    drift_north = current["north"] * trial.duration
    water_east = [east[-1], east[-1] + drift_east]
    water_north = [north[-1], north[-1] + drift_north]
    width = 1.7
    tracks = [
        line(raw["y"], raw["x"], "over ground", MEASURED, width),
        line(east, north, "through the water", MODEL, width),
        line(water_east, water_north, "the water meanwhile", LIMIT, width),
    ]

    own_x = f"x{number + 1}" if number else "x"
    north_axis = axis("north, m", scaleanchor=own_x, scaleratio=1)
    name = PurePath(trial.name).name
    set_and_drift = _set_and_drift(current["north"], current["east"])
    return Panel(
        tracks,
        x="east, m",
        y=north_axis,
        title=f"{name}: {set_and_drift}",
    )
