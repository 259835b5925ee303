"""The page of figures that `shipgym trials` writes: one self-contained HTML file."""

from pathlib import Path
from typing import Any

from agents.cli.standard_trials import StandardTrials
from agents.verification.figures import in_words
from shipgym.files import write_text
from shipgym.manoeuvres.standard import FAMILIES, Manoeuvre, families_of
from shipgym.models import ShipModel
from shipgym.pages import render
from shipgym.plots import manoeuvre_figure, path_figure

#: Name in the page, plotly figure, and caption.
Figure = tuple[str, Any, str]


def write_page(model: ShipModel, trials: StandardTrials, path: Path) -> None:
    """Write indices, criteria and figures as one self-contained page."""
    sections = []
    for name, family in families_of(model).items():
        if family:
            sections.append(_section(name, family, trials))
    page = render(
        "agents.cli/trials.html",
        model=model,
        draws=trials.draws,
        criteria=in_words(trials.criteria),
        sections=sections,
    )
    write_text(page, path)


def _section(
    name: str, family: dict[str, Manoeuvre], trials: StandardTrials
) -> dict[str, Any]:
    """The section of one family of manoeuvres: a row for each index, and figures."""
    rows: dict[str, list[Any]] = {}
    for manoeuvre in family:
        for index in trials.indices[manoeuvre]:
            by_manoeuvre = [trials.indices[other].get(index) for other in family]
            rows[readable_index(index)] = by_manoeuvre
    refused = {key: why for key, why in trials.refused.items() if key in family}
    return {
        "name": name,
        "title": FAMILIES[name].title,
        "manoeuvres": list(family),
        "indices": rows,
        "refused": refused,
        "figures": _figures(name, family, trials),
    }


def _figures(
    name: str, family: dict[str, Manoeuvre], trials: StandardTrials
) -> list[Figure]:
    """A figure of each manoeuvre of one family, and one of all paths."""
    runs = {key: run for key, run in trials.runs.items() if key in family}
    figures = []
    for number, (key, run) in enumerate(runs.items()):
        manoeuvre = family[key]
        caption = f"{key[0].upper()}{key[1:]}. {manoeuvre.caption}"
        figures.append((f"{name}-{number}", manoeuvre_figure(run), caption))
    if runs:
        caption = "Paths from above, north up, in metres."
        figures.append((f"{name}-paths", path_figure(runs), caption))
    return figures


def readable_index(name: str) -> str:
    """The name of an index as words with its unit."""
    units = {
        "_deg_s": "deg/s",
        "_deg": "deg",
        "_lengths": "ship lengths",
        "_s": "s",
    }
    words = name.replace("_", " ")
    for ending, unit in units.items():
        if name.endswith(ending):
            return f"{words[: -len(ending)]}, {unit}"
    return words
