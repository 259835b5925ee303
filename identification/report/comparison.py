"""The page of a comparison of methods: ranking, errors, and the trials as predicted."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.ranking import RankedFit, Ranking
from identification.report.predictions import rows_of_two
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.pages import render
from shipgym.plots import PALETTE, Panel, axis, graph_objects, line, panels
from shipgym.plots.style import Figure

LARGEST = 2.0  # error that the figure shows; larger ones lie on its edge
HOVER = "%{y}: %{x:.4f}<extra></extra>"  # plotly's, of an error


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
    """Notes on what the figure of the errors does not show as it is."""
    notes = "."
    for fit in ranked:
        known = [error for error in fit.errors.values() if error is not None]
        if max(known, default=0.0) > LARGEST:
            notes = f"; those beyond {LARGEST:g} are drawn there."
    if ran_away:
        methods = ", ".join(ran_away)
        notes += f" Ran away, and not drawn there: {methods}."
    return notes


def errors_figure(comparison: Ranking) -> Figure:
    """Error of each trial held out, one row for each method."""
    names = list(comparison.results)
    traces = [_mean_bars(comparison.ranked, names)]
    for number, trial in enumerate(comparison.ranked[0].errors):
        colour = PALETTE[number % len(PALETTE)]
        dots = _trial_dots(comparison.ranked, names, trial, colour)
        traces.append(dots)
    panel = Panel(
        traces,
        x=axis("error, in standard deviations of the measurement", rangemode="tozero"),
        y=axis(autorange="reversed"),
    )
    n_methods = len(names)
    return panels(
        [panel],
        height=34 * n_methods + 130,
        left=96,
        hovermode="closest",
    )


def _mean_bars(ranked: Sequence[RankedFit], names: Sequence[str]) -> Any:
    """Mean error of each method, as a bar; none where it ran away."""
    means = [None if fit.error is None else min(fit.error, LARGEST) for fit in ranked]
    return graph_objects().Bar(
        x=means,
        y=names,
        orientation="h",
        marker={"color": "#d5dde6"},
        name="mean",
        width=0.5,
        hovertemplate=HOVER,
    )


def _trial_dots(
    ranked: Sequence[RankedFit], names: Sequence[str], trial: str, colour: str
) -> Any:
    """Errors of a trial by the methods that sail it, as dots."""
    known = dict[str, float]()
    for name, fit in zip(names, ranked, strict=True):
        error = fit.errors.get(trial)
        if error is not None:
            known[name] = min(error, LARGEST)
    return graph_objects().Scatter(
        x=list(known.values()),
        y=list(known),
        name=PurePath(trial).name,
        cliponaxis=False,
        mode="markers",
        marker={"color": colour, "size": 8},
        hovertemplate=HOVER,
    )


def headings_figure(comparison: Ranking) -> Figure:
    """Error of the heading over time, on trials held out, by the best four methods."""
    best = list(comparison.results)[:4]
    shown = []
    for trial in comparison.best.trials:
        if trial.use != "validate" or "psi" not in trial:
            continue
        predictions = {}
        for method in best:
            result = comparison.results[method]
            predictions[method] = result.predictions[trial.name]
        shown.append(_heading_panel(trial, predictions))
    rows = max(rows_of_two(shown), 1)
    return panels(shown, 230 * rows + 80, columns=2, outer=True)


def _heading_panel(trial: Trial, predictions: Mapping[str, Trial | None]) -> Panel:
    """Heading errors of the methods that sail a trial."""
    lines = list[Any]()
    t = running_mean(trial.t)
    for (method, run), colour in zip(predictions.items(), PALETTE, strict=False):
        if run is not None:
            error = np.degrees(run["psi"] - trial["psi"])
            lines.append(line(t, running_mean(error), method, colour, 1.5))
    return Panel(
        lines,
        x="time, s",
        y=axis("deg", zero=True),
        title=PurePath(trial.name).name,
    )


def running_mean(values: Floats) -> Floats:
    """Means over a hundredth of the samples: compass noise would hide the rest."""
    width = max(len(values) // 100, 1)
    weights = np.full(width, 1.0 / width)
    return np.convolve(values, weights, "valid")
