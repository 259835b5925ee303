"""View of a fit for the templates of reports: sentences, rows and figures."""

import warnings
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from identification.estimators.lssvm import TruncatedLSSVM
from identification.judging.fit import Fit
from identification.judging.warnings import (
    EQUATIONS,
    INDICES,
    error_source,
    findings,
    held_out_error,
    inseparable,
    model_warnings,
    why_unstable,
)
from identification.pipeline.result import (
    coefficient_rows,
    coefficient_units,
    how_identified,
    kernel_text,
    quantities,
)
from shipgym import Trial
from shipgym.files import write_text
from shipgym.pages import NONE, fixed, render
from shipgym.plots import Panel, axis, line, panels, points
from shipgym.plots.style import LIMIT, MUTED, Figure
from shipgym.plots.trials import history_panel, path_panel

RUDDER = "#9aa5b1"


def regression_figure(fit: Fit) -> Figure | None:
    """The L-curves, where a rank was chosen by them; else None."""
    shown = [
        _l_curve_panel(q, estimator)
        for q, estimator in fit.estimators.items()
        if isinstance(estimator, TruncatedLSSVM) and estimator.selection != "full"
    ]
    if not shown:
        return None
    return panels(shown, 360, len(shown), outer=True, left=70, hovermode="closest")


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


def fit_view(fit: Fit) -> dict[str, Any]:
    """View of a fit for the macros in `sections.html`, without its figures."""
    model = fit.model
    provenance = model.provenance or {}
    kernel = provenance.get("kernel")
    return {
        "lead": f"{how_identified(fit)}.",
        "provenance": provenance,
        "held_out": held_out_error(fit),
        "guarded": "rejected" in provenance.get("guard", {}),
        "warnings": model_warnings(fit),
        "findings": findings(provenance),
        "inseparable": inseparable(fit),
        "trials": [trial_cells(trial) for trial in fit.trials],
        "equations": {
            EQUATIONS.get(name, name): equation
            for name, equation in fit.diagnostics.items()
        },
        "quantities": quantities(model),
        "estimated": ", ".join(sorted(model.particulars.estimated, key=str.lower)),
        "coefficients": coefficient_rows(fit),
        "coefficient_units": coefficient_units(model),
        "error_source": error_source(provenance),
        "kernel": kernel_text(kernel) if kernel else None,
        "errors": {
            PurePath(name).name: (metrics, index_lines(metrics))
            for name, metrics in fit.metrics["trials"].items()
        },
    }


def trial_figures(fit: Fit) -> dict[str, Any]:
    """Figures of the trials: of those fitted one, and of each that was held out."""
    predictions = {}
    for trial in fit.trials:
        if trial.use == "validate":
            predicted = fit.predictions.get(trial.name)
            name = PurePath(trial.name).name
            predictions[name] = prediction_figure(trial, predicted)
    return {"overview": overview_figure(fit), "predictions": predictions}


def trial_cells(trial: Trial) -> dict[str, Any]:
    """A trial's cells: seconds and degrees; None for what was not recorded."""
    rudder = None
    if "delta" in trial:
        rudder = float(np.degrees(np.abs(trial["delta"]).max()))
    return {
        "name": PurePath(trial.name).name,
        "use": trial.use,
        "kind": trial.kind,
        "rest": (
            ", ".join(sorted(trial.derived)) or "none",
            len(trial),
            fixed(trial.duration, 0),
            fixed(rudder, 1),
        ),
    }


def index_lines(metrics: Mapping[str, Any]) -> list[str]:
    """The manoeuvre's indices, measured and predicted; a dash where it has none."""
    lines = []
    for name, (words, unit) in INDICES.items():
        values = metrics.get(name)
        if values is not None:
            kinds = ("measured", "predicted", "closed_loop")
            found = " → ".join(fixed(values[kind]) for kind in kinds if kind in values)
            lines.append(f"{words} {found} {unit}")
    return lines or [NONE]


def report_page(fit: Fit) -> str:
    """The page, as text; the same fit gives the same text.

    The coefficients of an unstable model are in its file, marked, and not here. Raises
    InputError if plotly is not installed.
    """
    instability = why_unstable(fit)
    figures = {"regression": regression_figure(fit)}
    if instability is None:
        figures |= trial_figures(fit)
    return render(
        "identification.report/report.html",
        name=fit.model.particulars.name or fit.model.name,
        fit=fit_view(fit),
        figures=figures,
        instability=instability,
        trials=fit.settings["trials"],
    )


def write_report(fit: Fit, folder: str | Path) -> None:
    """Write report.html, a page with the figures of a fit, into a folder.

    Without plotly there is none, and a warning says so.
    """
    try:
        import plotly  # noqa: F401
    except ModuleNotFoundError:
        warnings.warn(
            "plotly is not installed, so report.html was not written: pip install"
            " 'shipgym[report]'",
            stacklevel=2,
        )
        return
    write_text(report_page(fit), Path(folder) / "report.html")
