"""The page of a comparison of methods: ranking, errors of each trial, and the trials as predicted."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identification.report.predictions import legend_above
from shipgym.pages import (
    Html,
    badge,
    figure,
    fixed,
    header,
    html,
    note,
    page,
    section,
    table,
    verdict,
)
from shipgym.plots import PALETTE, axis, graph_objects, layout, line, subplots

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from identification.validation.comparison import Comparison, Standing

Floats = NDArray[np.float64]

TITLES = {
    "verdict": "Verdict",
    "ranking": "Ranking",
    "prediction": "Trials held out",
    "refused": "Not fitted",
}
SHOWN = 4  # methods in a figure of predictions
LARGEST = 2.0  # error that the figure shows; larger ones lie on its edge


def comparison_page(comparison: Comparison) -> str:
    """The page, as text; the same comparison gives the same text.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    model = comparison.best.model
    name = model.particulars.name or model.name
    body = {
        "header": header("Methods of identification compared", name, _lead(comparison)),
        "verdict": _verdict(comparison),
        "ranking": section(
            "ranking",
            TITLES["ranking"],
            _table(comparison),
            figure(errors_figure(comparison), "errors", _error_caption(comparison)),
        ),
    }
    if not comparison.in_turn:
        body["prediction"] = _predictions(comparison)
    if comparison.refused:
        reasons = (note(f"{name}: {reason}", "warn") for name, reason in comparison.refused.items())
        body["refused"] = section("refused", TITLES["refused"], *reasons)
    return page(f"{name}: methods compared", body, TITLES)


def _lead(comparison: Comparison) -> str:
    held = "each trial held out in turn" if comparison.in_turn else "trials that had no part in the fit"
    structure = comparison.best.settings["structure"]
    return f"Structure {structure}; {len(comparison.standings)} methods, ranked on {held}."


def _verdict(comparison: Comparison) -> Html:
    first = comparison.standings[0]
    if first.error is None or not first.stable:
        return verdict("No method gives a model that stays stable on every trial held out.", "bad")
    sentence = f"{first.method} predicts best: error {first.error:.3f} of the measured spread"
    heading = f", heading {first.heading_deg:.2f}° rms" if first.heading_deg is not None else ""
    return verdict(f"{sentence}{heading}.", "good")


def _table(comparison: Comparison) -> Html:
    rows = [
        [k, standing.method, _mark(standing), fixed(standing.error, 4), fixed(standing.heading_deg, 2),
         fixed(standing.yaw_rate_deg_s, 4), standing.ran_away]
        for k, standing in enumerate(comparison.standings, start=1)
    ]  # fmt: skip
    head = ["", "method", "model", "error", "heading, deg", "yaw rate, deg/s", "ran away"]
    caption = (
        "Error: of the simulated surge, sway, yaw rate and heading by the standard deviation of what was "
        "measured, mean over channels and trials held out; 1 is no better than a constant. Heading and yaw "
        "rate: root mean square error, mean over the trials on which the simulation did not run away."
    )
    return table(head, rows, text_columns=3, caption=caption)


def _mark(standing: Standing) -> Html:
    return badge("stable", "good") if standing.stable else badge("unstable", "bad")


def _error_caption(comparison: Comparison) -> Html:
    ran = [s.method for s in comparison.standings if s.ran_away]
    lost = f" Ran away, and not drawn there: {', '.join(ran)}." if ran else ""
    return html(
        "Error of each trial held out (dots) and their mean (bar), the best method on top; those beyond "
        f"{LARGEST:g} are drawn there.{lost}"
    )


def errors_figure(comparison: Comparison) -> Figure:
    """Error of each trial held out, one row for each method."""
    go = graph_objects()
    figure, names = go.Figure(), [standing.method for standing in comparison.standings]
    trials = list(comparison.standings[0].errors)
    means = [min(s.error, LARGEST) if s.error is not None else None for s in comparison.standings]
    figure.add_trace(
        go.Bar(
            x=means, y=names, orientation="h", marker={"color": "#d5dde6"}, name="mean", width=0.5,
            hovertemplate="%{y}: %{x:.4f}<extra></extra>",
        )
    )  # fmt: skip
    for k, trial in enumerate(trials):
        errors = [s.errors.get(trial) for s in comparison.standings]
        shown = [(n, min(e, LARGEST)) for n, e in zip(names, errors, strict=True) if e is not None]
        figure.add_trace(
            go.Scatter(
                x=[e for _, e in shown], y=[n for n, _ in shown], mode="markers",
                name=PurePath(trial).name, marker={"color": PALETTE[k % len(PALETTE)], "size": 8},
                hovertemplate="%{y}: %{x:.4f}<extra></extra>", cliponaxis=False,
            )
        )  # fmt: skip
    height = 34 * len(names) + 130
    margin = {"l": 96, "r": 18, "t": 40, "b": 48}
    figure.update_layout(layout(height, margin=margin, legend=legend_above(height, 8), hovermode="closest"))
    figure.update_xaxes(axis("error by the spread of the measurement", rangemode="tozero"))
    figure.update_yaxes(axis("", autorange="reversed"))
    return figure


def _predictions(comparison: Comparison) -> Html:
    caption = (
        "What the best methods predict of the heading from the measured rudder and the initial state alone, "
        "less what was measured, as running means over a hundredth of the trial; degrees, seconds."
    )
    return section(
        "prediction", TITLES["prediction"], figure(headings_figure(comparison), "headings", caption)
    )


def headings_figure(comparison: Comparison) -> Figure:
    """Error of the predicted heading over time, of the trials held out by the best methods."""
    held = [t for t in comparison.best.trials if t.use == "validate" and "psi" in t]
    rows = max(-(-len(held) // 2), 1)
    figure = subplots(
        rows, 2, titles=[PurePath(trial.name).name for trial in held], vertical_spacing=0.36 / max(rows, 2)
    )
    best = [standing.method for standing in comparison.standings[:SHOWN]]
    for k, trial in enumerate(held):
        place = {"row": k // 2 + 1, "col": k % 2 + 1}
        for method, colour in zip(best, PALETTE, strict=False):
            prediction = comparison.results[method].predictions[trial.name]
            if prediction is not None:
                error = _calmed(np.degrees(prediction["psi"] - trial["psi"]))
                time = _calmed(trial.t)
                figure.add_trace(line(time, error, method, colour, 1.5, showlegend=k == 0), **place)
        figure.update_xaxes(axis("time, s" if place["row"] == rows else ""), **place)
        figure.update_yaxes(axis("deg" if place["col"] == 1 else "", zeroline=True), **place)
    height = 230 * rows + 80
    margin = {"l": 62, "r": 18, "t": 60, "b": 44}
    figure.update_layout(layout(height, margin=margin, legend=legend_above(height)))
    return figure


def _calmed(values: Floats) -> Floats:
    """Running means over a hundredth of the samples: the noise of the compass would hide the rest."""
    width = max(len(values) // 100, 1)
    return np.convolve(values, np.full(width, 1.0 / width), "valid")
