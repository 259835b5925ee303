"""Rows that text and pages show of a fit, and the text that `summary` prints."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from identification.judging.fit import Fit
from identification.judging.sentences import error_source, findings
from identification.judging.warnings import held_out_error, inseparable
from identification.text import as_text, lined_table
from shipgym import ShipModel
from shipgym.pages.numbers import MINUS, NONE, fixed, number
from shipgym.ships.particulars import ADDED_MASSES

PRIME = 1e-5
#: Particulars of the ship: name, unit, and the factor to it from the SI unit.
PARTICULARS = {
    "length": ("length between perpendiculars", "m", 1.0),
    "beam": ("beam", "m", 1.0),
    "draught": ("draught", "m", 1.0),
    "block_coefficient": ("block coefficient", "", 1.0),
    "mass": ("mass", "t", 1e-3),
    "xg": ("centre of gravity forward of midship", "m", 1.0),
    "yaw_gyradius": ("yaw gyradius", "m", 1.0),
    "speed": ("service speed", "m/s", 1.0),
    "water_density": ("water density", "kg/m³", 1.0),
}


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
        "Ship and steering gear",
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
    """The result in a few lines: verdict, held-out error, coefficients, what next."""
    trials = fit.metrics["trials"].values()
    uses = [one["use"] for one in trials]
    rows = sorted(coefficient_rows(fit), key=lambda row: not row.significant)
    shown = ", ".join(f"{row.name} {row.value} ± {row.error}" for row in rows[:4])
    significant = sum(row.significant for row in rows)
    lines = [
        f"{fit.model.name}: {how_identified(fit)}; {_verdict(fit)}",
        f"trials: {uses.count('fit')} fitted, {uses.count('validate')} held out",
        held_out_error(fit),
        f"{len(rows)} coefficients, {significant} differ from zero: {shown}, ...",
        "more: summary(), to_frame(), trials_frame(), model, metrics, save(folder)",
    ]
    return "\n".join(lines)


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
    """Particulars, added masses and steering gear: name, where from, and value."""
    ship = model.particulars
    rows = _gear_rows(model)
    for name, (words, unit, factor) in PARTICULARS.items():
        if ship[name] is not None:
            digits = f"{factor * ship[name]:.5g}".replace("-", MINUS)
            rows.append((words, name in ship.estimated, f"{digits} {unit}"))
    for name in ADDED_MASSES:
        if ship[name] is not None:
            value = fixed(ship[name] / PRIME, 1)
            rows.append((f"{name}, 10⁻⁵", name in ship.estimated, value))
    sources = {True: "estimated", False: "given"}
    return [(name, sources[guess], value) for name, guess, value in rows]


def _gear_rows(model: ShipModel) -> list[tuple[str, bool, str]]:
    """Steering gear: name, whether estimated, and value."""
    gear = model.steering
    estimated = (model.provenance or {}).get("steering") == "estimated"
    return [
        ("rudder limit", estimated, f"{number(gear.rudder_limit_deg)} deg"),
        ("rudder rate", estimated, f"{number(gear.rudder_rate_deg_s)} deg/s"),
        ("rudder lag", estimated, f"{number(gear.time_constant, 2)} s"),
    ]
