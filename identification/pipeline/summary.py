"""The table of coefficients that `IdentificationResult.summary` prints."""

from collections.abc import Mapping
from math import degrees
from typing import Any

from rich.table import Table

from identification.judging.fit import Fit
from identification.judging.sentences import (
    bias_sentences,
    sea_sentences,
    turn_sentences,
)
from identification.judging.warnings import (
    exactly_collinear,
    undetermined,
)
from identification.text import as_text, lined_table
from shipgym import ShipModel
from shipgym.pages.numbers import MINUS, fixed, number
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


def summary_table(fit: Fit) -> str:
    """Coefficients with standard errors and t, inertia, and the verdict."""
    provenance = fit.model.provenance or {}
    kernel = provenance.get("kernel")
    shown = [
        _headline(fit),
        kernel_text(kernel) if kernel else coefficients_table(fit),
        _quantities_table(fit.model),
    ]
    posterior = provenance.get("posterior")
    error = provenance.get("model_error")
    if posterior and posterior["kept"]:
        words = mixing_in_words(posterior)
        shown.append(f"Standard errors are those of a posterior by sampling: {words}.")
    elif error:
        shown.append(
            f"Standard errors are scaled by {error['factor']:.2g} for model error"
            f" ({error['how']})."
        )
    shown += turn_sentences(provenance)
    shown += bias_sentences(provenance.get("rudder_bias"))
    shown += sea_sentences(provenance)
    shown += undetermined(fit)
    shown += exactly_collinear(fit)
    if "reference" in fit.metrics:
        shown.append(_against_reference(fit))
    return as_text(*shown)


def mixing_in_words(posterior: Mapping[str, Any]) -> str:
    """Size and diagnostics of a posterior by sampling, from its report."""
    power = posterior["power"]
    walkers = posterior["walkers"]
    steps = posterior["steps"]
    acceptance = posterior["acceptance"]
    time = posterior["autocorrelation_time"]
    r_hat = posterior["r_hat"]
    samples = posterior["effective_samples"]
    parts = [
        f"likelihood to the power {power:.2g}",
        f"{walkers} walkers",
        f"{steps} steps",
        f"acceptance {acceptance:.2f}",
        f"autocorrelation time {time:.0f} steps",
        f"split R-hat {r_hat:.3f}",
        f"{samples:.0f} effective samples",
    ]
    return ", ".join(parts)


def _headline(fit: Fit) -> str:
    provenance = fit.model.provenance or {}
    structure = provenance.get("structure")
    method = provenance.get("method")
    samples = provenance.get("samples")
    decision = provenance.get("guard", {}).get("decision")
    verdict = "NOT STABLE: its predictions run away and are not to be used"
    if fit.stable:
        verdict = "stable"
    return (
        f"{fit.model.name}: {structure} by {method}, {samples} samples;"
        f" {verdict} ({decision})"
    )


def kernel_text(report: Mapping[str, Any]) -> str:
    """Kernel added to the reference ship, in words: its weights tell nothing."""
    errors = []
    for name, error in report["heading_errors_held_out"].items():
        angle = _heading_error(error, ".2g", " deg")
        errors.append(f"{name} {angle}")
    held_out = ", ".join(errors)
    centres = report["centres"]
    length = report["length"]
    features = report["features"]
    C = report["C"]
    return (
        f"Kernel: {centres} radial basis functions of length {length:g} in"
        f" {features} features an equation, C {C:g}; heading held out, rms: {held_out}"
    )


def _heading_error(error: float | None, digits: str, unit: str = "") -> str:
    """An error of the heading, rad, in degrees."""
    if error is None:
        return "ran away"
    return f"{degrees(error):{digits}}{unit}"


def are_derivatives(model: ShipModel) -> bool:
    """Tell whether coefficients are hydrodynamic derivatives in the prime system.

    Such are printed times 1e-5.
    """
    dynamics = model.dynamics
    return dynamics.normalisation == "prime" and dynamics.quantity == "force"


def coefficients_table(fit: Fit) -> Table:
    """Coefficients with standard error and t."""
    dynamics = fit.model.dynamics
    derivatives = are_derivatives(fit.model)
    title = f"Coefficients of {dynamics.quantity}s, {dynamics.normalisation} units"
    if derivatives:
        title = "Hydrodynamic derivatives, prime system, 1e-5"
    table = lined_table(title, "name", ">value", ">standard error", ">t")
    for name, error in fit.standard_errors.items():
        value = fit.coefficients[name]
        t = "-"
        if error > 0.0:
            t = f"{value / error:.1f}"
        digits = ".6g"
        if derivatives:
            value = value / PRIME
            error = error / PRIME
            digits = ".2f"
        table.add_row(
            name,
            f"{value:{digits}}",
            f"{error:.2g}",
            t,
        )
    return table


def _quantities_table(model: ShipModel) -> Table:
    table = lined_table("Ship and steering gear", "name", ">value", "source")
    for name, source, value in quantities(model):
        table.add_row(name, value, source)
    return table


def quantities(model: ShipModel) -> list[tuple[str, str, str]]:
    """Particulars, added masses and steering gear: name, where from, and value."""
    ship, gear = model.particulars, model.steering
    rows = []

    def add(name: str, value: str, estimated: bool) -> None:
        rows.append((name, "estimated" if estimated else "given", value))

    for name, (words, unit, factor) in PARTICULARS.items():
        value = ship[name]
        if value is not None:
            digits = f"{factor * value:.5g}".replace("-", MINUS)
            add(words, f"{digits} {unit}", name in ship.estimated)
    for name in ADDED_MASSES:
        value = ship[name]
        if value is not None:
            add(f"{name}, 10⁻⁵", fixed(value / PRIME, 1), name in ship.estimated)
    estimated = (model.provenance or {}).get("steering") == "estimated"
    add("rudder limit", f"{number(gear.rudder_limit_deg)} deg", estimated)
    add("rudder rate", f"{number(gear.rudder_rate_deg_s)} deg/s", estimated)
    add("rudder lag", f"{number(gear.time_constant, 2)} s", estimated)
    return rows


def _against_reference(fit: Fit) -> Table:
    """Predicted headings of the trials, compared with the bare reference ship's."""
    reference = fit.metrics["reference"]
    title = (
        "Open-loop heading, root mean square error, beside the bare reference ship"
        f" '{reference['name']}'"
    )
    table = lined_table(title, "trial", "use", ">model, deg", ">reference, deg")
    for name, metrics in fit.metrics["trials"].items():
        bare = reference["trials"][name]
        table.add_row(
            name,
            metrics["use"],
            _heading_error(metrics["rmse"]["psi"], ".2f"),
            _heading_error(bare["rmse"]["psi"], ".2f"),
        )
    return table
