"""Figures of an identification: the regression, its residuals, rank, and the trials."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identification.estimators.covariance import residuals
from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.diagnostics import autocorrelation, without_overlap
from identification.judging.fit import Fit
from identification.judging.warnings import EQUATIONS
from identification.report.predictions import overview_figure, prediction_figure
from shipgym.arrays import Floats, Integers
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


class WindowAccelerations(NamedTuple):
    """Mean acceleration of some windows, m/s^2 or deg/s^2."""

    measured: Floats
    explained: Floats


def fit_figure(fit: Fit) -> Figure:
    """Mean acceleration over each window, as measured and as the regression has it."""
    samples = fit.samples
    most_rows = 2500  # drawn of one equation
    every = max(len(samples) // most_rows, 1)
    drawn = slice(None, None, every)
    breaks = np.flatnonzero(np.diff(samples.trial[drawn])) + 1
    shown = []
    for q in fit.estimators:
        found = mean_accelerations(fit, q, drawn)
        measured = np.insert(found.measured, breaks, np.nan)  # gaps between the trials
        explained = np.insert(found.explained, breaks, np.nan)
        windows = np.arange(len(measured))
        lines = [
            line(windows, measured, "trials", MEASURED, 1.2),
            line(windows, explained, "regression", MODEL, 1.7),
        ]
        title = axis(f"{EQUATIONS[q]}, {UNITS[q]}", nticks=5)
        shown.append(Panel(lines, "window, trial after trial", title))
    return panels(shown, 190 * len(shown) + 80, 1, outer=True, hovermode="closest")


def mean_accelerations(fit: Fit, q: str, rows: slice) -> WindowAccelerations:
    """Mean accelerations of an equation over some windows."""
    samples = fit.samples
    unit = np.degrees(1.0) if q in "rp" else 1.0
    factor = unit / samples.duration
    explained = fit.estimators[q].predict(samples.features[q])
    measured = samples.targets[q]
    return WindowAccelerations(
        measured=(measured * factor)[rows],
        explained=(explained * factor)[rows],
    )


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
        name = "95 % bounds of white noise"
        traces.append(line(ends, [level] * 2, name, LIMIT, 1.2, line_dash="dash"))

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
        _logarithmic("norm of the residuals", x),
        _logarithmic("norm of the solution", y),
        f"{EQUATIONS[q]}: rank {rank} of {len(x)}",
    )


def _logarithmic(title: str, values: NDArray[np.float32]) -> dict[str, Any]:
    """An axis in decades, or in steps of 1, 2, 5 where there are few."""
    positive = np.finfo(np.float32).tiny
    smallest = max(values.min(), positive)
    few_decades = values.max() < 100.0 * smallest
    return axis(
        title,
        type="log",
        dtick="D2" if few_decades else 1,
        tickformat="~g",
    )
