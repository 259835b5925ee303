"""Figures of an identification: its trials and rank."""

from pathlib import PurePath

import numpy as np

from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.fit import Fit
from identification.judging.warnings import EQUATIONS
from shipgym import Trial
from shipgym.plots import Panel, axis, line, panels, points
from shipgym.plots.style import LIMIT, MUTED, Figure
from shipgym.plots.trials import history_panel, path_panel

RUDDER = "#9aa5b1"


def plots(fit: Fit) -> dict[str, Figure]:
    """Figures of an identification and of what its model predicts.

    Raises InputError if plotly is not installed.

    Returns
    -------
    dict of str to plotly.graph_objects.Figure
        "l-curve" for the method that has one, "trials", and "prediction: NAME" for each
        trial held out.
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
    """The L-curves, where a rank was chosen by them."""
    shown = [
        _l_curve_panel(q, estimator)
        for q, estimator in fit.estimators.items()
        if isinstance(estimator, TruncatedLSSVM) and estimator.selection != "full"
    ]
    if not shown:
        return {}
    figure = panels(shown, 360, len(shown), outer=True, left=70, hovermode="closest")
    return {"l-curve": figure}


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
