"""The page of a comparison of methods: ranking, errors of each trial, and the trials as predicted."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.validation.ranking import RankedFit, Ranking
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.pages import render
from shipgym.plots import PALETTE, Panel, axis, graph_objects, line, panels
from shipgym.plots.style import Figure

LARGEST = 2.0  # error that the figure shows; larger ones lie on its edge


def comparison_page(comparison: Ranking) -> str:
    """The page, as text; the same comparison gives the same text.

    Raises InputError if plotly is not installed.
    """
    model, ranked = comparison.best.model, comparison.ranked
    ranked_on = "trials that had no part in the fit"
    if comparison.in_turn:
        ranked_on = "each trial held out in turn"
    ran_away = [fit.method for fit in ranked if fit.ran_away]
    return render(
        "identification.report/comparison.html",
        name=model.particulars.name or model.name,
        lead=f"{len(ranked)} fits, ranked on {ranked_on}.",
        verdict=_verdict(ranked[0]),
        ranked=ranked,
        errors=errors_figure(comparison),
        errors_notes=_errors_notes(ranked, ran_away),
        headings=None if comparison.in_turn else headings_figure(comparison),
        refused=comparison.refused,
    )


def _verdict(first: RankedFit) -> tuple[str, str]:
    """A sentence on the best fit, and whether it is good or bad."""
    if first.error is None or not first.stable:
        text = "No method gives a model that stays stable on every held-out trial."
        return text, "bad"
    text = (
        f"{first.structure} by {first.method} predicts best: error {first.error:.3f} of"
        " the measured standard deviation"
    )
    if first.heading_deg is not None:
        text += f", heading {first.heading_deg:.2f}° rms"
    return f"{text}.", "good"


def _errors_notes(ranked: tuple[RankedFit, ...], ran_away: list[str]) -> str:
    """What the figure of the errors does not show as it is."""
    errors = [error for fit in ranked for error in fit.errors.values()]
    beyond = any(error is not None and error > LARGEST for error in errors)
    notes = f"; those beyond {LARGEST:g} are drawn there." if beyond else "."
    if ran_away:
        notes += f" Ran away, and not drawn there: {', '.join(ran_away)}."
    return notes


def errors_figure(comparison: Ranking) -> Figure:
    """Error of each trial held out, one row for each method."""
    names = list(comparison.results)
    means = [
        None if fit.error is None else min(fit.error, LARGEST)
        for fit in comparison.ranked
    ]
    hover = "%{y}: %{x:.4f}<extra></extra>"
    bars = graph_objects().Bar(
        x=means,
        y=names,
        orientation="h",
        marker={"color": "#d5dde6"},
        name="mean",
        width=0.5,
        hovertemplate=hover,
    )
    traces = [bars]
    for number, trial in enumerate(comparison.ranked[0].errors):
        known = dict[str, float]()
        for name, fit in zip(names, comparison.ranked, strict=True):
            error = fit.errors.get(trial)
            if error is not None:
                known[name] = min(error, LARGEST)
        colour = PALETTE[number % len(PALETTE)]
        dots = graph_objects().Scatter(
            x=list(known.values()),
            y=list(known),
            name=PurePath(trial).name,
            cliponaxis=False,
            mode="markers",
            marker={"color": colour, "size": 8},
            hovertemplate=hover,
        )
        traces.append(dots)
    title = "error, in standard deviations of the measurement"
    panel = Panel(traces, axis(title, rangemode="tozero"), axis(autorange="reversed"))
    return panels([panel], 34 * len(names) + 130, left=96, hovermode="closest")


def headings_figure(comparison: Ranking) -> Figure:
    """Error of the predicted heading over time, of the trials held out by the best four methods."""
    best = list(comparison.results)[:4]
    shown = []
    for trial in comparison.best.trials:
        if trial.use == "validate" and "psi" in trial:
            predictions = {
                method: comparison.results[method].predictions[trial.name]
                for method in best
            }
            shown.append(_heading_panel(trial, predictions))
    rows = max(-(-len(shown) // 2), 1)  # rounded up
    return panels(shown, 230 * rows + 80, 2, outer=True)


def _heading_panel(trial: Trial, predictions: Mapping[str, Trial | None]) -> Panel:
    """Heading errors of the methods that sail a trial."""
    lines = list[Any]()
    for (method, run), colour in zip(predictions.items(), PALETTE, strict=False):
        if run is None:
            continue
        error = np.degrees(run["psi"] - trial["psi"])
        t = running_mean(trial.t)
        lines.append(line(t, running_mean(error), method, colour, 1.5))
    name = PurePath(trial.name).name
    return Panel(lines, "time, s", axis("deg", zero=True), name)


def running_mean(values: Floats) -> Floats:
    """Means over a hundredth of the samples: compass noise would hide the rest."""
    width = max(len(values) // 100, 1)
    weights = np.full(width, 1.0 / width)
    return np.convolve(values, weights, "valid")
