"""The page of figures that `shipgym trials` writes: one self-contained HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from agents import output
from agents.cli.standard_trials import StandardTrials
from agents.verification.figures import CRITERIA
from shipgym.manoeuvres.spirals import Spiral
from shipgym.pages import render
from shipgym.plots import graph_objects, history_figure, manoeuvre_figure, path_figure, pull_out_figure
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial
from shipgym.whole_file import write_text

HISTORIES = ("psi", "delta", "r", "speed", "drift")
#: Sections of the page, and how the names of their manoeuvres begin.
SECTIONS: dict[str, str | tuple[str, ...]] = {
    "zigzags": "zigzag",
    "circles": "turning circle",
    "spirals": ("direct spiral", "reverse spiral"),
    "pull-outs": "pull-out",
    "stops": ("inertia stop", "crash stop", "acceleration"),
}
TITLES = {
    "zigzags": "Zigzags",
    "circles": "Turning circles",
    "spirals": "Spirals",
    "pull-outs": "Pull-outs",
    "stops": "Stopping and acceleration",
}
CAPTIONS = {
    "zigzag": "Heading change and rudder in degrees; dotted: the heading at which the rudder is reversed.",
    "turning": "Path from above, from the position and along the heading at which the rudder was ordered.",
    "direct": "Each point a steady turn, with rudder angles there and back.",
    "reverse": "Each point a yaw rate held by a helmsman, with the mean rudder that it took.",
    "inertia": "The shaft stopped at service speed, the rudder amidships, until a tenth of it is left.",
    "crash": "The shaft ordered full astern at service speed, the rudder amidships, until dead in the water.",
    "acceleration": "From a quarter of service speed, the shaft ordered to service speed.",
}
UNITS = {"_deg_s": "deg/s", "_deg": "deg", "_lengths": "ship lengths", "_s": "s"}


def check_page(path: Path) -> None:
    """Refuse a file for figures that cannot be written, before any work.

    Raises
    ------
    InputError
        If plotly is missing, the ending is not .html, or the folder cannot be written.
    """
    graph_objects()
    output.check_page(path)


def write_page(model: ShipModel, found: StandardTrials, path: Path) -> None:
    """Write indices, criteria and figures as one self-contained page."""
    chosen = {
        name: [key for key in found.indices if key.startswith(start)] for name, start in SECTIONS.items()
    }
    page = render(
        "agents.cli/trials.html",
        model=model,
        water=found.water,
        draws=found.draws,
        criteria={CRITERIA[name]: criterion for name, criterion in found.criteria.items()},
        sections=[_section(name, keys, found) for name, keys in chosen.items() if keys],
    )
    write_text(page, path)


def _section(name: str, keys: list[str], found: StandardTrials) -> dict[str, Any]:
    """What the page shows of one family of manoeuvres: a row for each index, and figures."""
    indices = dict.fromkeys(index for key in keys for index in found.indices[key])
    return {
        "name": name,
        "title": TITLES[name],
        "manoeuvres": keys,
        "indices": {_readable(index): [found.indices[key].get(index) for key in keys] for index in indices},
        "refused": {key: found.refused[key] for key in keys if key in found.refused},
        "figures": _figures(name, {key: found.sailed[key] for key in keys if key in found.sailed}),
    }


def _figures(name: str, sailed: dict[str, Trial | Spiral]) -> list[tuple[str, Any, str]]:
    """Name in the page, figure and caption of all there is to draw of one family of manoeuvres."""
    trials = {key: run for key, run in sailed.items() if isinstance(run, Trial)}
    if name == "pull-outs" and trials:
        caption = "Yaw rate, deg/s. Sides that end apart show a ship that is unstable on a straight course."
        found = [(name, pull_out_figure(trials), caption)]
    else:
        captions = [f"{key[0].upper()}{key[1:]}. {CAPTIONS[key.split()[0]]}" for key in sailed]
        found = [
            (f"{name}-{k}", manoeuvre_figure(run), caption)
            for k, (run, caption) in enumerate(zip(sailed.values(), captions, strict=True))
        ]
        if trials:
            found.append((f"{name}-paths", path_figure(trials), "Paths from above, north up, in metres."))
    histories = trials or {key: run.trial for key, run in sailed.items() if isinstance(run, Spiral)}
    if histories:
        caption = "Time histories: heading, rudder, yaw rate, speed and drift angle."
        found.append((f"{name}-histories", history_figure(histories, HISTORIES), caption))
    return found


def _readable(name: str) -> str:
    """The name of an index as words with its unit."""
    for ending, unit in UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')}, {unit}"
    return name.replace("_", " ") + (", m/s" if name == "final_speed" else "")
