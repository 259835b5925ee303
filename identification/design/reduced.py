"""Identify with the terms that are needed: a structure reduced on its samples."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from identification.design.reduction import (
    Reduction,
    backward_elimination,
)
from identification.pipeline import identify
from identification.pipeline.result import IdentificationResult
from identification.samples.samples import Samples
from shipgym import InputError, Trial, register_structure
from shipgym.arrays import finite
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
        full, reduced = self.full, self.reduced
        equations = {
            q: {"chosen": reduction.chosen, "path": _plain_path(reduction)}
            for q, reduction in self.reductions.items()
        }
        return {
            "structure": self.structure.name,
            "equations": equations,
            "terms": {
                "full": len(full.coefficients),
                "reduced": len(reduced.coefficients),
            },
            "trials": {
                "full": full.metrics["trials"],
                "reduced": reduced.metrics["trials"],
            },
        }


def _plain_path(reduction: Reduction) -> list[dict[str, Any]]:
    """The steps of a reduction, infinite errors as null."""
    path = [asdict(step) for step in reduction.path]
    for step in path:
        errors = step["relative_errors"]
        step["relative_errors"] = {name: finite(one) for name, one in errors.items()}
    return path


def identify_reduced(
    trials: Sequence[Trial],
    tolerance: float = 1e-3,
    **arguments: Any,
) -> ReducedIdentification:
    """Identify a structure, reduce it on the same samples, and identify what is left.

    Raises InputError for a grey box, whose table is what its reference ship leaves, for
    a structure with a memory of yaw, and for fewer than five samples a term.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`. Those held out have no part in the reduction either.
    tolerance : float
        By how much the R2 of stretches held out may fall.
    **arguments
        Of `identify`.
    """
    full = identify(trials, **arguments)
    table = full.model.table
    _check_reducible(table)
    reductions = reduce(full.samples, table, tolerance)
    smaller = reduced_structure(table, reductions, table.name)
    registered = register_structure(
        _name_by_terms(smaller),
        smaller.equations,
        smaller.source,
        smaller.normalisation,
        smaller.quantity,
    )
    reduced = identify(trials, **{**arguments, "structure": registered.name})
    return ReducedIdentification(full, reductions, registered, reduced)


def _check_reducible(table: Structure) -> None:
    """Refuse a structure whose equations are not those of its regression."""
    if isinstance(table, GreyBox):
        raise InputError(
            "structure: expected one of its own to reduce, such as 'abkowitz', got"
            f" {table.name!r}, whose table adds to a reference ship"
        )
    if tuple(table.regressed) != tuple(table.equations):
        raise InputError(
            "structure: expected one without memory to reduce, such as 'abkowitz', got"
            f" {table.name!r}, whose memory of yaw has no regression of its own"
        )


def _name_by_terms(structure: Structure) -> str:
    """The name of a reduced structure, its own among all reductions."""
    names = [structure.names(q) for q in structure.equations]
    digest = hashlib.sha256(repr(names).encode()).hexdigest()
    return f"{structure.name}-{digest[:6]}"


def reduce(
    samples: Samples, structure: Structure, tolerance: float = 1e-3
) -> dict[str, Reduction]:
    """Reduce each equation by elimination.

    Returns the reductions by equation, with the coefficients of the features in SI
    units; the tolerance is that of the held-out R2.
    """
    return {
        q: backward_elimination(X, y, structure.names(q), tolerance=tolerance)
        for q, X, y in samples.by_equation()
    }


def reduced_structure(
    structure: Structure, reductions: Mapping[str, Reduction], name: str
) -> Structure:
    """The structure, by a name of its own, with the terms that were chosen.

    Register it to identify it. Of forces, sway and yaw, which inertia couples, keep the
    terms that either needs.
    """
    kept = {
        q: {
            term.name
            for term, label in zip(
                structure.equations[q], structure.names(q), strict=True
            )
            if label in reductions[q].terms
        }
        for q in structure.equations
    }
    if structure.quantity == "force" and {"v", "r"} <= kept.keys():
        kept["v"] = kept["r"] = kept["v"] | kept["r"]
    equations = {
        q: tuple(term for term in structure.equations[q] if term.name in names)
        for q, names in kept.items()
    }
    source = f"{structure.source}; reduced"
    return replace(
        structure,
        name=name,
        source=source,
        equations=equations,
    )
