"""Rows that text and pages show of a fit, and the text that `summary` prints."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

from identification.judging.fit import Fit
from identification.judging.sentences import error_source, findings
from identification.judging.warnings import held_out_error, inseparable
from identification.text import as_text, lined_table
from shipgym import ShipModel
from shipgym.pages.numbers import NONE, fixed, number

PRIME = 1e-5


class CoefficientRow(NamedTuple):
    """A coefficient, as text; derivatives in the prime system times 1e5."""

    name: str
    value: str
    error: str  # standard error
    t: str  # value by its error; a dash without one
    significant: bool  # from two standard errors on


def summary_table(fit: Fit) -> str:
    """Coefficients with standard errors and t, inertia, and the verdict."""
    provenance = fit.model.provenance or {}
    kernel = provenance.get("kernel")
    coefficients = lined_table(
        coefficient_units(fit.model), "name", ">value", ">standard error", ">t"
    )
    for row in coefficient_rows(fit):
        coefficients.add_row(*row[:4])
    ship = lined_table(
        "Ship and steering gear, as in a ship file",
        "name",
        ">value",
        "source",
    )
    for name, source, value in quantities(fit.model):
        ship.add_row(name, value, source)
    shown = [
        f"{fit.model.name}: {how_identified(fit)}; {_verdict(fit)}",
        kernel_text(kernel) if kernel else coefficients,
        ship,
        f"The standard errors come from {error_source(provenance)}.",
        *findings(provenance),
        *inseparable(fit),
    ]
    return as_text(*shown)


def result_card(fit: Fit) -> str:
    """The result in a few lines: verdict, held-out error, what next."""
    return "\n".join(
        [
            f"{fit.model.name}: {how_identified(fit)}; {_verdict(fit)}",
            held_out_error(fit),
            "more: summary(), to_frame(), trials_frame(), model, metrics, save(folder)",
        ]
    )


def how_identified(fit: Fit) -> str:
    """Structure, method and samples in words."""
    provenance = fit.model.provenance or {}
    by = f"{provenance.get('structure')} by {provenance.get('method')}"
    return f"{by}, {provenance.get('samples')} samples"


def _verdict(fit: Fit) -> str:
    guard = (fit.model.provenance or {}).get("guard", {})
    verdict = "NOT STABLE: its predictions run away and are not to be used"
    if fit.stable:
        verdict = "stable"
    return f"{verdict} ({guard.get('decision')})"


def kernel_text(report: Mapping[str, Any]) -> str:
    """Kernel added to the reference ship, in words: its weights tell nothing."""
    return (
        f"Kernel: {report['centres']} radial basis functions of length"
        f" {report['length']:g} in {report['features']} features an equation, C"
        f" {report['C']:g}"
    )


def are_derivatives(model: ShipModel) -> bool:
    """Tell whether coefficients are hydrodynamic derivatives in the prime system."""
    dynamics = model.dynamics
    return dynamics.normalisation == "prime" and dynamics.quantity == "force"


def coefficient_units(model: ShipModel) -> str:
    """What the coefficients are, and their units."""
    if are_derivatives(model):
        return (
            "Hydrodynamic derivatives in the prime system with the instantaneous speed,"
            " times 10⁻⁵"
        )
    dynamics = model.dynamics
    return f"Coefficients of {dynamics.quantity}s, {dynamics.normalisation} units"


def coefficient_rows(fit: Fit) -> list[CoefficientRow]:
    """A row for each coefficient."""
    derivatives = are_derivatives(fit.model)
    rows = []
    for name, error in fit.standard_errors.items():
        value = fit.coefficients[name]
        own, deviation = number(value), number(error)
        if derivatives:
            own, deviation = fixed(value / PRIME, 1), fixed(error / PRIME, 1)
        t, significant = NONE, bool(value)
        if error > 0.0:
            t = fixed(value / error, 1)
            significant = abs(value / error) >= 2.0
        rows.append(
            CoefficientRow(
                name,
                own,
                deviation,
                t,
                significant,
            )
        )
    return rows


def quantities(model: ShipModel) -> list[tuple[str, str, str]]:
    """Particulars and steering gear by their names in a ship file: source and value."""
    ship = model.particulars
    rows = [(name, name in ship.estimated, ship[name]) for name in ship]
    estimated = (model.provenance or {}).get("steering") == "estimated"
    rows += [(name, estimated, one) for name, one in asdict(model.steering).items()]
    sources = {True: "estimated", False: "given"}
    return [
        (name, sources[guess], f"{value:.5g}")
        for name, guess, value in rows
        if isinstance(value, float)
    ]
