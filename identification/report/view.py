"""What the templates of reports show of a fit: rows of tables, and figures of its trials."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.fit import Fit
from identification.report.predictions import overview_figure, prediction_figure
from identification.report.sea import sea_sentences, track_figure
from identification.report.summary import PRIME, are_derivatives, kernel_text
from identification.validation.warnings import (
    EQUATIONS,
    heading_errors_deg,
    model_warnings,
)
from shipgym import Trial
from shipgym.files import shipped_toml
from shipgym.ships.particulars import ADDED_MASSES
from shipgym.trials.units import KNOT

SIGNIFICANT_T = (
    2.0  # a coefficient with a smaller |t| is not significantly different from zero
)
WORDS: dict[str, dict[str, Any]] = shipped_toml("identification.report", "words.toml")


def fit_view(fit: Fit) -> dict[str, Any]:
    """What the macros in `sections.html` show of a fit but for its figures."""
    short, provenance = short_names(fit.trials), fit.model.provenance or {}
    return {
        "model": fit.model,
        "provenance": provenance,
        "warnings": model_warnings(fit),
        "sea": sea_sentences(provenance),
        "equations": {
            EQUATIONS.get(name, name): found for name, found in fit.diagnostics.items()
        },
        "trials": [_trial(trial, short[trial.name]) for trial in fit.trials],
        "errors": {
            short[name]: found | {"trial": name}
            for name, found in fit.metrics["trials"].items()
        },
        "heading": _heading(fit),
        "reference": fit.metrics.get("reference"),
        "words": WORDS,
        "added_masses": [
            name for name in ADDED_MASSES if fit.model.particulars[name] is not None
        ],
        "derivatives": are_derivatives(fit.model),
        "coefficients": _coefficients(fit),
        "kernel": (
            kernel_text(provenance["kernel"]) if provenance.get("kernel") else None
        ),
    }


def trial_figures(fit: Fit) -> dict[str, Any]:
    """Figures of the trials: those fitted in one, and each of those that had no part in the fit."""
    short, shown = short_names(fit.trials), fit.predictions
    fitted, held = (
        [t for t in fit.trials if t.use == use] for use in ("fit", "validate")
    )
    predictions = [
        (short[t.name], "x" in t, prediction_figure(t, shown.get(t.name))) for t in held
    ]
    return {
        "tracks": track_figure(fit),
        "overview": overview_figure(fitted, shown),
        "predictions": predictions,
    }


def short_names(trials: Sequence[Trial]) -> dict[str, str]:
    """Names of trials without their folders, unless two would be the same."""
    short = {trial.name: PurePath(trial.name).name for trial in trials}
    return (
        short
        if len(set(short.values())) == len(short)
        else {name: name for name in short}
    )


def _trial(trial: Trial, name: str) -> dict[str, Any]:
    """A row of the table of trials: seconds, degrees and knots."""
    speeds = (
        np.hypot(trial["u"], trial["v"]) / KNOT
        if "u" in trial and "v" in trial
        else None
    )
    return {
        "name": name,
        "kind": None if trial.kind is None else trial.kind.replace("-", " "),
        "use": trial.use,
        "derived": ", ".join(sorted(trial.derived)) or "none",
        "samples": len(trial),
        "duration": trial.duration,
        "interval": float(np.median(np.diff(trial.t))),
        "rudder": (
            float(np.degrees(np.abs(trial["delta"]).max()))
            if "delta" in trial
            else None
        ),
        "speeds": None if speeds is None else (speeds.min(), speeds.max()),
    }


def _heading(fit: Fit) -> dict[str, Any] | None:
    """Heading error on the trials that were not fitted, else on those that were, degrees."""
    unseen = any(
        metrics["use"] == "validate" for metrics in fit.metrics["trials"].values()
    )
    if not (errors := heading_errors_deg(fit, "validate" if unseen else None)):
        return None
    worst = max(errors, key=lambda name: errors[name])
    median, largest = float(np.median(list(errors.values()))), errors[worst]
    return {
        "unseen": unseen,
        "median": median,
        "largest": largest,
        "trial": PurePath(worst).name,
    }


def _coefficients(fit: Fit) -> dict[str, list[dict[str, Any]]]:
    """Rows of coefficients by the title of their table: one for each force, or one for all."""
    tables: dict[str, list[dict[str, Any]]] = {}
    forces = WORDS["forces"] if are_derivatives(fit.model) else {}
    for name, value in fit.coefficients.items():
        force, error = name.partition("_")[0], fit.standard_errors[name]
        t = value / error if error > 0.0 else None
        significant = bool(value) if t is None else abs(t) >= SIGNIFICANT_T
        scale = PRIME if forces else 1.0
        row = {"name": name, "value": value / scale, "error": error / scale, "t": t}
        tables.setdefault(forces.get(force, "coefficient"), []).append(
            row | {"significant": significant}
        )
    return tables
