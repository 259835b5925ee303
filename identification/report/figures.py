"""Figures of a fit: regression, residuals, choice of rank and of C, and intervals of the coefficients."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from identification.estimators.lssvm import TruncatedLSSVM
from identification.fit import Fit
from identification.report.predictions import overview_figure, prediction_figure
from identification.search.search import BAND, LOG_C
from identification.uncertainty.covariance import residuals
from identification.validation.diagnostics import autocorrelation, cross_correlation, without_overlap
from identification.validation.warnings import EQUATIONS
from shipgym.arrays import Floats
from shipgym.plots import (
    LIMIT,
    MEASURED,
    MODEL,
    MUTED,
    PALETTE,
    axis,
    compact,
    graph_objects,
    label,
    layout,
    line,
    subplots,
    translucent,
)

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


UNITS = {"u": "m/s²", "v": "m/s²", "r": "deg/s²", "p": "deg/s²"}
MOST_ROWS = 2500  # drawn of one equation
LAGS = 24  # windows
NORMAL_95 = 1.96
SHOWN = (-1.5, 3.5)  # of an interval, by the size of the coefficient


def all_figures(fit: Fit) -> dict[str, Figure]:
    """Every figure of a fit by its name; see `IdentificationResult.plots`."""
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    found = regression_figures(fit) | {"coefficients": coefficients_figure(fit)}
    overview = overview_figure(fitted, fit.predictions)
    if overview is not None:
        found["trials"] = overview
    return found | {
        f"prediction: {trial.name}": prediction_figure(trial, fit.predictions[trial.name])
        for trial in fit.trials
        if trial.use == "validate"
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
    samples, equations = fit.samples, list(fit.estimators)
    figure = subplots(
        len(equations), 2, column_widths=[0.7, 0.3], horizontal_spacing=0.1,
        vertical_spacing=0.24 / len(equations),
    )  # fmt: skip
    drawn = slice(None, None, max(len(samples) // MOST_ROWS, 1))
    breaks = np.flatnonzero(np.diff(samples.trial[drawn])) + 1
    for row, q in enumerate(equations, start=1):
        factor = (np.degrees(1.0) if q in "rp" else 1.0) / samples.duration
        measured = (samples.targets[q] * factor)[drawn]
        explained = (fit.estimators[q].predict(samples.features[q]) * factor)[drawn]
        for values, name, colour, width in (
            (measured, "trials", MEASURED, 1.2),
            (explained, "regression", MODEL, 1.7),
        ):
            drawn_values = np.insert(values, breaks, np.nan)  # a gap between trials
            figure.add_trace(
                line(np.arange(len(drawn_values)), drawn_values, name, colour, width, showlegend=row == 1),
                row=row,
                col=1,
            )
        figure.add_trace(
            graph_objects().Scatter(
                x=compact(explained), y=compact(measured), mode="markers", showlegend=False,
                marker={"color": translucent(MODEL, 0.35), "size": 4}, hoverinfo="skip",
            ), row=row, col=2,
        )  # fmt: skip
        ends = [min(measured.min(), explained.min()), max(measured.max(), explained.max())]
        figure.add_trace(line(ends, ends, "equal", MUTED, 1.0, showlegend=False), row=row, col=2)
        last = row == len(equations)
        own_axis = axis(f"{EQUATIONS[q]}, {UNITS[q]}", nticks=5)
        label(figure, "window, trial after trial" if last else "", own_axis, row=row, col=1)
        label(figure, axis("regression" if last else "", nticks=4), axis(nticks=5), row=row, col=2)
    figure.update_layout(layout(190 * len(equations) + 80, hovermode="closest"))
    return figure


def residual_figure(fit: Fit) -> Figure:
    """Autocorrelation of the residuals and their cross-correlation with the rudder, with 95 % bounds."""
    errors, equations = residuals(fit.estimators, fit.samples), list(fit.estimators)
    rows = without_overlap(fit.samples)
    rudder = rudder_at_windows(fit)
    figure = subplots(
        len(equations), 2, horizontal_spacing=0.1, vertical_spacing=0.24 / len(equations),
        titles=["with themselves", "with the rudder" if rudder is not None else ""],
    )  # fmt: skip
    bound = NORMAL_95 / np.sqrt(len(rows))
    for row, q in enumerate(equations, start=1):
        own = autocorrelation(errors[q][rows], LAGS)
        correlations: list[tuple[NDArray[Any], Any]] = [(np.arange(1, len(own) + 1), own)]
        if rudder is not None:
            lags = np.arange(-LAGS, LAGS + 1)
            correlations.append((lags, cross_correlation(errors[q][rows], rudder[rows], lags)))
        for column, (lags, values) in enumerate(correlations, start=1):
            place = {"row": row, "col": column}
            figure.add_trace(_bars(lags, values), **place)
            for side in (-bound, bound):
                ends = [lags[0] - 0.5, lags[-1] + 0.5]
                legend = row == column == 1 and bool(side > 0.0)
                figure.add_trace(
                    line(ends, [side, side], "95 % bounds of white noise", LIMIT, 1.2, line_dash="dash",
                         showlegend=legend), **place,
                )  # fmt: skip
            largest = min(max(1.1 * float(np.max(np.abs(values), initial=0.0)), 3.0 * bound), 1.05)
            own_axis = axis(EQUATIONS[q] if column == 1 else "", range=[-largest, largest])
            label(figure, "lag, windows" if row == len(equations) else "", own_axis, **place)
    height = 170 * len(equations) + 100
    figure.update_layout(layout(height, titled=True, hovermode="closest", bargap=0.5))
    return figure


def _bars(lags: NDArray[Any], values: Any) -> Any:
    return graph_objects().Bar(
        x=lags, y=compact(values), marker={"color": MODEL}, showlegend=False,
        hovertemplate="lag %{x}: %{y:.2f}<extra></extra>",
    )  # fmt: skip


def rudder_at_windows(fit: Fit) -> Floats | None:
    """Rudder in the middle of each row's window, rad; None where a trial has none."""
    samples = fit.samples
    used = [trial for trial in fit.trials if trial.use == "fit"]
    if not all("delta" in trial for trial in used):
        return None
    middle, angles = samples.start + 0.5 * samples.duration, np.empty(len(samples))
    for k, trial in enumerate(used):
        own = samples.trial == k
        angles[own] = np.interp(middle[own], trial.t, trial["delta"])
    return angles


def truncated(fit: Fit) -> dict[str, TruncatedLSSVM]:
    """The estimators, by equation, that chose or were given a rank."""
    return {
        q: estimator
        for q, estimator in fit.estimators.items()
        if isinstance(estimator, TruncatedLSSVM)
        and (estimator.selection != "full" or estimator.rank is not None)
    }


def l_curve_figure(fit: Fit) -> Figure:
    """Size of residuals and of solution for every rank, one panel for each equation."""
    curves = truncated(fit)
    titles = [f"{EQUATIONS[q]}: rank {m.rank_} of {len(m.l_curve_.residual_norm)}" for q, m in curves.items()]
    figure = subplots(1, len(curves), titles=titles, horizontal_spacing=0.09)
    go = graph_objects()
    for column, estimator in enumerate(curves.values(), start=1):
        curve, rank = estimator.l_curve_, estimator.rank_
        ranks = [str(k) for k in range(1, len(curve.residual_norm) + 1)]
        place = {"row": 1, "col": column}
        x, y = compact(curve.residual_norm), compact(curve.solution_norm)
        figure.add_trace(
            go.Scatter(
                x=x, y=y, text=ranks, mode="lines+markers", showlegend=column == 1, name="rank 1, 2, ...",
                legendgroup="ranks", line={"color": MUTED, "width": 1.2}, marker={"color": MUTED, "size": 5},
                hovertemplate="rank %{text}<extra></extra>",
            ), **place,
        )  # fmt: skip
        figure.add_trace(
            go.Scatter(
                x=x[rank - 1 : rank], y=y[rank - 1 : rank], mode="markers", name="chosen",
                legendgroup="chosen", showlegend=column == 1,
                marker={"color": LIMIT, "size": 9}, hoverinfo="skip", cliponaxis=False,
            ), **place,
        )  # fmt: skip
        solution_axis = _logarithmic("norm of the solution" if column == 1 else "", y)
        label(figure, _logarithmic("norm of the residuals", x), solution_axis, **place)
    figure.update_layout(layout(360, titled=True, left=70, hovermode="closest"))
    return figure


def _logarithmic(title: str, values: NDArray[np.float32]) -> dict[str, Any]:
    """An axis in decades, or in steps of 1, 2, 5 where there are few."""
    few = float(np.log10(values.max() / max(values.min(), np.finfo(np.float32).tiny))) < 2.0
    return axis(title, type="log", dtick="D2" if few else 1, tickformat="~g")


def search_figure(fit: Fit) -> Figure:
    """What a search had found after each of its rounds: objective, and weight C or insensitive band."""
    searches = {EQUATIONS.get(q, q): search for q, search in fit.searches.items()}
    logarithmic = all(search.variable == LOG_C for search in searches.values())
    titles = ["best objective, relative to the final one", "best C" if logarithmic else f"best {BAND}"]
    figure = subplots(1, 2, titles=titles, horizontal_spacing=0.1)
    common = len({id(search.history) for search in searches.values()}) == 1  # one search for all
    for k, ((name, search), colour) in enumerate(zip(searches.items(), PALETTE, strict=False)):
        rounds = np.arange(len(search.history))
        objective = search.history / (search.value if search.value > 0.0 else 1.0)
        best = 10.0 ** search.course[:, 0] if logarithmic else search.course[:, 0]
        if k == 0 or not common:
            figure.add_trace(line(rounds, objective, name, colour, showlegend=False), row=1, col=1)
        figure.add_trace(line(rounds, best, name, colour), row=1, col=2)
    decades = {"type": "log", "tickformat": ".0e"} if logarithmic else {"range": [0.0, 1.0]}
    for column, own_axis in enumerate((axis(), axis(**decades)), start=1):
        label(figure, axis("round", rangemode="tozero"), own_axis, row=1, col=column)
    figure.update_layout(layout(340, titled=True, hovermode="closest"))
    return figure


def coefficients_figure(fit: Fit) -> Figure:
    """95 % interval of each coefficient by its size; one that reaches 0 is not significant."""
    go = graph_objects()
    names = list(fit.coefficients)
    values = np.array(list(fit.coefficients.values()))
    errors = np.array(list(fit.standard_errors.values()))
    size = np.where(values == 0.0, 1.0, np.abs(values))
    half = NORMAL_95 * np.nan_to_num(errors) / size
    columns = 1 if len(names) < 12 else 2
    rows = -(-len(names) // columns)
    figure = subplots(1, columns, horizontal_spacing=0.16)
    for column in range(columns):
        part = slice(column * rows, (column + 1) * rows)
        for sure, name, colour in ((True, "significant", MODEL), (False, "not significant", "#b3bcc7")):
            own = np.flatnonzero(((half < 1.0) & (values != 0.0))[part] == sure)
            centre = np.sign(values[part][own]) ** 2
            low, high = (np.clip(centre + side * half[part][own], *SHOWN) for side in (-1.0, 1.0))
            figure.add_trace(
                go.Scatter(
                    x=compact(100.0 * centre), y=own, mode="markers", name=name, legendgroup=name,
                    showlegend=column == 0, marker={"color": colour, "size": 7},
                    error_x={"type": "data", "symmetric": False, "array": compact(100.0 * (high - centre)),
                             "arrayminus": compact(100.0 * (centre - low)), "color": colour, "thickness": 1.8,
                             "width": 3},
                    text=[f"{names[part][i]}: ± {100.0 * half[part][i]:.3g} %" for i in own],
                    hovertemplate="%{text}<extra></extra>",
                ), row=1, col=column + 1,
            )  # fmt: skip
        shown = names[part]
        estimate_axis = axis(
            "per cent of the estimate", range=[-130, 330], zeroline=True, zerolinecolor=LIMIT
        )
        names_axis = axis(tickvals=list(range(len(shown))), ticktext=shown, range=[rows - 0.5, -0.5])
        label(figure, estimate_axis, names_axis, row=1, col=column + 1)
    figure.update_layout(layout(20 * rows + 110, left=84, hovermode="closest"))
    return figure
