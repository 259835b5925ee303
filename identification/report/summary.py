"""The table of coefficients that `IdentificationResult.summary` prints."""

from __future__ import annotations

from io import StringIO
from math import degrees
from typing import Any

from rich.console import Console
from rich.table import Table

from identification.fit import Fit
from identification.report.sea import sea_sentences
from identification.validation.warnings import EQUATIONS, exactly_collinear, undetermined
from shipgym.ships.particulars import ADDED_MASSES

INERTIA = ("mass", "xg", "yaw_gyradius", "speed")
PRIME = 1e-5
WIDTH = 100


def summary_table(fit: Fit) -> str:
    """Coefficients with standard error and t, inertia with what was estimated, and the verdict."""
    console = Console(file=StringIO(), width=WIDTH, color_system=None)
    verdict = "stable" if fit.stable else "NOT STABLE: its predictions run away and are not to be used"
    provenance = fit.model.provenance or {}
    console.print(
        f"{fit.model.name}: {provenance.get('structure')} by {provenance.get('method')}, "
        f"{provenance.get('samples')} samples; {verdict} ({provenance.get('guard', {}).get('decision')})"
    )
    if "kernel" in provenance:
        console.print(_kernel(provenance["kernel"]), highlight=False, soft_wrap=True)
    else:
        console.print(_coefficients(fit))
    console.print(_inertia(fit), _equations(fit))
    if "model_error" in provenance:
        error = provenance["model_error"]
        console.print(
            f"Standard errors are scaled by {error['factor']:.2g} for model error ({error['how']})."
        )
    for line in sea_sentences(provenance) + undetermined(fit) + exactly_collinear(fit):
        console.print(line, highlight=False)
    if "reference" in fit.metrics:
        console.print(_against_reference(fit))
    file = console.file
    assert isinstance(file, StringIO)
    return file.getvalue()


def _kernel(report: dict[str, Any]) -> str:
    """What was added to the reference ship, whose weights tell a reader nothing."""
    errors = report["heading_errors_held_out"].items()
    held_out = [f"{name} " + ("ran away" if e is None else f"{degrees(e):.2g} deg") for name, e in errors]
    return (
        f"Kernel: {report['centres']} radial basis functions of length {report['length']:g} in "
        f"{report['features']} features an equation, C {report['C']:g}; heading held out, rms: "
        + ", ".join(held_out)
    )


def _coefficients(fit: Fit) -> Table:
    structure = fit.model.dynamics
    title, unit = "Hydrodynamic derivatives, prime system, 1e-5", PRIME
    if (structure.normalisation, structure.quantity) != ("prime", "force"):
        title, unit = f"Coefficients of {structure.quantity}s, {structure.normalisation}", 1.0
    table = Table(title=title, title_justify="left")
    table.add_column("name")
    for heading in ("value", "standard error", "t"):
        table.add_column(heading, justify="right")
    for name, error in fit.standard_errors.items():
        value = fit.coefficients[name]
        t = f"{value / error:.1f}" if error > 0.0 else "-"
        shown = f"{value / unit:.2f}" if unit == PRIME else f"{value:.6g}"
        table.add_row(name, shown, f"{error / unit:.2g}", t)
    return table


def _inertia(fit: Fit) -> Table:
    ship = fit.model.particulars
    table = Table(title="Inertia and service speed", title_justify="left")
    for heading in ("name", "value", "unit", "source"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    units = {"mass": "kg", "xg": "m", "yaw_gyradius": "m", "speed": "m/s"}
    for name in INERTIA + ADDED_MASSES:
        if ship[name] is None:  # not needed by a structure of accelerations
            continue
        value = ship[name] / PRIME if name in ADDED_MASSES else ship[name]
        source = "estimated" if name in ship.estimated else "given"
        table.add_row(name, f"{value:.6g}", units.get(name, "1e-5"), source)
    gear = fit.model.steering
    source = (fit.model.provenance or {}).get("steering", "given")
    for name, value, unit in (
        ("rudder limit", gear.rudder_limit_deg, "deg"),
        ("rudder rate", gear.rudder_rate_deg_s, "deg/s"),
        ("rudder lag", gear.time_constant, "s"),
    ):
        table.add_row(name, f"{value:.4g}", unit, source)
    return table


def _equations(fit: Fit) -> Table:
    table = Table(title="Fit of the equations", title_justify="left")
    table.add_column("equation")
    for heading in ("rows", "terms", "rank", "condition", "R2", "residual rms"):
        table.add_column(heading, justify="right")
    for name, equation in fit.diagnostics.items():
        table.add_row(
            EQUATIONS.get(name, name),
            str(equation.samples),
            str(equation.terms),
            str(equation.rank),
            f"{equation.condition_number:.0f}",
            f"{equation.r_squared:.5f}",
            f"{equation.residual_rms:.2e}",
        )
    return table


def _against_reference(fit: Fit) -> Table:
    """The heading of each trial as predicted, and as the bare reference ship predicts it."""
    reference = fit.metrics["reference"]
    title = f"Open-loop heading, root mean square error, beside the bare reference ship '{reference['name']}'"
    table = Table(title=title, title_justify="left")
    for heading in ("trial", "use", "model, deg", "reference, deg"):
        table.add_column(heading, justify="right" if heading.endswith("deg") else "left")
    for name, metrics in fit.metrics["trials"].items():
        errors = (found["rmse"]["psi"] for found in (metrics, reference["trials"][name]))
        shown = ("ran away" if e is None else f"{degrees(e):.2f}" for e in errors)
        table.add_row(name, metrics["use"], *shown)
    return table
