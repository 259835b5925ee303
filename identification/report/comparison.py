"""The page of a comparison of methods: ranking, errors of each trial, and the trials as predicted."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from identification.validation.ranking import Ranking
from shipgym.arrays import Floats
from shipgym.pages import render
from shipgym.plots import PALETTE, axis, graph_objects, label, layout, line, panels

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


SHOWN = 4  # methods in a figure of predictions
LARGEST = 2.0  # error that the figure shows; larger ones lie on its edge


def comparison_page(comparison: Ranking) -> str:
    """The page, as text; the same comparison gives the same text.

    Raises InputError if plotly is not installed.
    """
    model = comparison.best.model
    return render(
        "identification.report/comparison.html",
        name=model.particulars.name or model.name,
        comparison=comparison,
        errors=errors_figure(comparison),
        largest=f"{LARGEST:g}",
        beyond=any((error or 0.0) > LARGEST for one in comparison.standings for error in one.errors.values()),
        headings=None if comparison.in_turn else headings_figure(comparison),
    )


def errors_figure(comparison: Ranking) -> Figure:
    """Error of each trial held out, one row for each method."""
    go = graph_objects()
    figure, names = go.Figure(), list(comparison.results)
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
    figure.update_layout(layout(height, left=96, hovermode="closest"))
    errors_axis = axis("error, in standard deviations of the measurement", rangemode="tozero")
    label(figure, errors_axis, axis(autorange="reversed"))
    return figure


def headings_figure(comparison: Ranking) -> Figure:
    """Error of the predicted heading over time, of the trials held out by the best methods."""
    held = [t for t in comparison.best.trials if t.use == "validate" and "psi" in t]
    figure, places, rows = panels([PurePath(trial.name).name for trial in held])
    best = list(comparison.results)[:SHOWN]
    for trial, place in zip(held, places, strict=True):
        for method, colour in zip(best, PALETTE, strict=False):
            prediction = comparison.results[method].predictions[trial.name]
            if prediction is not None:
                error = _smoothed(np.degrees(prediction["psi"] - trial["psi"]))
                time = _smoothed(trial.t)
                figure.add_trace(
                    line(time, error, method, colour, 1.5, showlegend=place is places[0]), **place
                )
        below, beside = "time, s" if place["row"] == rows else "", "deg" if place["col"] == 1 else ""
        label(figure, below, axis(beside, zero=True), **place)
    figure.update_layout(layout(230 * rows + 80, titled=True))
    return figure


def _smoothed(values: Floats) -> Floats:
    """Running means over a hundredth of the samples: compass noise would hide the rest."""
    width = max(len(values) // 100, 1)
    return np.convolve(values, np.full(width, 1.0 / width), "valid")
