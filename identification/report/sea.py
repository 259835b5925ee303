"""What was removed from the trials for current and wind: sentences, and tracks through the water."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.fit import Fit
from identification.regression.velocities import SIGNIFICANT
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
        trials_of[text].append(PurePath(trial).name)
    return [f"{', '.join(names)}: {text}" for text, names in trials_of.items()]


def _wind_sentences(wind: Mapping[str, Any]) -> list[str]:
    sentences = []
    if "mean_speeds" in wind:
        speeds = wind["mean_speeds"].values()
        sentences.append(
            f"wind of {min(speeds):.2g} to {max(speeds):.2g} m/s on average: its forces"
            " are removed"
        )
    units = {"wind_vdot": "m/s²", "wind_rdot": "rad/s²"}
    for trial, row in wind.get("accelerations", {}).items():
        parts = [
            f"{channel.removeprefix('wind_')} {value:.2g} {units[channel]}"
            for channel, value in row.items()
        ]
        name = PurePath(trial).name
        sentences.append(f"{name}: constant acceleration removed, {', '.join(parts)}")
    return sentences


def current_text(row: Mapping[str, Any]) -> str:
    """One current in words: set and drift, interval, and whether there is one."""
    sources = {
        "all trials": "one for all",
        "trial": "its own",
        "given": "as given",
        "columns": "from columns",
    }
    parts = [f"current of {_set_and_drift(row)}", sources[row["source"]]]
    if "standard_errors" in row:
        north, east = (NORMAL_95 * error for error in row["standard_errors"])
        parts.append(f"north {row['north']:.3f} ± {north:.3f}")
        parts.append(f"east {row['east']:.3f} ± {east:.3f} m/s (95 %)")
        differs = row["probability"] < SIGNIFICANT
        verb = "differs" if differs else "does not differ"
        parts.append(f"which {verb} from zero")
    elif row["source"] in ("trial", "all trials"):
        parts.append("a guess without an interval, as the trials keep to one heading")
    end = "removed" if row["taken_out"] else "left in"
    return f"{', '.join(parts)}; {end}"


def _set_and_drift(row: Mapping[str, Any]) -> str:
    north, east = row["north"], row["east"]
    speed = np.hypot(north, east)
    towards = np.degrees(np.arctan2(east, north)) % 360.0
    return f"{speed:.2f} m/s ({speed / KNOT:.2f} knots) towards {towards:03.0f} deg"


def track_figure(fit: Fit) -> Figure | None:
    """Tracks over ground and through the water, and the way of the current; None where none was removed."""
    currents = (fit.model.provenance or {}).get("currents", {})
    removed = {name: row for name, row in currents.items() if row["taken_out"]}
    if not removed:
        return None
    shown = list[Panel]()
    for trial in fit.trials:
        if trial.name in removed and {"x", "y"} <= trial.channels.keys():
            shown.append(_track_panel(trial, removed[trial.name], len(shown)))
    if not shown:
        return None
    rows = -(-len(shown) // 2)  # rounded up
    return panels(shown, 300 * rows + 80, 2, hovermode="closest")


def _track_panel(trial: Trial, row: Mapping[str, Any], number: int) -> Panel:
    """Both tracks, and from their end how far the water moved in the meantime."""
    east, north = trial["y"], trial["x"]
    drift_east = row["east"] * trial.duration
    drift_north = row["north"] * trial.duration
    water_east = [east[-1], east[-1] + drift_east]
    water_north = [north[-1], north[-1] + drift_north]
    tracks = [
        line(trial.raw["y"], trial.raw["x"], "over ground", MEASURED, 1.7),
        line(east, north, "through the water", MODEL, 1.7),
        line(water_east, water_north, "the water meanwhile", LIMIT, 1.7),
    ]
    own_x = f"x{number + 1}" if number else "x"
    north_axis = axis("north, m", scaleanchor=own_x, scaleratio=1)
    title = f"{PurePath(trial.name).name}: {_set_and_drift(row)}"
    return Panel(tracks, "east, m", north_axis, title)
