"""Figures of an identification: the regression, its residuals, rank, and the trials."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.covariance import residuals
from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.diagnostics import autocorrelation, without_overlap
from identification.judging.fit import Fit
from identification.judging.warnings import EQUATIONS
from identification.report.predictions import overview_figure, prediction_figure
from shipgym.arrays import Integers
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.plots import Panel, axis, compact, graph_objects, line, panels, points
from shipgym.plots.style import LIMIT, MEASURED, MODEL, MUTED, Figure

UNITS = {"u": "m/s²", "v": "m/s²", "r": "deg/s²", "p": "deg/s²"}


def plots(fit: Fit) -> dict[str, Figure]:
    """Figures of an identification and of what its model predicts.

    Raises InputError if plotly is not installed.

    Returns
    -------
    dict of str to plotly.graph_objects.Figure
        "fit", "residuals" (autocorrelation), "l-curve" for the method that has one,
        "trials", and "prediction: NAME" for each trial held out.
    """
    found = regression_figures(fit)
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    overview = overview_figure(fitted, fit.predictions)
    if overview is not None:
        found["trials"] = overview
    for trial in fit.trials:
        if trial.use == "validate":
            predicted = fit.predictions[trial.name]
            title = f"prediction: {trial.name}"
            found[title] = prediction_figure(trial, predicted)
    return found


def regression_figures(fit: Fit) -> dict[str, Figure]:
    """Figures of the regression by name; "l-curve" only where a rank was chosen."""
    found = {"fit": fit_figure(fit)}
    found["residuals"] = residual_figure(fit)
    curves = with_a_rank(fit)
    if curves:
        found["l-curve"] = l_curve_figure(curves)
    return found


def fit_figure(fit: Fit) -> Figure:
    """Mean acceleration over each window, as measured and as the regression has it."""
    samples = fit.samples
    most_rows = 2500  # drawn of one equation
    drawn = slice(None, None, max(len(samples) // most_rows, 1))
    breaks = np.flatnonzero(np.diff(samples.trial[drawn])) + 1
    shown = []
    for q, estimator in fit.estimators.items():
        unit = np.degrees(1.0) if q in "rp" else 1.0
        explained = estimator.predict(samples.features[q])
        lines = []
        for change, name, colour, width in (
            (samples.targets[q], "trials", MEASURED, 1.2),
            (explained, "regression", MODEL, 1.7),
        ):
            acceleration = (change * unit / samples.duration)[drawn]
            gapped = np.insert(acceleration, breaks, np.nan)  # between the trials
            lines.append(line(np.arange(len(gapped)), gapped, name, colour, width))
        title = axis(f"{EQUATIONS[q]}, {UNITS[q]}", nticks=5)
        shown.append(Panel(lines, "window, trial after trial", title))
    return panels(shown, 190 * len(shown) + 80, 1, outer=True, hovermode="closest")


def residual_figure(fit: Fit) -> Figure:
    """Autocorrelation of the residuals, with 95 % bounds of white noise."""
    rows = without_overlap(fit.samples)
    bound = NORMAL_95 / np.sqrt(len(rows))
    most = 24  # windows
    shown = []
    for q, error in residuals(fit.estimators, fit.samples).items():
        own = autocorrelation(error[rows], most)
        lags = np.arange(1, len(own) + 1)
        shown.append(_bars_panel(lags, own, bound, EQUATIONS[q]))
    return panels(
        shown, 170 * len(shown) + 100, 1, outer=True, hovermode="closest", bargap=0.5
    )


def _bars_panel(lags: Integers, values: ArrayLike, bound: float, beside: str) -> Panel:
    """Correlations by their lags, with the bounds of white noise."""
    bars = graph_objects().Bar(
        x=lags,
        y=compact(values),
        marker={"color": MODEL},
        showlegend=False,
        hovertemplate="lag %{x}: %{y:.2f}<extra></extra>",
    )
    traces = [bars]
    ends = [lags[0] - 0.5, lags[-1] + 0.5]
    for level in (-bound, bound):
        dashed = line(
            ends,
            [level] * 2,
            "95 % bounds of white noise",
            LIMIT,
            1.2,
            line_dash="dash",
        )
        traces.append(dashed)

    largest = float(np.max(np.abs(values), initial=0.0))
    reach = min(max(1.1 * largest, 3.0 * bound), 1.05)
    return Panel(traces, "lag, windows", axis(beside, range=[-reach, reach]))


def with_a_rank(fit: Fit) -> dict[str, TruncatedLSSVM]:
    """The estimators, by equation, that chose or were given a rank."""
    found = {}
    for q, estimator in fit.estimators.items():
        if not isinstance(estimator, TruncatedLSSVM):
            continue
        full = estimator.selection == "full" and estimator.rank is None
        if not full:
            found[q] = estimator
    return found


def l_curve_figure(estimators: Mapping[str, TruncatedLSSVM]) -> Figure:
    """Size of residuals and of solution for every rank, one panel for each equation."""
    shown = [_l_curve_panel(q, estimator) for q, estimator in estimators.items()]
    return panels(
        shown,
        360,
        len(shown),
        outer=True,
        grid={"horizontal_spacing": 0.09},
        left=70,
        hovermode="closest",
    )


def _l_curve_panel(q: str, estimator: TruncatedLSSVM) -> Panel:
    curve, rank = estimator.l_curve_, estimator.rank_
    x = compact(curve.residual_norm)
    y = compact(curve.solution_norm)
    ranks = [str(k) for k in range(1, len(x) + 1)]
    all_ranks = line(
        x,
        y,
        "rank 1, 2, ...",
        MUTED,
        1.2,
        "lines+markers",
        marker={"color": MUTED, "size": 5},
        text=ranks,
        hovertemplate="rank %{text}<extra></extra>",
    )
    own = slice(rank - 1, rank)
    decades: dict[str, Any] = {"type": "log", "tickformat": "~g", "nticks": 6}
    chosen = points(
        x[own],
        y[own],
        "chosen",
        LIMIT,
        9,
        hoverinfo="skip",
        cliponaxis=False,
    )
    return Panel(
        [all_ranks, chosen],
        axis("norm of the residuals", **decades),
        axis("norm of the solution", **decades),
        f"{EQUATIONS[q]}: rank {rank} of {len(x)}",
    )
