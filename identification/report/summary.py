"""The table of coefficients that `IdentificationResult.summary` prints."""

from __future__ import annotations

from io import StringIO
from math import degrees
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from shipgym.ships.particulars import ADDED_MASSES

if TYPE_CHECKING:
    from identification.result import IdentificationResult

INERTIA = ("mass", "xg", "yaw_gyradius", "speed")
PRIME = 1e-5
WIDTH = 100
EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw", "p": "roll"}
EXACT = 1e8  # condition number beyond which terms are in proportion but for rounding


def summary_table(result: IdentificationResult) -> str:
    """Coefficients with standard error and t, inertia with what was estimated, and the verdict."""
    console = Console(file=StringIO(), width=WIDTH, color_system=None)
    verdict = "stable" if result.stable else "NOT STABLE: its predictions run away and are not to be used"
    provenance = result.model.provenance or {}
    console.print(
        f"{result.model.name}: {provenance.get('structure')} by {provenance.get('method')}, "
        f"{provenance.get('samples')} samples; {verdict} ({provenance.get('guard', {}).get('decision')})"
    )
    console.print(_coefficients(result), _inertia(result), _equations(result))
    for line in undetermined(result) + exactly_collinear(result):
        console.print(line, highlight=False)
    if "reference" in result.metrics:
        console.print(_against_reference(result))
    file = console.file
    assert isinstance(file, StringIO)
    return file.getvalue()


def _coefficients(result: IdentificationResult) -> Table:
    structure = result.model.table
    title, unit = "Hydrodynamic derivatives, prime system, 1e-5", PRIME
    if (structure.normalisation, structure.quantity) != ("prime", "force"):
        title, unit = f"Coefficients of {structure.quantity}s, {structure.normalisation}", 1.0
    table = Table(title=title, title_justify="left")
    table.add_column("name")
    for heading in ("value", "standard error", "t"):
        table.add_column(heading, justify="right")
    for name, error in result.standard_errors.items():
        value = result.coefficients[name]
        t = f"{value / error:.1f}" if error > 0.0 else "-"
        shown = f"{value / unit:.2f}" if unit == PRIME else f"{value:.6g}"
        table.add_row(name, shown, f"{error / unit:.2g}", t)
    return table


def _inertia(result: IdentificationResult) -> Table:
    ship = result.model.particulars
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
    gear = result.model.steering
    source = (result.model.provenance or {}).get("steering", "given")
    for name, value, unit in (
        ("rudder limit", gear.rudder_limit_deg, "deg"),
        ("rudder rate", gear.rudder_rate_deg_s, "deg/s"),
        ("rudder lag", gear.time_constant, "s"),
    ):
        table.add_row(name, f"{value:.4g}", unit, source)
    return table


def _equations(result: IdentificationResult) -> Table:
    table = Table(title="Fit of the equations", title_justify="left")
    table.add_column("equation")
    for heading in ("rows", "terms", "rank", "condition", "R2", "residual rms"):
        table.add_column(heading, justify="right")
    for name, fit in result.diagnostics.items():
        table.add_row(
            EQUATIONS.get(name, name),
            str(fit.samples),
            str(fit.terms),
            str(fit.rank),
            f"{fit.condition_number:.0f}",
            f"{fit.r_squared:.5f}",
            f"{fit.residual_rms:.2e}",
        )
    return table


def undetermined(result: IdentificationResult) -> list[str]:
    """For each equation the terms that the data do not tell apart, of directions that the fit left out."""
    return [
        f"{EQUATIONS.get(name, name)}: not told apart by the data, their combination was left out: "
        + "; ".join(", ".join(group) for group in fit.dropped)
        for name, fit in result.diagnostics.items()
        if fit.dropped
    ]


def exactly_collinear(result: IdentificationResult) -> list[str]:
    """For each equation of which no direction was left out the terms that are in proportion in the data."""
    return [
        f"{EQUATIONS.get(name, name)}: exactly collinear in the data: "
        + "; ".join(f"{one} and {other}" for one, other, _ in fit.collinear_pairs)
        + "; only combinations are determined, their shares are the method's choice"
        for name, fit in result.diagnostics.items()
        if fit.condition_number > EXACT and not fit.dropped
    ]


def _against_reference(result: IdentificationResult) -> Table:
    """The heading of each trial as predicted, and as the bare reference ship predicts it."""
    reference = result.metrics["reference"]
    title = f"Open-loop heading, root mean square error, beside the bare reference ship '{reference['name']}'"
    table = Table(title=title, title_justify="left")
    for heading in ("trial", "use", "model, deg", "reference, deg"):
        table.add_column(heading, justify="right" if heading.endswith("deg") else "left")
    for name, metrics in result.metrics["trials"].items():
        errors = (found["rmse"]["psi"] for found in (metrics, reference["trials"][name]))
        shown = ("ran away" if e is None else f"{degrees(e):.2f}" for e in errors)
        table.add_row(name, metrics["use"], *shown)
    return table
