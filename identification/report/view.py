"""What the templates of reports show of a fit: cards, sentences, rows of tables, figures of its trials."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np

from identification.fit import Fit
from identification.report.predictions import overview_figure, prediction_figure
from identification.report.sea import sea_sentences, track_figure
from identification.report.summary import are_derivatives, kernel_text
from identification.report.tables import (
    CoefficientRow,
    ErrorRow,
    Quantity,
    TrialRow,
    added_masses,
    coefficient_tables,
    error_rows,
    particulars,
    reference_rows,
    short_names,
    steering_gear,
    trial_row,
)
from identification.validation.diagnostics import EquationDiagnostics
from identification.validation.warnings import (
    EQUATIONS,
    heading_errors_deg,
    held_out_error,
    model_warnings,
    undetermined,
)
from shipgym.pages import NONE, fixed, number
from shipgym.pages.numbers import counted
from shipgym.plots.style import Figure


class Card(NamedTuple):
    """A figure that stands out on a page."""

    label: str
    value: str
    detail: str


class TrialFigure(NamedTuple):
    """A trial as it was predicted."""

    name: str
    located: bool  # whether its path is drawn
    figure: Figure


@dataclass(frozen=True, eq=False)
class FitView:
    """Everything that the macros in `sections.html` show of a fit but for its figures."""

    lead: str  # how the model was identified
    structure: str
    provenance: dict[str, Any]  # of the model
    cards: dict[str, Card]  # "ship", "data", "fit" and "quality"
    held_out: str  # the worst errors on trials held out
    guarded: bool  # whether a fit by itself ran away
    warnings: list[str]
    sea: list[str]  # current and wind of the trials
    undetermined: list[str]  # terms that the data cannot separate
    trials: list[TrialRow]
    equations: dict[str, EquationDiagnostics]  # by their names in words
    particulars: list[Quantity]
    added_masses: list[Quantity]
    gear: dict[str, str]
    gear_source: str  # "given" or "estimated"
    estimated: str  # names of the particulars that were estimated; empty without any
    coefficients: dict[str, list[CoefficientRow]]  # by the title of their table
    coefficient_notes: str
    kernel: str | None
    errors: list[ErrorRow]
    reference: str | None  # name of the reference ship of a grey box
    reference_rows: list[tuple[str, float | None, float | None]]


def fit_view(fit: Fit) -> FitView:
    """What the templates show of a fit."""
    model, provenance = fit.model, fit.model.provenance or {}
    short = short_names(fit.trials)
    coefficients = coefficient_tables(fit)
    kernel = provenance.get("kernel")
    return FitView(
        lead=_lead(fit),
        structure=model.structure,
        provenance=provenance,
        cards=_cards(fit),
        held_out=held_out_error(fit),
        guarded="rejected" in provenance.get("guard", {}),
        warnings=model_warnings(fit),
        sea=sea_sentences(provenance),
        undetermined=undetermined(fit),
        trials=[trial_row(trial, short[trial.name]) for trial in fit.trials],
        equations={EQUATIONS.get(q, q): found for q, found in fit.diagnostics.items()},
        particulars=particulars(model),
        added_masses=added_masses(model),
        gear=steering_gear(model),
        gear_source=provenance.get("steering", "given"),
        estimated=", ".join(sorted(model.particulars.estimated, key=str.lower)),
        coefficients=coefficients,
        coefficient_notes=_coefficient_notes(fit, coefficients),
        kernel=kernel_text(kernel) if kernel else None,
        errors=error_rows(fit, short),
        reference=fit.metrics.get("reference", {}).get("name"),
        reference_rows=reference_rows(fit, short),
    )


def trial_figures(fit: Fit) -> dict[str, Any]:
    """Figures of the trials: those fitted in one, and each of those that had no part in the fit."""
    short = short_names(fit.trials)
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    predictions = []
    for trial in fit.trials:
        if trial.use == "validate":
            figure = prediction_figure(trial, fit.predictions.get(trial.name))
            predictions.append(TrialFigure(short[trial.name], "x" in trial, figure))
    return {
        "tracks": track_figure(fit),
        "overview": overview_figure(fitted, fit.predictions),
        "predictions": predictions,
    }


def _lead(fit: Fit) -> str:
    provenance = fit.model.provenance or {}
    fitted = sum(trial.use == "fit" for trial in fit.trials)
    return (
        f"Structure {provenance.get('structure')}, method {provenance.get('method')}, samples"
        f" {provenance.get('samples')}, from {counted(fitted, 'recorded manoeuvre')}."
    )


def _cards(fit: Fit) -> dict[str, Card]:
    return {
        "ship": _ship_card(fit),
        "data": _data_card(fit),
        "fit": _fit_card(fit),
        "quality": quality_card(fit),
    }


def _ship_card(fit: Fit) -> Card:
    ship = fit.model.particulars
    detail = f"service speed {number(ship.speed)} m/s"
    if ship.mass is not None:
        detail += f", mass {number(ship.mass / 1000)} t"
    return Card("Ship", f"L = {ship.length:.4g} m", detail)


def _data_card(fit: Fit) -> Card:
    uses = [trial.use for trial in fit.trials]
    samples = sum(len(trial) for trial in fit.trials)
    seconds = sum(trial.duration for trial in fit.trials)
    detail = (
        f"{uses.count('validate')} to validate; {samples} samples,"
        f" {number(seconds / 60, 2)} min"
    )
    return Card("Data", f"{counted(uses.count('fit'), 'trial')} to fit", detail)


def _fit_card(fit: Fit) -> Card:
    equations = fit.diagnostics.values()
    rank = sum(equation.rank for equation in equations)
    terms = sum(equation.terms for equation in equations)
    lowest = min(equation.r_squared for equation in equations)
    detail = (
        f"directions of the features kept; lowest R² of an equation {fixed(lowest, 3)}"
    )
    return Card("Fit", f"{rank} of {terms}", detail)


def quality_card(fit: Fit) -> Card:
    """Heading error on the trials that were not fitted, else on those that were, degrees."""
    uses = [metrics["use"] for metrics in fit.metrics["trials"].values()]
    unseen = "validate" in uses
    errors = heading_errors_deg(fit, "validate" if unseen else None)
    if not errors:
        return Card("Prediction", NONE, "no heading was measured")

    worst = max(errors, key=lambda name: errors[name])
    median = float(np.median(list(errors.values())))
    of = "trials not fitted" if unseen else "fitted trials, none to validate"
    detail = (
        f"heading rmse, median of {of}; largest {errors[worst]:.1f}°"
        f" ({PurePath(worst).name})"
    )
    return Card("Prediction", f"{median:.1f}°", detail)


def _coefficient_notes(fit: Fit, tables: Mapping[str, list[CoefficientRow]]) -> str:
    """How the table of coefficients is to be read."""
    dynamics, provenance = fit.model.dynamics, fit.model.provenance or {}
    kind = f"Coefficients of {dynamics.quantity}s, {dynamics.normalisation} units"
    if are_derivatives(fit.model):
        kind = (
            "Hydrodynamic derivatives in the prime system with the instantaneous speed,"
            " times 10⁻⁵"
        )
    source = "the residuals of the fit, correlated in time and between the equations"
    if provenance.get("uncertainty") == "bootstrap":
        source = "refits to blocks of time drawn with replacement"
    error = provenance.get("model_error")
    if error:
        source += f", times {number(error['factor'], 2)} for model error"
        source += f" ({error['how']})"

    significant = [row.significant for rows in tables.values() for row in rows]
    return (
        f"{kind}, rudder positive to starboard. The standard error comes from {source};"
        " t is the value divided by its standard error."
        f" {significant.count(False)} of {len(significant)} coefficients do not differ"
        " significantly from zero (|t| < 2) and are printed pale: the manoeuvres of the"
        " fit hardly depend on them one by one."
    )
