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
from shipgym import InputError, Trial, list_structures, register_structure
from shipgym.arrays import finite
from shipgym.ships import GreyBox, Structure, get_structure
from shipgym.ships.structures import GREY_BOX


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
    path = []
    for step in reduction.path:
        fields = asdict(step)
        errors = step.relative_errors.items()
        fields["relative_errors"] = {name: finite(error) for name, error in errors}
        path.append(fields)
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
    asked = arguments.get("structure")
    if isinstance(asked, str) and asked in list_structures() and asked != GREY_BOX:
        _check_reducible(get_structure(asked))
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
    terms = []
    for q in structure.equations:
        names = [term.name for term in structure.terms(q)]
        terms.append((q, names))
    text = repr(terms)
    digest = hashlib.sha256(text.encode()).hexdigest()
    short = digest[:6]
    return f"{structure.name}-{short}"


def reduce(
    samples: Samples, structure: Structure, tolerance: float = 1e-3
) -> dict[str, Reduction]:
    """Reduce each equation by elimination.

    Returns the reductions by equation, with the coefficients of the features in SI
    units; the tolerance is that of the held-out R2.
    """
    reductions = {}
    for q in structure.equations:
        reductions[q] = backward_elimination(
            samples.features[q],
            samples.targets[q],
            structure.names(q),
            tolerance=tolerance,
        )
    return reductions


def reduced_structure(
    structure: Structure, reductions: Mapping[str, Reduction], name: str
) -> Structure:
    """The structure, by a name of its own, with the terms that were chosen.

    Register it to identify it. Of forces, sway and yaw, which inertia couples, keep the
    terms that either needs.
    """
    kept = dict[str, set[str]]()
    for q in structure.equations:
        chosen = reductions[q].terms
        kept[q] = set()
        for term, label in zip(structure.terms(q), structure.names(q), strict=True):
            if label in chosen:
                kept[q].add(term.name)
    if structure.quantity == "force" and {"v", "r"} <= kept.keys():
        either = kept["v"] | kept["r"]
        kept["v"] = kept["r"] = either

    equations = {}
    for q, names in kept.items():
        terms = [term for term in structure.terms(q) if term.name in names]
        equations[q] = tuple(terms)
    return replace(
        structure,
        name=name,
        source=f"{structure.source}; reduced",
        equations=equations,
    )
