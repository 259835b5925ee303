"""The page of figures that `shipgym trials` writes: one self-contained HTML file."""

from pathlib import Path
from typing import Any

from agents.cli.standard_trials import StandardTrials
from agents.verification.figures import criterion_name
from shipgym.files import write_text
from shipgym.manoeuvres.spirals import Spiral
from shipgym.manoeuvres.standard import FAMILIES, Manoeuvre
from shipgym.pages import render
from shipgym.plots import history_figure, manoeuvre_figure, path_figure, pull_out_figure
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial

HISTORIES = ("psi", "delta", "r", "speed", "drift")
UNITS = {"_deg_s": "deg/s", "_deg": "deg", "_lengths": "ship lengths", "_s": "s"}


def write_page(model: ShipModel, found: StandardTrials, path: Path) -> None:
    """Write indices, criteria and figures as one self-contained page."""
    page = render(
        "agents.cli/trials.html",
        model=model,
        water=found.water,
        draws=found.draws,
        criteria={
            criterion_name(name, one): one for name, one in found.criteria.items()
        },
        sections=[
            _section(name, family, found)
            for name, family in found.families.items()
            if family
        ],
    )
    write_text(page, path)


def _section(
    name: str, family: dict[str, Manoeuvre], found: StandardTrials
) -> dict[str, Any]:
    """What the page shows of one family of manoeuvres: a row for each index, and figures."""
    keys = list(family)
    indices = dict.fromkeys(index for key in keys for index in found.indices[key])
    return {
        "name": name,
        "title": FAMILIES[name].title,
        "manoeuvres": keys,
        "indices": {
            _readable(index): [found.indices[key].get(index) for key in keys]
            for index in indices
        },
        "refused": {key: found.refused[key] for key in keys if key in found.refused},
        "figures": _figures(
            name,
            family,
            {key: found.sailed[key] for key in keys if key in found.sailed},
        ),
    }


def _figures(
    name: str, family: dict[str, Manoeuvre], sailed: dict[str, Trial | Spiral]
) -> list[tuple[str, Any, str]]:
    """Name in the page, figure and caption of all there is to draw of one family of manoeuvres."""
    trials = {key: run for key, run in sailed.items() if isinstance(run, Trial)}
    if name == "pull-outs" and trials:
        found = [(name, pull_out_figure(trials), family[next(iter(trials))].caption)]
    else:
        found = []
        for k, (key, run) in enumerate(sailed.items()):
            caption = f"{key[0].upper()}{key[1:]}. {family[key].caption}"
            found.append(
                (f"{name}-{k}", (family[key].figure or manoeuvre_figure)(run), caption)
            )
        if trials:
            found.append(
                (
                    f"{name}-paths",
                    path_figure(trials),
                    "Paths from above, north up, in metres.",
                )
            )
    histories = trials or {
        key: run.trial for key, run in sailed.items() if isinstance(run, Spiral)
    }
    if histories:
        caption = "Time histories: heading, rudder, yaw rate, speed and drift angle."
        found.append(
            (f"{name}-histories", history_figure(histories, HISTORIES), caption)
        )
    return found


def _readable(name: str) -> str:
    """The name of an index as words with its unit."""
    for ending, unit in UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')}, {unit}"
    return name.replace("_", " ") + (", m/s" if name == "final_speed" else "")
