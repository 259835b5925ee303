"""View of a fit for the templates of reports: cards, sentences, rows and figures."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np

from identification.judging.fit import Fit
from identification.judging.sentences import error_source, findings
from identification.judging.warnings import (
    EQUATIONS,
    INDICES,
    heading_errors_deg,
    held_out_error,
    model_warnings,
    undetermined,
)
from identification.pipeline.summary import (
    CoefficientRow,
    are_derivatives,
    coefficient_rows,
    coefficient_units,
    how_identified,
    kernel_text,
    quantities,
)
from identification.report.predictions import (
    overview_figure,
    prediction_figure,
)
from shipgym import Trial
from shipgym.pages import NONE, fixed, number
from shipgym.pages.numbers import counted
from shipgym.trials.units import KNOT

FORCES = {
    "X": "Surge force X",
    "Y": "Sway force Y",
    "N": "Yaw moment N",
    "K": "Roll moment K",
}


class Card(NamedTuple):
    """A figure that stands out on a page."""

    label: str
    value: str
    detail: str


def fit_view(fit: Fit) -> dict[str, Any]:
    """View of a fit for the macros in `sections.html`, without its figures."""
    model = fit.model
    provenance = model.provenance or {}
    short = short_names(fit.trials)
    kernel = provenance.get("kernel")
    trials = []
    for trial in fit.trials:
        trials.append(trial_cells(trial, short[trial.name]))
    fitted = sum(trial.use == "fit" for trial in fit.trials)
    errors = {}
    for name, metrics in fit.metrics["trials"].items():
        errors[short[name]] = (metrics, index_lines(metrics))
    cards = {
        "ship": _ship_card(fit),
        "data": _data_card(fit),
        "quality": _quality_card(fit),
    }
    return {
        "lead": f"{how_identified(fit)}, from {counted(fitted, 'recorded manoeuvre')}.",
        "structure": model.structure,
        "provenance": provenance,
        "cards": cards,
        "held_out": held_out_error(fit),
        "guarded": "rejected" in provenance.get("guard", {}),
        "warnings": model_warnings(fit),
        "findings": findings(provenance),
        "undetermined": undetermined(fit),
        "trials": trials,
        "equations": {
            EQUATIONS.get(name, name): equation
            for name, equation in fit.diagnostics.items()
        },
        "quantities": quantities(model),
        "estimated": ", ".join(sorted(model.particulars.estimated, key=str.lower)),
        "coefficients": _by_force(fit),
        "coefficient_notes": _coefficient_notes(fit),
        "kernel": kernel_text(kernel) if kernel else None,
        "errors": errors,
    }


def trial_figures(fit: Fit) -> dict[str, Any]:
    """Figures of the trials: of those fitted one, and of each that was held out."""
    short = short_names(fit.trials)
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    predictions = [
        {
            "name": short[trial.name],
            "located": "x" in trial,  # whether its path is drawn
            "figure": prediction_figure(trial, fit.predictions.get(trial.name)),
        }
        for trial in fit.trials
        if trial.use == "validate"
    ]
    return {
        "overview": overview_figure(fitted, fit.predictions),
        "predictions": predictions,
    }


def _ship_card(fit: Fit) -> Card:
    ship = fit.model.particulars
    detail = f"service speed {number(ship.speed)} m/s"
    if ship.mass is not None:
        detail += f", mass {number(ship.mass / 1000)} t"
    return Card("Ship", f"L = {ship.length:.4g} m", detail)


def _data_card(fit: Fit) -> Card:
    uses = [trial.use for trial in fit.trials]
    to_fit = counted(uses.count("fit"), "trial")
    to_validate = uses.count("validate")
    samples = sum(len(trial) for trial in fit.trials)
    minutes = number(sum(trial.duration for trial in fit.trials) / 60, 2)
    detail = f"{to_validate} to validate; {samples} samples, {minutes} min"
    return Card("Data", f"{to_fit} to fit", detail)


def _quality_card(fit: Fit) -> Card:
    """Heading error of the trials held out, without any of those fitted, degrees."""
    uses = [metrics["use"] for metrics in fit.metrics["trials"].values()]
    unseen = "validate" in uses
    errors = heading_errors_deg(fit, "validate" if unseen else None)
    if not errors:
        return Card("Prediction", NONE, "no heading was measured")

    worst = max(errors, key=lambda name: errors[name])
    median = float(np.median(list(errors.values())))
    of = "trials not fitted" if unseen else "fitted trials, none to validate"
    largest = f"largest {errors[worst]:.1f}° ({PurePath(worst).name})"
    detail = f"heading rmse, median of {of}; {largest}"
    return Card("Prediction", f"{median:.1f}°", detail)


def _by_force(fit: Fit) -> dict[str, list[CoefficientRow]]:
    """Rows of coefficients by the title of their table: one a force, or one for all."""
    tables: dict[str, list[CoefficientRow]] = {}
    for row in coefficient_rows(fit):
        title = "coefficient"
        if are_derivatives(fit.model):
            force, _, _ = row.name.partition("_")
            title = FORCES.get(force, title)
        tables.setdefault(title, []).append(row)
    return tables


def _coefficient_notes(fit: Fit) -> str:
    """Notes by which to read the table of coefficients."""
    significant = [row.significant for row in coefficient_rows(fit)]
    uncertain = significant.count(False)
    return (
        f"{coefficient_units(fit.model)}, rudder positive to starboard. The standard"
        f" error comes from {error_source(fit.model.provenance or {})};"
        " t is the value divided by its standard error."
        f" {uncertain} of {len(significant)} coefficients do not differ"
        " significantly from zero (|t| < 2) and are printed pale: the manoeuvres of the"
        " fit hardly depend on them one by one."
    )


def short_names(trials: Sequence[Trial]) -> dict[str, str]:
    """Names of trials without their folders, unless two would be the same."""
    short = {trial.name: PurePath(trial.name).name for trial in trials}
    if len(set(short.values())) < len(short):
        return {name: name for name in short}
    return short


def trial_cells(trial: Trial, name: str) -> dict[str, Any]:
    """A trial's cells: seconds, degrees, knots; None for what was not recorded."""
    rudder = speeds = None
    if "delta" in trial:
        rudder = float(np.degrees(np.abs(trial["delta"]).max()))
    if "u" in trial and "v" in trial:
        knots = np.hypot(trial["u"], trial["v"]) / KNOT
        speeds = f"{fixed(knots.min(), 1)} to {fixed(knots.max(), 1)}"
    return {
        "name": name,
        "use": trial.use,
        "kind": trial.kind and trial.kind.replace("-", " "),
        "rest": (
            ", ".join(sorted(trial.derived)) or "none",
            len(trial),
            fixed(trial.duration, 0),
            fixed(np.median(np.diff(trial.t)), 2),
            fixed(rudder, 1),
            speeds,
        ),
    }


def index_lines(metrics: Mapping[str, Any]) -> list[str]:
    """The manoeuvre's indices, measured and predicted; a dash where it has none."""
    lines = []
    for name, (words, unit) in INDICES.items():
        values = metrics.get(name)
        if values is None:
            continue
        line = f"{words} {fixed(values['measured'])} → {fixed(values['predicted'])}"
        closed_loop = values.get("closed_loop")
        if closed_loop is not None:
            line += f" ({fixed(closed_loop)})"
        lines.append(f"{line} {unit}")
    return lines or [NONE]
