"""The section of a report on the coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from shipgym.pages import Html, columns, fixed, html, note, number, paragraph, section, table

if TYPE_CHECKING:
    from identification.result import IdentificationResult

PRIME = 1e-5
UNCERTAIN_T = 2.0  # a coefficient with a smaller |t| is not told from zero
FORCES = {"X": "Surge force X", "Y": "Sway force Y", "N": "Yaw moment N", "K": "Roll moment K"}


def coefficients_section(result: IdentificationResult, *parts: Html) -> Html:
    """Every coefficient with its standard error and t.

    Parameters
    ----------
    result : IdentificationResult
    *parts : Html
        To stand below the explanation.
    """
    errors, coefficients = result.standard_errors, result.coefficients
    weak = [name for name, value in coefficients.items() if _t(value, errors[name]) < UNCERTAIN_T]
    return section(
        "coefficients",
        "Coefficients",
        paragraph(
            _kind(result),
            f"{len(weak)} of {len(coefficients)} coefficients are not told from zero (|t| < 2) and are "
            "printed pale: the manoeuvres of the fit hardly depend on them, one by one.",
        ),
        *parts,
        columns(*_tables(result)),
        estimated_note(result),
    )


def in_prime_forces(result: IdentificationResult) -> bool:
    """Whether coefficients are hydrodynamic derivatives in the prime system, printed times 1e-5."""
    structure = result.model.table
    return (structure.normalisation, structure.quantity) == ("prime", "force")


def _kind(result: IdentificationResult) -> str:
    """What the coefficients are and where the errors come from."""
    structure = result.model.table
    kind = "Hydrodynamic derivatives in the prime system with the instantaneous speed, times 10⁻⁵"
    if not in_prime_forces(result):
        kind = f"Coefficients of {structure.quantity}s, normalisation \N{LEFT DOUBLE QUOTATION MARK}"
        kind += f"{structure.normalisation}\N{RIGHT DOUBLE QUOTATION MARK}"
    provenance = result.model.provenance or {}
    source = "the residuals of the fit, correlated in time and between the equations"
    if provenance.get("uncertainty") == "bootstrap":
        source = "refits to blocks of time drawn with replacement"
    return (
        f"{kind}, rudder positive to starboard. The standard error comes from {source}; t is value by "
        "standard error. "
    )


def _tables(result: IdentificationResult) -> list[Html]:
    """One table for each force, or one for all."""
    errors, left = result.standard_errors, dict(result.coefficients)
    found = []
    if in_prime_forces(result):
        for force, title in FORCES.items():
            own = {name: left.pop(name) for name in list(left) if name.startswith(f"{force}_")}
            if own:
                found.append(_table(title, own, errors, PRIME))
    if left:
        found.append(_table("coefficient", left, errors, PRIME if found else None))
    return found


def _table(title: str, values: Mapping[str, float], errors: Mapping[str, float], unit: float | None) -> Html:
    """Values and errors in units of `unit` with one decimal, or as they are where it is None."""

    def shown(value: float) -> Html:
        return number(value, 3) if unit is None else fixed(value / unit, 1)

    def shade(cell: Any, name: str) -> Html:
        pale = _t(values[name], errors[name]) < UNCERTAIN_T
        return Html(f'<span style="color:var(--faint)">{html(cell)}</span>') if pale else html(cell)

    rows = [
        [
            shade(name, name),
            shade(shown(value), name),
            shade(Html(f"± {shown(errors[name])}"), name),
            shade(fixed(value / errors[name], 1) if errors[name] > 0.0 else None, name),
        ]
        for name, value in values.items()
    ]
    return table([title, "value", "std. error", "t"], rows)


def _t(value: float, error: float) -> float:
    if error > 0.0:
        return abs(value / error)
    return np.inf if value else 0.0


def estimated_note(result: IdentificationResult) -> Html:
    """What the coefficients rest on that was not given."""
    names = sorted(result.model.particulars.estimated)
    if not names:
        return Html("")
    return note(
        f"Estimated from the ship's particulars, not given: {', '.join(names)}. From free-running trials "
        "the inertia cannot be identified along with the forces: if an estimate is off, the coefficients "
        "are off in proportion, while the simulated motions are not."
    )
