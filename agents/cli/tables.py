"""Tables that several commands print."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from agents.verification.result import AutopilotResult
    from identification import IdentificationResult
    from shipgym.manoeuvres import Criterion, IndexInterval


def plain_table(title: str, *headings: str) -> Table:
    """A table without lines; columns whose heading begins with > align right."""
    table = Table(
        title=title,
        title_style="bold",
        title_justify="left",
        header_style="dim",
        box=None,
        pad_edge=False,
        padding=(0, 2, 0, 0),
    )
    for column, heading in enumerate(headings):
        table.add_column(
            heading.removeprefix(">"),
            justify="right" if heading.startswith(">") else "left",
            no_wrap=column == 0,
            overflow="fold",
        )
    return table


def number(value: float | None, decimals: int) -> str:
    """A number with decimals, a dash for None."""
    return "-" if value is None else f"{value:.{decimals}f}"


def between(ends: tuple[float | None, float | None] | None, decimals: int) -> str:
    """An interval with decimals, a dash for one without a lower end."""
    if ends is None or ends[0] is None:
        return "-"
    low, high = ends
    upper = "no upper bound" if high is None else number(high, decimals)
    return f"{number(low, decimals)} to {upper}"


def prediction_table(result: IdentificationResult, note: str = "") -> Table:
    """Errors of the open-loop simulation of each trial, and its indices."""
    title = "Open-loop simulation of the trials: root mean square errors"
    table = plain_table(
        f"{title}, {note}" if note else title,
        "trial",
        "use",
        ">heading\ndeg",
        ">yaw rate\ndeg/s",
        ">surge\nm/s",
        ">sway\nm/s",
        "measured → predicted\n(→ rudder reversed at headings)",
    )

    from identification.report.view import index_lines

    degrees = 180.0 / np.pi
    scales = {"psi": degrees, "r": degrees, "u": 1.0, "v": 1.0}
    for file, metrics in result.metrics["trials"].items():
        errors = []
        for channel, scale in scales.items():
            error = metrics["rmse"][channel]
            if error is not None:
                error *= scale
            errors.append(number(error, 3))
        indices = Text("\n".join(index_lines(metrics)))
        if metrics["diverged"]:
            indices = Text("ran away", "bold red")
        table.add_row(PurePath(file).name, metrics["use"], *errors, indices)
    return table


def selection_table(ranking: Mapping[str, Any]) -> Table:
    """Structures and methods, those that predict held-out trials best first."""
    table = plain_table(
        f"Structures and methods by how they predict {ranking['held_out']}",
        "method",
        "structure",
        ">coeffi-\ncients",
        "model",
        ">log likeli-\nhood lost",
        ">heading\ndeg",
        ">ran away\ntrials",
    )
    for entry in ranking["ranking"]:
        table.add_row(
            entry["method"],
            entry["structure"],
            str(entry["coefficients"]),
            "stable" if entry["stable"] else Text("unstable", "bold red"),
            number(entry["loss"], 3),
            number(entry["heading_deg"], 2),
            number(entry["ran_away"], 0),
        )
    return table


def manoeuvre_table(rows: Mapping[str, Mapping[str, IndexInterval]]) -> Table:
    """Indices of manoeuvres, one line each, with the intervals of models drawn."""
    table = plain_table(
        "Manoeuvres from service speed in deep water",
        "manoeuvre",
        "index",
        ">value",
        ">95 % interval",
        ">draws without value",
    )
    for manoeuvre, indices in rows.items():
        label = manoeuvre
        for name, index in indices.items():
            without_value = "-"
            if len(index.values):
                without_value = str(index.n_ran_away + index.n_never_reached)
            interval = between(index.interval, 2)
            table.add_row(label, name, number(index.value, 2), interval, without_value)
            label = ""
    return table


def criteria_table(criteria: Mapping[str, Criterion]) -> Table:
    """IMO criteria, with interval and probability of passing if models were drawn."""
    table = plain_table(
        "IMO criteria, resolution MSC.137(76)",
        "criterion",
        ">measured",
        ">value",
        ">95 % interval",
        ">limit",
        "unit",
        "verdict",
        ">probability",
        "manoeuvre",
    )
    for name, criterion in criteria.items():
        probability = criterion.probability
        table.add_row(
            name,
            str(criterion.worse_measured or "-"),
            number(criterion.value, 2),
            between(criterion.interval, 2),
            number(criterion.limit, 2),
            criterion.unit,
            _verdict(criterion),
            "-" if probability is None else f"{100 * probability:.1f} %",
            criterion.manoeuvre,
        )
    return table


def _verdict(criterion: Criterion) -> Text:
    colours = {"passes": "green", "fails": "red", "not decided": "yellow"}
    return Text(criterion.verdict, colours.get(criterion.verdict, ""))


def criteria_notes(criteria: Mapping[str, Criterion]) -> list[str]:
    """Notes on undecided criteria, and on draws without a value."""
    notes = []
    for name, criterion in criteria.items():
        if criterion.note:
            notes.append(f"{name}: {criterion.note}")
        drawn = criterion.drawn
        if drawn is not None and drawn.lost_in_words:
            notes.append(
                f"{name}: {drawn.lost_in_words}, which are not in its interval"
            )
    return notes


def ranking_table(result: AutopilotResult) -> Table:
    """Autopilots over the models drawn, the best first."""
    metrics = result.metrics
    table = plain_table(
        f"Autopilots over {metrics['draws']['count']} models drawn, best first",
        "autopilot",
        ">cost, mean",
        ">median",
        ">95 %",
        ">heading rmse, deg",
        ">rudder, deg/min",
        ">gain margin",
        ">phase margin, deg",
        ">lost control",
    )
    for name in metrics["ranking"]:
        figures = metrics["controllers"][name]
        margins = figures["margins"]
        table.add_row(
            name.upper(),
            number(figures["cost_mean"], 2),
            number(figures["cost_median"], 2),
            number(figures["cost_quantile_95"], 2),
            number(figures["heading_rmse_deg_mean"], 2),
            number(figures["rudder_travel_deg_min_mean"], 1),
            _margin(margins, "gain_margin", 2),
            _margin(margins, "phase_margin_deg", 1),
            str(figures["lost_control"]),
        )
    return table


def _margin(margins: Mapping[str, Any], name: str, decimals: int) -> str:
    """A margin of an autopilot: inf where it is unbounded."""
    return "inf" if margins[name] is None else number(margins[name], decimals)
