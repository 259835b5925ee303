"""The table of coefficients that `IdentificationResult.summary` prints."""

from math import degrees
from typing import Any

from rich.table import Table

from identification.fit import Fit
from identification.report.sea import sea_sentences
from identification.text import as_text, lined_table
from identification.validation.warnings import (
    EQUATIONS,
    exactly_collinear,
    undetermined,
)
from shipgym import ShipModel
from shipgym.ships.particulars import ADDED_MASSES

INERTIA = ("mass", "xg", "yaw_gyradius", "speed")
PRIME = 1e-5


def summary_table(fit: Fit) -> str:
    """Coefficients with standard error and t, inertia with what was estimated, and the verdict."""
    verdict = (
        "stable"
        if fit.stable
        else "NOT STABLE: its predictions run away and are not to be used"
    )
    provenance = fit.model.provenance or {}
    shown = [
        (
            f"{fit.model.name}: {provenance.get('structure')} by"
            f" {provenance.get('method')}, {provenance.get('samples')} samples;"
            f" {verdict} ({provenance.get('guard', {}).get('decision')})"
        ),
        (
            kernel_text(provenance["kernel"])
            if "kernel" in provenance
            else _coefficients(fit)
        ),
        _inertia(fit),
        _equations(fit),
    ]
    if "model_error" in provenance:
        error = provenance["model_error"]
        shown.append(
            f"Standard errors are scaled by {error['factor']:.2g} for model error"
            f" ({error['how']})."
        )
    shown += sea_sentences(provenance) + undetermined(fit) + exactly_collinear(fit)
    return as_text(
        *shown, *([_against_reference(fit)] if "reference" in fit.metrics else [])
    )


def kernel_text(report: dict[str, Any]) -> str:
    """What was added to the reference ship, whose weights tell a reader nothing."""
    errors = report["heading_errors_held_out"].items()
    told = [
        f"{name} " + ("ran away" if e is None else f"{degrees(e):.2g} deg")
        for name, e in errors
    ]
    return (
        f"Kernel: {report['centres']} radial basis functions of length"
        f" {report['length']:g} in {report['features']} features an equation, C"
        f" {report['C']:g}; heading held out, rms: {', '.join(told)}"
    )


def are_derivatives(model: ShipModel) -> bool:
    """Whether coefficients are hydrodynamic derivatives in the prime system, printed times 1e-5."""
    return (model.dynamics.normalisation, model.dynamics.quantity) == ("prime", "force")


def _coefficients(fit: Fit) -> Table:
    structure = fit.model.dynamics
    title, unit = (
        f"Coefficients of {structure.quantity}s, {structure.normalisation} units",
        1.0,
    )
    if are_derivatives(fit.model):
        title, unit = "Hydrodynamic derivatives, prime system, 1e-5", PRIME
    table = lined_table(title, "name", ">value", ">standard error", ">t")
    for name, error in fit.standard_errors.items():
        value = fit.coefficients[name]
        t = f"{value / error:.1f}" if error > 0.0 else "-"
        shown = f"{value / unit:.2f}" if unit == PRIME else f"{value:.6g}"
        table.add_row(name, shown, f"{error / unit:.2g}", t)
    return table


def _inertia(fit: Fit) -> Table:
    ship = fit.model.particulars
    table = lined_table("Inertia and service speed", "name", ">value", "unit", "source")
    units = {"mass": "kg", "xg": "m", "yaw_gyradius": "m", "speed": "m/s"}
    for name in INERTIA + ADDED_MASSES:
        if ship[name] is None:  # not needed by a structure of accelerations
            continue
        value = ship[name] / PRIME if name in ADDED_MASSES else ship[name]
        source = "estimated" if name in ship.estimated else "given"
        table.add_row(name, f"{value:.6g}", units.get(name, "1e-5"), source)
    gear = fit.model.steering
    source = (fit.model.provenance or {}).get("steering", "given")
    table.add_row("rudder limit", f"{gear.rudder_limit_deg:.4g}", "deg", source)
    table.add_row("rudder rate", f"{gear.rudder_rate_deg_s:.4g}", "deg/s", source)
    table.add_row("rudder lag", f"{gear.time_constant:.4g}", "s", source)
    return table


def _equations(fit: Fit) -> Table:
    headings = ("rows", "terms", "rank", "condition", "R2", "residual rms")
    table = lined_table(
        "Fit of the equations", "equation", *(f">{heading}" for heading in headings)
    )
    for name, found in fit.diagnostics.items():
        counts = (str(count) for count in (found.samples, found.terms, found.rank))
        quality = (
            f"{found.condition_number:.0f}",
            f"{found.r_squared:.5f}",
            f"{found.residual_rms:.2e}",
        )
        table.add_row(EQUATIONS.get(name, name), *counts, *quality)
    return table


def _against_reference(fit: Fit) -> Table:
    """The heading of each trial as predicted, and as the bare reference ship predicts it."""
    reference = fit.metrics["reference"]
    title = (
        "Open-loop heading, root mean square error, beside the bare reference ship"
        f" '{reference['name']}'"
    )
    table = lined_table(title, "trial", "use", ">model, deg", ">reference, deg")
    for name, metrics in fit.metrics["trials"].items():
        errors = (
            found["rmse"]["psi"] for found in (metrics, reference["trials"][name])
        )
        shown = ("ran away" if e is None else f"{degrees(e):.2f}" for e in errors)
        table.add_row(name, metrics["use"], *shown)
    return table
