"""Identify with the terms that are needed: reduce the full structure, then identify what is left."""

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from identification.design.reduction import (
    Reduction,
    reduce,
    reduced_structure,
    sensitivity,
)
from identification.pipeline import identify
from identification.result import IdentificationResult
from shipgym import InputError, ShipModel, Trial, UnstableModelError, register_structure
from shipgym.arrays import finite
from shipgym.manoeuvres import zigzag
from shipgym.ships import GreyBox, Structure


@dataclass(frozen=True, eq=False)
class ReducedIdentification:
    """A structure reduced on its trials, and both models.

    Attributes
    ----------
    full : IdentificationResult
        With all terms.
    reductions : dict of str to Reduction
        By equation, the path and the terms chosen.
    structure : Structure
        Of the terms chosen, registered by its name.
    reduced : IdentificationResult
        With it.
    """

    full: IdentificationResult
    reductions: dict[str, Reduction]
    structure: Structure
    reduced: IdentificationResult

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        equations = {}
        for q, found in self.reductions.items():
            path = [asdict(step) for step in found.path]
            for step in path:
                step["relative_errors"] = {
                    k: finite(e) for k, e in step["relative_errors"].items()
                }
            equations[q] = {"chosen": found.chosen, "path": path}
        return {
            "structure": self.structure.name,
            "equations": equations,
            "terms": {
                "full": len(self.full.coefficients),
                "reduced": len(self.reduced.coefficients),
            },
            "trials": {
                "full": self.full.metrics["trials"],
                "reduced": self.reduced.metrics["trials"],
            },
            "sensitivity": zigzag_sensitivity(self.reduced.model),
        }


def identify_reduced(
    trials: Sequence[Trial],
    direction: str = "backward",
    tolerance: float = 1e-3,
    **arguments: Any,
) -> ReducedIdentification:
    """Identify a structure, reduce it on the same samples, and identify the smaller one.

    Raises InputError for a grey box, whose table is what its reference ship leaves, for
    a structure with a memory of yaw, and for fewer than five samples a term.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`. Those held out have no part in the reduction either.
    direction : {"backward", "forward"}
        Elimination or selection (`reduction`).
    tolerance : float
        By how much the R2 of stretches held out may fall.
    **arguments
        Of `identify`.
    """
    full = identify(trials, **arguments)
    table = full.model.table
    if isinstance(table, GreyBox):
        raise InputError(
            f"structure: {table.name!r} found, whose table adds to a reference ship,"
            " expected one of its own to reduce, such as 'abkowitz'"
        )
    if tuple(table.regressed) != tuple(table.equations):
        raise InputError(
            f"structure: {table.name!r} found, whose memory of yaw has no regression of"
            " its own, expected one without memory to reduce, such as 'abkowitz'"
        )
    reductions = reduce(full.samples, table, direction, tolerance)
    small = reduced_structure(table, reductions, table.name)
    terms = repr([(q, [term.name for term in small.terms(q)]) for q in small.equations])
    # among all reductions
    own = f"{table.name}-{hashlib.sha256(terms.encode()).hexdigest()[:6]}"
    small = register_structure(
        own, small.equations, small.source, small.normalisation, small.quantity
    )
    reduced = identify(trials, **{**arguments, "structure": small.name})
    return ReducedIdentification(full, reductions, small, reduced)


def zigzag_sensitivity(model: ShipModel) -> dict[str, float | None]:
    """`sensitivity` of the 20/20 zigzag; None where the changed ship runs away; empty where the ship does."""
    try:
        effects = sensitivity(
            model,
            partial(zigzag, rudder_deg=20.0, heading_deg=20.0, must_reverse=False),
        )
    except UnstableModelError:
        return {}
    return {name: finite(effect) for name, effect in effects.items()}
