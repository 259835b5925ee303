"""Figures of an identification: its trials, residuals and rank."""

from pathlib import PurePath

import numpy as np

from identification.estimators.covariance import residuals
from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.diagnostics import autocorrelation, without_overlap
from identification.judging.fit import Fit
from identification.judging.warnings import EQUATIONS
from shipgym import Trial
from shipgym.manoeuvres.quantiles import NORMAL_95
from shipgym.plots import Panel, axis, line, panels, points
from shipgym.plots.style import LIMIT, MODEL, MUTED, Figure
from shipgym.plots.trials import history_panel, path_panel

RUDDER = "#9aa5b1"


def plots(fit: Fit) -> dict[str, Figure]:
    """Figures of an identification and of what its model predicts.

    Raises InputError if plotly is not installed.

    Returns
    -------
    dict of str to plotly.graph_objects.Figure
        "residuals" (autocorrelation), "l-curve" for the method that has one, "trials",
        and "prediction: NAME" for each trial held out.
    """
    found = regression_figures(fit)
    overview = overview_figure(fit)
    if overview is not None:
        found["trials"] = overview
    for trial in fit.trials:
        if trial.use == "validate":
            predicted = fit.predictions[trial.name]
            found[f"prediction: {trial.name}"] = prediction_figure(trial, predicted)
    return found


def regression_figures(fit: Fit) -> dict[str, Figure]:
    """Figures of the regression by name; "l-curve" only where a rank was chosen."""
    found = {}
    if fit.estimators:
        found["residuals"] = residual_figure(fit)
    curves = {
        q: estimator
        for q, estimator in fit.estimators.items()
        if isinstance(estimator, TruncatedLSSVM) and estimator.selection != "full"
    }
    if curves:
        shown = [_l_curve_panel(q, estimator) for q, estimator in curves.items()]
        found["l-curve"] = panels(
            shown, 360, len(shown), outer=True, left=70, hovermode="closest"
        )
    return found


def residual_figure(fit: Fit) -> Figure:
    """Autocorrelation of the residuals, with 95 % bounds of white noise."""
    rows = without_overlap(fit.samples)
    bound = NORMAL_95 / np.sqrt(len(rows))
    shown = []
    for q, error in residuals(fit.estimators, fit.samples).items():
        own = autocorrelation(error[rows], 24)
        bars = {"type": "bar", "x": np.arange(1, 25), "y": own, "name": q}
        traces = [{**bars, "marker": {"color": MODEL}, "showlegend": False}]
        for level in (-bound, bound):
            ends = [level] * 2
            traces.append(line([0.5, 24.5], ends, "95 % of white noise", LIMIT, 1.2))
        shown.append(Panel(traces, "lag, windows", EQUATIONS[q]))
    return panels(
        shown,
        170 * len(shown) + 100,
        1,
        outer=True,
        bargap=0.5,
    )


def _l_curve_panel(q: str, estimator: TruncatedLSSVM) -> Panel:
    """Size of residuals and of solution for every rank."""
    x, y = estimator.l_curve_.residual_norm, estimator.l_curve_.solution_norm
    rank = estimator.rank_
    own = slice(rank - 1, rank)
    return Panel(
        [
            line(
                x,
                y,
                "rank 1, 2, ...",
                MUTED,
                1.2,
                "lines+markers",
            ),
            points(x[own], y[own], "chosen", LIMIT, 9),
        ],
        axis("norm of the residuals", type="log"),
        axis("norm of the solution", type="log"),
        f"{EQUATIONS[q]}: rank {rank} of {len(x)}",
    )


def overview_figure(fit: Fit) -> Figure | None:
    """Heading and rudder of the fitted trials, with the open-loop simulation.

    None where a trial has no heading.
    """
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    if not all("psi" in trial for trial in fitted):
        return None
    shown = []
    for trial in fitted:
        rudder = np.degrees(trial["delta"])
        lines = [line(trial.t, rudder, "rudder", RUDDER, 1.2)]
        first_deg = np.degrees(trial["psi"][0])
        headings = history_panel(_runs(trial, fit.predictions[trial.name]), "psi")
        for trace in headings.traces:
            lines.append({**trace, "y": trace["y"] - first_deg})
        shown.append(Panel(lines, "time, s", "deg", PurePath(trial.name).name))
    return panels(shown, 230 * ((len(shown) + 1) // 2) + 80, columns=2, outer=True)


def prediction_figure(measured: Trial, predicted: Trial | None) -> Figure:
    """A recorded trial and its open-loop prediction: five channels and the path."""
    runs = _runs(measured, predicted)
    channels = ("psi", "r", "u", "v", "delta")
    shown = [history_panel(runs, channel) for channel in channels]
    shown.append(path_panel(runs, "x6"))
    return panels(shown, 600, columns=2, hovermode="closest")


def _runs(measured: Trial, predicted: Trial | None) -> dict[str, Trial]:
    """Both by the label of their line."""
    runs = {"measured": measured, "predicted": predicted}
    return {label: run for label, run in runs.items() if run is not None}
