"""Figures of a regression: accelerations measured and explained, and the residuals."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.covariance import residuals
from identification.judging.diagnostics import (
    autocorrelation,
    cross_correlation,
    without_overlap,
)
from identification.judging.fit import Fit
from identification.judging.warnings import EQUATIONS
from identification.report.choice_figures import (
    l_curve_figure,
    search_figure,
    truncated,
)
from identification.report.coefficient_figure import coefficients_figure
from identification.report.predictions import overview_figure, prediction_figure
from shipgym.arrays import Floats, Integers
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.plots import (
    Panel,
    axis,
    compact,
    graph_objects,
    line,
    panels,
    points,
    translucent,
)
from shipgym.plots.style import LIMIT, MEASURED, MODEL, MUTED, Figure

UNITS = {"u": "m/s²", "v": "m/s²", "r": "deg/s²", "p": "deg/s²"}


def plots(fit: Fit) -> dict[str, Figure]:
    """Figures of an identification and of what its model predicts.

    Raises InputError if plotly is not installed.

    Returns
    -------
    dict of str to plotly.graph_objects.Figure
        "fit", "residuals" (autocorrelation, and cross-correlation with the rudder),
        "l-curve" for the method that has one, "coefficients", "trials", and
        "prediction: NAME" for each trial held out.
    """
    found = regression_figures(fit)
    found["coefficients"] = coefficients_figure(fit)
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
    """Figures of the regression by name.

    "l-curve" and "search" only where a method has one.
    """
    found = {"fit": fit_figure(fit), "residuals": residual_figure(fit)}
    curves = truncated(fit)
    if curves:
        found["l-curve"] = l_curve_figure(curves)
    if fit.searches:
        found["search"] = search_figure(fit.searches)
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
    trial = samples.trial[drawn]
    breaks = np.flatnonzero(np.diff(trial)) + 1
    shown = []
    for q in fit.estimators:
        accelerations = mean_accelerations(fit, q, drawn)
        title = f"{EQUATIONS[q]}, {UNITS[q]}"
        shown.append(_history_panel(accelerations, breaks, title))
        shown.append(_cloud_panel(accelerations))
    grid = {
        "column_widths": [0.7, 0.3],
        "horizontal_spacing": 0.1,
        "vertical_spacing": 0.48 / len(shown),
    }
    return panels(
        shown,
        height=95 * len(shown) + 80,
        columns=2,
        outer=True,
        grid=grid,
        hovermode="closest",
    )


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


def _history_panel(found: WindowAccelerations, breaks: Integers, title: str) -> Panel:
    """Accelerations window after window, with gaps between the trials."""
    measured = np.insert(found.measured, breaks, np.nan)
    explained = np.insert(found.explained, breaks, np.nan)
    windows = np.arange(len(measured))
    lines = [
        line(windows, measured, "trials", MEASURED, 1.2),
        line(windows, explained, "regression", MODEL, 1.7),
    ]
    return Panel(
        lines,
        x="window, trial after trial",
        y=axis(title, nticks=5),
    )


def _cloud_panel(found: WindowAccelerations) -> Panel:
    """Measured over explained accelerations, with the line of equality."""
    both = np.concatenate(found)
    ends = [both.min(), both.max()]
    cloud = points(
        found.explained,
        found.measured,
        "",
        translucent(MODEL, 0.35),
        4,
        showlegend=False,
        hoverinfo="skip",
    )
    equal = line(ends, ends, "equal", MUTED, 1.0, showlegend=False)
    return Panel([cloud, equal], axis("regression", nticks=4), axis(nticks=5))


def residual_figure(fit: Fit) -> Figure:
    """Autocorrelation of the residuals and their cross-correlation with the rudder.

    With 95 % bounds of white noise.
    """
    errors = residuals(fit.estimators, fit.samples)
    rows = without_overlap(fit.samples)
    rudder = rudder_at_windows(fit)
    bound = NORMAL_95 / np.sqrt(len(rows))
    most = 24  # windows
    lags = np.arange(-most, most + 1)

    shown = []
    own_title, rudder_title = "with themselves", "with the rudder"
    for q, error in errors.items():
        own = autocorrelation(error[rows], most)
        after = np.arange(1, len(own) + 1)
        panel = _bars_panel(after, own, bound, EQUATIONS[q], own_title)
        shown.append(panel)
        if rudder is not None:
            found = cross_correlation(error[rows], rudder[rows], lags)
            panel = _bars_panel(lags, found, bound, "", rudder_title)
            shown.append(panel)
        own_title = rudder_title = ""  # above the first row only

    count = len(errors)
    return panels(
        shown,
        height=170 * count + 100,
        columns=1 if rudder is None else 2,
        outer=True,
        grid={
            "horizontal_spacing": 0.1,
            "vertical_spacing": 0.24 / count,
        },
        hovermode="closest",
        bargap=0.5,
    )


def _bars_panel(
    lags: Integers, values: ArrayLike, bound: float, beside: str, title: str
) -> Panel:
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
    return Panel(traces, "lag, windows", axis(beside, range=[-reach, reach]), title)


def rudder_at_windows(fit: Fit) -> Floats | None:
    """Rudder in the middle of each row's window, rad; None where a trial has none."""
    samples = fit.samples
    used = [trial for trial in fit.trials if trial.use == "fit"]
    middle = samples.start + 0.5 * samples.duration
    angles = np.empty(len(samples))
    for index, trial in enumerate(used):
        if "delta" not in trial:
            return None
        rows = samples.trial == index
        times = middle[rows]
        angles[rows] = np.interp(times, trial.t, trial["delta"])
    return angles
