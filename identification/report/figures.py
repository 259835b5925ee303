"""Figures of a fit: regression, residuals, choice of rank and of C, and intervals of the coefficients."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.estimators.lssvm import TruncatedLSSVM
from identification.fit import Fit
from identification.report.predictions import overview_figure, prediction_figure
from identification.search.search import BAND, LOG_C
from identification.uncertainty.covariance import residuals
from identification.validation.diagnostics import (
    autocorrelation,
    cross_correlation,
    without_overlap,
)
from identification.validation.warnings import EQUATIONS
from shipgym.arrays import Floats
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
from shipgym.plots.style import LIMIT, MEASURED, MODEL, MUTED, PALETTE, Figure

UNITS = {"u": "m/s²", "v": "m/s²", "r": "deg/s²", "p": "deg/s²"}
MOST_ROWS = 2500  # drawn of one equation
LAGS = 24  # windows
NORMAL_95 = 1.96
SHOWN = (-1.5, 3.5)  # of an interval, by the size of the coefficient


def all_figures(fit: Fit) -> dict[str, Figure]:
    """Every figure of a fit by its name; see `IdentificationResult.plots`."""
    found = regression_figures(fit) | {"coefficients": coefficients_figure(fit)}
    overview = overview_figure(
        [trial for trial in fit.trials if trial.use == "fit"], fit.predictions
    )
    if overview is not None:
        found["trials"] = overview
    held = [trial for trial in fit.trials if trial.use == "validate"]
    return found | {
        f"prediction: {t.name}": prediction_figure(t, fit.predictions[t.name])
        for t in held
    }


def regression_figures(fit: Fit) -> dict[str, Figure]:
    """Figures of the regression by name; "l-curve" and "search" only where a method has one."""
    found = {"fit": fit_figure(fit), "residuals": residual_figure(fit)}
    if truncated(fit):
        found["l-curve"] = l_curve_figure(fit)
    if fit.searches:
        found["search"] = search_figure(fit)
    return found


def fit_figure(fit: Fit) -> Figure:
    """Mean acceleration over each window, as the trials have it and as the regression explains it."""
    samples, shown = fit.samples, []
    drawn = slice(None, None, max(len(samples) // MOST_ROWS, 1))
    breaks = np.flatnonzero(np.diff(samples.trial[drawn])) + 1
    for q, estimator in fit.estimators.items():
        factor = (np.degrees(1.0) if q in "rp" else 1.0) / samples.duration
        measured = (samples.targets[q] * factor)[drawn]
        explained = (estimator.predict(samples.features[q]) * factor)[drawn]
        windows = np.arange(len(measured) + len(breaks))
        lines = [  # with gaps between the trials
            line(windows, np.insert(measured, breaks, np.nan), "trials", MEASURED, 1.2),
            line(
                windows, np.insert(explained, breaks, np.nan), "regression", MODEL, 1.7
            ),
        ]
        ends = [
            min(measured.min(), explained.min()),
            max(measured.max(), explained.max()),
        ]
        cloud = [
            points(
                explained,
                measured,
                "",
                translucent(MODEL, 0.35),
                4,
                showlegend=False,
                hoverinfo="skip",
            ),
            line(ends, ends, "equal", MUTED, 1.0, showlegend=False),
        ]
        shown.append(
            Panel(
                lines,
                "window, trial after trial",
                axis(f"{EQUATIONS[q]}, {UNITS[q]}", nticks=5),
            )
        )
        shown.append(Panel(cloud, axis("regression", nticks=4), axis(nticks=5)))
    grid = {
        "column_widths": [0.7, 0.3],
        "horizontal_spacing": 0.1,
        "vertical_spacing": 0.48 / len(shown),
    }
    return panels(
        shown, 95 * len(shown) + 80, 2, outer=True, grid=grid, hovermode="closest"
    )


def residual_figure(fit: Fit) -> Figure:
    """Autocorrelation of the residuals and their cross-correlation with the rudder, with 95 % bounds."""
    errors, rows = residuals(fit.estimators, fit.samples), without_overlap(fit.samples)
    rudder, lags = rudder_at_windows(fit), np.arange(-LAGS, LAGS + 1)
    bound, shown = NORMAL_95 / np.sqrt(len(rows)), []
    for k, q in enumerate(fit.estimators):
        own, title = (
            autocorrelation(errors[q][rows], LAGS),
            "" if k else "with themselves",
        )
        shown.append(_bars(np.arange(1, len(own) + 1), own, bound, EQUATIONS[q], title))
        if rudder is not None:
            found = cross_correlation(errors[q][rows], rudder[rows], lags)
            shown.append(_bars(lags, found, bound, "", "" if k else "with the rudder"))
    columns = 1 if rudder is None else 2
    grid = {"horizontal_spacing": 0.1, "vertical_spacing": 0.24 / len(fit.estimators)}
    height = 170 * len(fit.estimators) + 100
    return panels(
        shown, height, columns, outer=True, grid=grid, hovermode="closest", bargap=0.5
    )


def _bars(
    lags: NDArray[Any], values: Any, bound: float, beside: str, title: str
) -> Panel:
    """Correlations by their lags, with the bounds of white noise."""
    hover, ends = "lag %{x}: %{y:.2f}<extra></extra>", [lags[0] - 0.5, lags[-1] + 0.5]
    style = {"marker": {"color": MODEL}, "showlegend": False, "hovertemplate": hover}
    bars = graph_objects().Bar(x=lags, y=compact(values), **style)
    name = "95 % bounds of white noise"
    bounds = [
        line(ends, [at, at], name, LIMIT, 1.2, line_dash="dash")
        for at in (-bound, bound)
    ]
    largest = min(
        max(1.1 * float(np.max(np.abs(values), initial=0.0)), 3.0 * bound), 1.05
    )
    return Panel(
        [bars, *bounds], "lag, windows", axis(beside, range=[-largest, largest]), title
    )


def rudder_at_windows(fit: Fit) -> Floats | None:
    """Rudder in the middle of each row's window, rad; None where a trial has none."""
    samples, used = fit.samples, [trial for trial in fit.trials if trial.use == "fit"]
    if not all("delta" in trial for trial in used):
        return None
    middle, angles = samples.start + 0.5 * samples.duration, np.empty(len(samples))
    for k, trial in enumerate(used):
        own = samples.trial == k
        angles[own] = np.interp(middle[own], trial.t, trial["delta"])
    return angles


def truncated(fit: Fit) -> dict[str, TruncatedLSSVM]:
    """The estimators, by equation, that chose or were given a rank."""
    own = {
        q: one for q, one in fit.estimators.items() if isinstance(one, TruncatedLSSVM)
    }
    return {
        q: one
        for q, one in own.items()
        if one.selection != "full" or one.rank is not None
    }


def l_curve_figure(fit: Fit) -> Figure:
    """Size of residuals and of solution for every rank, one panel for each equation."""
    shown = []
    for q, estimator in truncated(fit).items():
        curve, rank = estimator.l_curve_, estimator.rank_
        x, y = compact(curve.residual_norm), compact(curve.solution_norm)
        ranks = [str(k) for k in range(1, len(x) + 1)]
        hover = {"text": ranks, "hovertemplate": "rank %{text}<extra></extra>"}
        mark = {"color": MUTED, "size": 5}
        chosen = {"hoverinfo": "skip", "cliponaxis": False}
        traces = [
            line(
                x,
                y,
                "rank 1, 2, ...",
                MUTED,
                1.2,
                "lines+markers",
                marker=mark,
                **hover,
            ),
            points(
                x[rank - 1 : rank], y[rank - 1 : rank], "chosen", LIMIT, 9, **chosen
            ),
        ]
        axes = (
            _logarithmic("norm of the residuals", x),
            _logarithmic("norm of the solution", y),
        )
        shown.append(Panel(traces, *axes, f"{EQUATIONS[q]}: rank {rank} of {len(x)}"))
    grid = {"horizontal_spacing": 0.09}
    return panels(
        shown, 360, len(shown), outer=True, grid=grid, left=70, hovermode="closest"
    )


def _logarithmic(title: str, values: NDArray[np.float32]) -> dict[str, Any]:
    """An axis in decades, or in steps of 1, 2, 5 where there are few."""
    few = (
        float(np.log10(values.max() / max(values.min(), np.finfo(np.float32).tiny)))
        < 2.0
    )
    return axis(title, type="log", dtick="D2" if few else 1, tickformat="~g")


def search_figure(fit: Fit) -> Figure:
    """What a search had found after each of its rounds: objective, and weight C or insensitive band."""
    searches = {EQUATIONS.get(q, q): search for q, search in fit.searches.items()}
    logarithmic = all(search.variable == LOG_C for search in searches.values())
    common = (
        len({id(search.history) for search in searches.values()}) == 1
    )  # one search for all
    objectives, best = list[Any](), list[Any]()
    for (name, search), colour in zip(searches.items(), PALETTE, strict=False):
        rounds = np.arange(len(search.history))
        relative = search.history / (search.value if search.value > 0.0 else 1.0)
        if not objectives or not common:
            objectives.append(line(rounds, relative, name, colour, showlegend=False))
        values = 10.0 ** search.course[:, 0] if logarithmic else search.course[:, 0]
        best.append(line(rounds, values, name, colour))
    round_axis = axis("round", rangemode="tozero")
    own = axis(type="log", tickformat=".0e") if logarithmic else axis(range=[0.0, 1.0])
    left = Panel(
        objectives, round_axis, axis(), "best objective, relative to the final one"
    )
    right = Panel(best, round_axis, own, "best C" if logarithmic else f"best {BAND}")
    return panels(
        [left, right], 340, 2, grid={"horizontal_spacing": 0.1}, hovermode="closest"
    )


def coefficients_figure(fit: Fit) -> Figure:
    """95 % interval of each coefficient by its size; one that reaches 0 is not significant."""
    names, shown = list(fit.coefficients), []
    values = np.array(list(fit.coefficients.values()))
    errors = np.array(list(fit.standard_errors.values()))
    half = (
        NORMAL_95 * np.nan_to_num(errors) / np.where(values == 0.0, 1.0, np.abs(values))
    )
    significant = (half < 1.0) & (values != 0.0)
    columns = 1 if len(names) < 12 else 2
    rows = -(-len(names) // columns)
    shares = axis(
        "per cent of the estimate",
        range=[-130, 330],
        zeroline=True,
        zerolinecolor=LIMIT,
    )
    for first in range(0, columns * rows, rows):
        places = np.arange(first, min(first + rows, len(names)))
        traces = []
        for sure, name, colour in (
            (True, "significant", MODEL),
            (False, "not significant", "#b3bcc7"),
        ):
            own = places[significant[places] == sure]
            centre = np.sign(values[own]) ** 2
            low, high = (
                np.clip(centre + side * half[own], *SHOWN) for side in (-1.0, 1.0)
            )
            ends = {
                "array": compact(100.0 * (high - centre)),
                "arrayminus": compact(100.0 * (centre - low)),
            }
            bars = {
                "type": "data",
                "symmetric": False,
                **ends,
                "color": colour,
                "thickness": 1.8,
                "width": 3,
            }
            told = [f"{names[i]}: ± {100.0 * half[i]:.3g} %" for i in own]
            dots = points(
                100.0 * centre, own - first, name, colour, error_x=bars, text=told
            )
            traces.append(dots.update(hovertemplate="%{text}<extra></extra>"))
        marks = [names[i] for i in places]
        labels = axis(
            tickvals=list(range(len(marks))), ticktext=marks, range=[rows - 0.5, -0.5]
        )
        shown.append(Panel(traces, shares, labels))
    grid = {"horizontal_spacing": 0.16}
    return panels(
        shown, 20 * rows + 110, columns, grid=grid, left=84, hovermode="closest"
    )
