"""The page of a comparison of methods: ranking, errors of each trial, and the trials as predicted."""

from pathlib import PurePath

import numpy as np

from identification.validation.ranking import Ranking
from shipgym.arrays import Floats
from shipgym.pages import render
from shipgym.plots import PALETTE, Panel, axis, graph_objects, line, panels
from shipgym.plots.style import Figure

SHOWN = 4  # methods in a figure of predictions
LARGEST = 2.0  # error that the figure shows; larger ones lie on its edge


def comparison_page(comparison: Ranking) -> str:
    """The page, as text; the same comparison gives the same text.

    Raises InputError if plotly is not installed.
    """
    model = comparison.best.model
    beyond = any(
        (error or 0.0) > LARGEST
        for one in comparison.ranked
        for error in one.errors.values()
    )
    headings = None if comparison.in_turn else headings_figure(comparison)
    return render(
        "identification.report/comparison.html",
        name=model.particulars.name or model.name,
        comparison=comparison,
        errors=errors_figure(comparison),
        largest=f"{LARGEST:g}",
        beyond=beyond,
        headings=headings,
    )


def errors_figure(comparison: Ranking) -> Figure:
    """Error of each trial held out, one row for each method."""
    names, told = (
        list(comparison.results),
        {"hovertemplate": "%{y}: %{x:.4f}<extra></extra>"},
    )
    means = [
        min(s.error, LARGEST) if s.error is not None else None
        for s in comparison.ranked
    ]
    bar = {
        "orientation": "h",
        "marker": {"color": "#d5dde6"},
        "name": "mean",
        "width": 0.5,
        **told,
    }
    traces = [graph_objects().Bar(x=means, y=names, **bar)]
    for k, trial in enumerate(comparison.ranked[0].errors):
        errors = [s.errors.get(trial) for s in comparison.ranked]
        shown = {
            n: min(e, LARGEST)
            for n, e in zip(names, errors, strict=True)
            if e is not None
        }
        dots = {
            "mode": "markers",
            "marker": {"color": PALETTE[k % len(PALETTE)], "size": 8},
            **told,
        }
        x, y, name = list(shown.values()), list(shown), PurePath(trial).name
        traces.append(
            graph_objects().Scatter(x=x, y=y, name=name, cliponaxis=False, **dots)
        )
    errors_axis = axis(
        "error, in standard deviations of the measurement", rangemode="tozero"
    )
    panel = Panel(traces, errors_axis, axis(autorange="reversed"))
    return panels([panel], 34 * len(names) + 130, left=96, hovermode="closest")


def headings_figure(comparison: Ranking) -> Figure:
    """Error of the predicted heading over time, of the trials held out by the best methods."""
    held = [t for t in comparison.best.trials if t.use == "validate" and "psi" in t]
    best, shown = list(comparison.results)[:SHOWN], []
    for trial in held:
        lines = []
        for method, colour in zip(best, PALETTE, strict=False):
            if (
                prediction := comparison.results[method].predictions[trial.name]
            ) is not None:
                error = _smoothed(np.degrees(prediction["psi"] - trial["psi"]))
                lines.append(line(_smoothed(trial.t), error, method, colour, 1.5))
        shown.append(
            Panel(lines, "time, s", axis("deg", zero=True), PurePath(trial.name).name)
        )
    return panels(shown, 230 * max(-(-len(shown) // 2), 1) + 80, 2, outer=True)


def _smoothed(values: Floats) -> Floats:
    """Running means over a hundredth of the samples: compass noise would hide the rest."""
    width = max(len(values) // 100, 1)
    return np.convolve(values, np.full(width, 1.0 / width), "valid")
