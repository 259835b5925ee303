"""View of a fit for the templates of reports: sentences, rows and figures."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.fit import Fit
from identification.judging.sentences import error_source, findings
from identification.judging.warnings import (
    EQUATIONS,
    INDICES,
    held_out_error,
    inseparable,
    model_warnings,
)
from identification.pipeline.summary import (
    coefficient_rows,
    coefficient_units,
    how_identified,
    kernel_text,
    quantities,
)
from identification.report.figures import overview_figure, prediction_figure
from shipgym import Trial
from shipgym.pages import NONE, fixed


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
    predictions = {
        PurePath(trial.name).name: prediction_figure(
            trial, fit.predictions.get(trial.name)
        )
        for trial in fit.trials
        if trial.use == "validate"
    }
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
            found = " → ".join(
                fixed(values[kind])
                for kind in ("measured", "predicted", "closed_loop")
                if kind in values
            )
            lines.append(f"{words} {found} {unit}")
    return lines or [NONE]
