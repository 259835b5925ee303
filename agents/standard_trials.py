"""Standard manoeuvres of one model, for `shipgym trials`: runs, indices and a page of figures."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from shipgym.errors import InputError
from shipgym.manoeuvres import (
    Criterion,
    imo_assessment,
    turning_circle,
    turning_indices,
    zigzag,
    zigzag_indices,
)
from shipgym.models import ShipModel
from shipgym.plots import graph_objects, path_figure, zigzag_figure
from shipgym.trial import Trial
from shipgym.whole_file import write_text

ZIGZAGS_DEG = (10.0, 20.0)
TURN_DEG = 35.0
LENGTHS = 40.0  # duration of a run, in times to travel one ship length
STEPS_PER_LENGTH = 50.0


@dataclass(frozen=True, eq=False)
class Run:
    """One manoeuvre.

    Attributes
    ----------
    trial : Trial
        As simulated.
    indices : dict of str to float or None
        By name, units in the names.
    """

    trial: Trial
    indices: dict[str, float | None]


def standard_trials(model: ShipModel) -> dict[str, Run]:
    """Zigzags 10/10 and 20/20 and turning circles with full rudder, to both sides.

    Parameters
    ----------
    model : ShipModel
        The ship.

    Returns
    -------
    dict of str to Run
        By the name of the manoeuvre.

    Raises
    ------
    UnstableModelError
        If the ship runs away.
    """
    travel = model.particulars["length"] / model.particulars["speed"]
    duration, dt = LENGTHS * travel, travel / STEPS_PER_LENGTH
    full = min(TURN_DEG, model.steering.rudder_limit_deg)
    runs = {}
    for angle in ZIGZAGS_DEG:
        for side, port_first in (("starboard", False), ("port", True)):
            trial = zigzag(model, angle, angle, port_first, duration, dt, must_reverse=False)
            runs[f"zigzag {angle:.0f}/{angle:.0f}, {side} first"] = Run(trial, asdict(zigzag_indices(trial)))
    for side, sign in (("starboard", 1.0), ("port", -1.0)):
        trial = turning_circle(model, sign * full, duration, dt)
        runs[f"turning circle {full:.0f} deg to {side}"] = Run(trial, asdict(turning_indices(trial)))
    return runs


def criteria_of(model: ShipModel) -> dict[str, Criterion]:
    """The IMO criteria of a model."""
    return imo_assessment(model)


def check_page(path: Path) -> None:
    """Refuse a file for figures that cannot be written, before any work.

    Raises
    ------
    InputError
        If plotly is missing, the ending is not .html, or the folder cannot be written.
    """
    graph_objects()
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path}: ending '{path.suffix}' found, expected a file that ends in .html")
    if path.is_dir():
        raise InputError(f"{path}: is a folder, expected a file to write the figures to")
    if not path.absolute().parent.is_dir() or not os.access(path.absolute().parent, os.W_OK):
        raise InputError(f"{path}: its folder does not exist or cannot be written; choose another")


def write_page(
    model: ShipModel, runs: Mapping[str, Run], criteria: Mapping[str, Criterion], path: Path
) -> None:
    """Write the figures of the manoeuvres and the table of criteria as one self-contained page."""
    from agents.report import page
    from agents.report_figures import CRITERIA
    from agents.report_html import Html, badge, figure, fixed, html, section, table

    rows = [
        [
            CRITERIA[name],
            badge("passes", "good") if criterion.passed else badge("fails", "bad"),
            criterion.source,
            fixed(criterion.value, 2),
            fixed(criterion.limit, 2),
            criterion.unit,
        ]
        for name, criterion in criteria.items()
    ]
    circles = {name: run.trial for name, run in runs.items() if run.trial.kind == "turning-circle"}
    zigzags = [
        figure(
            zigzag_figure(run.trial), f"zigzag-{k}", f"{name[0].upper()}{name[1:]}. Degrees; time in seconds."
        )
        for k, (name, run) in enumerate(runs.items())
        if run.trial.kind == "zigzag"
    ]
    body = {
        "header": Html(
            f"<header><p class=kicker>Standard manoeuvres</p><h1>{html(model.name)}</h1></header>"
        ),
        "imo": section(
            "imo", "IMO criteria",
            table(["criterion", "verdict", "source", "value", "limit", "unit"], rows, text_columns=3),
        ),
        "zigzags": section("zigzags", "Zigzags", *zigzags),
        "circles": section(
            "circles", "Turning circles",
            figure(path_figure(circles), "circle-paths", "Paths from above, north up, in metres."),
        ),
    }  # fmt: skip
    write_text(page(f"{model.name}: standard manoeuvres", body), path)
