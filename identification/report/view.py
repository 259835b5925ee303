"""View of a fit for the templates of reports: cards, sentences, rows and figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np

from identification.judging.diagnostics import EquationDiagnostics
from identification.judging.fit import Fit
from identification.judging.sentences import (
    bias_sentences,
    sea_sentences,
    turn_sentences,
)
from identification.judging.warnings import (
    EQUATIONS,
    heading_errors_deg,
    held_out_error,
    model_warnings,
    undetermined,
)
from identification.pipeline.summary import (
    are_derivatives,
    kernel_text,
    mixing_in_words,
    quantities,
)
from identification.report.predictions import (
    overview_figure,
    prediction_figure,
    track_figure,
)
from identification.report.tables import (
    CoefficientRow,
    TrialRow,
    coefficient_tables,
    index_lines,
    short_names,
    trial_row,
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
    """View of a fit for the macros in `sections.html`, without its figures."""

    lead: str  # how the model was identified
    structure: str
    provenance: dict[str, Any]  # of the model
    cards: dict[str, Card]  # "ship", "data", "fit" and "quality"
    held_out: str  # the worst errors on trials held out
    guarded: bool  # whether a fit by itself ran away
    warnings: list[str]
    sea: list[str]  # bias of the rudder, current and wind of the trials
    undetermined: list[str]  # terms that the data cannot separate
    trials: list[TrialRow]
    equations: dict[str, EquationDiagnostics]  # by their names in words
    #: particulars, added masses and steering gear: name, where from, and value
    quantities: list[tuple[str, str, str]]
    estimated: str  # names of the particulars that were estimated; empty without any
    coefficients: dict[str, list[CoefficientRow]]  # by the title of their table
    coefficient_notes: str
    kernel: str | None
    #: metrics of the predictions by short name, and the manoeuvres' indices in words
    errors: dict[str, tuple[dict[str, Any], list[str]]]


def fit_view(fit: Fit) -> FitView:
    """View of a fit for the templates."""
    model = fit.model
    provenance = model.provenance or {}
    short = short_names(fit.trials)
    coefficients = coefficient_tables(fit)
    kernel = provenance.get("kernel")
    equations = {
        EQUATIONS.get(name, name): equation
        for name, equation in fit.diagnostics.items()
    }
    return FitView(
        lead=_lead(fit),
        structure=model.structure,
        provenance=provenance,
        cards=_cards(fit),
        held_out=held_out_error(fit),
        guarded="rejected" in provenance.get("guard", {}),
        warnings=model_warnings(fit),
        sea=[
            *turn_sentences(provenance),
            *bias_sentences(provenance.get("rudder_bias")),
            *sea_sentences(provenance),
        ],
        undetermined=undetermined(fit),
        trials=[trial_row(trial, short[trial.name]) for trial in fit.trials],
        equations=equations,
        quantities=quantities(model),
        estimated=", ".join(sorted(model.particulars.estimated, key=str.lower)),
        coefficients=coefficients,
        coefficient_notes=_coefficient_notes(fit, coefficients),
        kernel=kernel_text(kernel) if kernel else None,
        errors={
            short[name]: (metrics, index_lines(metrics))
            for name, metrics in fit.metrics["trials"].items()
        },
    )


def trial_figures(fit: Fit) -> dict[str, Any]:
    """Figures of the trials: of those fitted one, and of each that was held out."""
    short = short_names(fit.trials)
    fitted, predictions = [], []
    for trial in fit.trials:
        if trial.use == "fit":
            fitted.append(trial)
        elif trial.use == "validate":
            figure = prediction_figure(trial, fit.predictions.get(trial.name))
            shown = TrialFigure(
                name=short[trial.name],
                located="x" in trial,
                figure=figure,
            )
            predictions.append(shown)
    return {
        "tracks": track_figure(fit),
        "overview": overview_figure(fitted, fit.predictions),
        "predictions": predictions,
    }


def _lead(fit: Fit) -> str:
    provenance = fit.model.provenance or {}
    structure = provenance.get("structure")
    method = provenance.get("method")
    samples = provenance.get("samples")
    fitted = sum(trial.use == "fit" for trial in fit.trials)
    manoeuvres = counted(fitted, "recorded manoeuvre")
    return (
        f"Structure {structure}, method {method}, samples {samples}, from {manoeuvres}."
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
    speed = number(ship.speed)
    detail = f"service speed {speed} m/s"
    if ship.mass is not None:
        tonnes = number(ship.mass / 1000)
        detail += f", mass {tonnes} t"
    return Card(
        label="Ship",
        value=f"L = {ship.length:.4g} m",
        detail=detail,
    )


def _data_card(fit: Fit) -> Card:
    uses = [trial.use for trial in fit.trials]
    to_fit = counted(uses.count("fit"), "trial")
    to_validate = uses.count("validate")
    samples = sum(len(trial) for trial in fit.trials)
    seconds = sum(trial.duration for trial in fit.trials)
    minutes = number(seconds / 60, 2)
    return Card(
        label="Data",
        value=f"{to_fit} to fit",
        detail=f"{to_validate} to validate; {samples} samples, {minutes} min",
    )


def _fit_card(fit: Fit) -> Card:
    equations = fit.diagnostics.values()
    rank = sum(equation.rank for equation in equations)
    terms = sum(equation.terms for equation in equations)
    r_squared = min(equation.r_squared for equation in equations)
    lowest = fixed(r_squared, 3)
    return Card(
        label="Fit",
        value=f"{rank} of {terms}",
        detail=f"directions of the features kept; lowest R² of an equation {lowest}",
    )


def quality_card(fit: Fit) -> Card:
    """Heading error of the trials held out, without any of those fitted, degrees."""
    uses = [metrics["use"] for metrics in fit.metrics["trials"].values()]
    unseen = "validate" in uses
    errors = heading_errors_deg(fit, "validate" if unseen else None)
    if not errors:
        return Card("Prediction", NONE, "no heading was measured")

    worst = max(errors, key=lambda name: errors[name])
    worst_name = PurePath(worst).name
    median = float(np.median(list(errors.values())))
    of = "trials not fitted" if unseen else "fitted trials, none to validate"
    return Card(
        label="Prediction",
        value=f"{median:.1f}°",
        detail=(
            f"heading rmse, median of {of}; largest {errors[worst]:.1f}° ({worst_name})"
        ),
    )


def _coefficient_notes(fit: Fit, tables: Mapping[str, list[CoefficientRow]]) -> str:
    """Notes by which to read the table of coefficients."""
    dynamics = fit.model.dynamics
    kind = f"Coefficients of {dynamics.quantity}s, {dynamics.normalisation} units"
    if are_derivatives(fit.model):
        kind = (
            "Hydrodynamic derivatives in the prime system with the instantaneous speed,"
            " times 10⁻⁵"
        )
    source = _error_source(fit.model.provenance or {})
    significant = [row.significant for rows in tables.values() for row in rows]
    uncertain = significant.count(False)
    return (
        f"{kind}, rudder positive to starboard. The standard error comes from {source};"
        " t is the value divided by its standard error."
        f" {uncertain} of {len(significant)} coefficients do not differ"
        " significantly from zero (|t| < 2) and are printed pale: the manoeuvres of the"
        " fit hardly depend on them one by one."
    )


def _error_source(provenance: Mapping[str, Any]) -> str:
    """Where the standard errors come from."""
    posterior = provenance.get("posterior")
    if posterior and posterior["kept"]:
        return f"a posterior by sampling ({mixing_in_words(posterior)})"
    source = "the residuals of the fit, correlated in time and between the equations"
    error = provenance.get("model_error")
    if error:
        factor = number(error["factor"], 2)
        source += f", times {factor} for model error ({error['how']})"
    return source
