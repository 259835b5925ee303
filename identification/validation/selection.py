"""Which structure and which method predict trials held out best, for `structure = "auto"`."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from identification.options import MAP, Options, name_of
from identification.progress import counted
from identification.result import IdentificationResult
from identification.simulation_error.similarity import AUTO
from identification.uncertainty.uncertainty import Uncertainty
from identification.validation.folds import pieces
from identification.validation.ranking import Standing, in_turn, named, standing
from shipgym import InputError, Trial
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.mmg import MMG

TABLES = (
    "nomoto",
    "norrbin",
    "nomoto2",
    "linear-steering",
    "steering7",
    "abkowitz",
    "abkowitz-full",
    "cubic",
    "mmg4dof",
)
STRUCTURES = (*TABLES, GREY_BOX, MMG)
RM_SVM = "rm-svm"
OTHERS = (
    "ls",
    "cv-lssvr",
)  # methods that a table that predicts best is also fitted by; quick ones
MOST_GROUPS = 5  # of trials that are held out together
LEAST_DIFFERENCE = 0.02  # of errors, relative; a smaller one decides nothing


def select(
    identify: Callable[[Sequence[Trial], Options], IdentificationResult],
    trials: Sequence[Trial],
    options: Options,
) -> tuple[Options, dict[str, Any]]:
    """The options with the structure and method that predict best, and the ranking, for the provenance.

    Every structure that trials and particulars allow is fitted by its usual method, a
    table that comes first by others too, and each trial (each third of a single one)
    predicted by fits without it. The choice is the one with the fewest coefficients
    whose error exceeds the least by no more than one standard error of their difference
    over the trials, or by 2 %. A method other than the default is the only one, and
    what does not know a setting is refused; InputError where nothing can be fitted,
    with the first reason.
    """
    free = options.method_is_default
    parts = [
        trial.with_(kind=None)
        for trial in (pieces(trials[0]) if len(trials) == 1 else trials)
    ]
    cheap = replace(options, hold_out=(), uncertainty=Uncertainty(model_error=False))
    found, refused = list[Standing](), dict[str, str]()

    def attempt(structure: str, method: Any) -> None:
        reference = reference_of(structure, options.reference_model)
        own = replace(
            cheap, structure=structure, method=method, reference_model=reference
        )
        try:
            seen, results = in_turn(
                lambda held: identify(parts, replace(own, hold_out=held)),
                parts,
                MOST_GROUPS,
            )
            if not all(
                one.stable for one in results
            ):  # what counts is the fit of all trials
                results = [identify(parts, own)]
            found.append(standing(results, seen, parts))
        except InputError as error:
            refused[named(structure, MAP if structure == MMG else name_of(method))] = (
                str(error)
            )

    for structure in counted("structures", STRUCTURES):
        attempt(
            structure,
            methods_of(structure, options.method)[0] if free else options.method,
        )
    if not found:
        raise InputError(next(iter(refused.values())))
    first = min(found, key=lambda one: one.rank)
    for method in OTHERS if free and first.structure in TABLES else ():
        attempt(first.structure, method)
    found.sort(key=lambda one: one.rank)
    best = _simplest(found)
    method = best.method if free and best.structure != MMG else options.method
    reference = reference_of(best.structure, options.reference_model)
    return replace(
        options, structure=best.structure, method=method, reference_model=reference
    ), {
        "held_out": (
            "each trial in turn" if len(trials) > 1 else "each third of the only trial"
        ),
        "ranking": [
            asdict(one) for one in (best, *(one for one in found if one is not best))
        ],
        "refused": refused,
    }


def methods_of(structure: str, usual: str) -> tuple[str, ...]:
    """Methods that a structure is fitted by where none are named, the first before others are tried."""
    return (
        (RM_SVM,)
        if structure == GREY_BOX
        else (usual,)
        if structure == MMG
        else (usual, *OTHERS)
    )


def reference_of(structure: str, named: Any) -> Any:
    """The reference ship of a structure that knows one, as it was named."""
    return (
        (named or AUTO)
        if structure == GREY_BOX
        else named
        if structure == MMG
        else None
    )


def _simplest(ranked: Sequence[Standing]) -> Standing:
    """Of those whose errors differ from the first's by chance the one with the fewest coefficients."""
    first = ranked[0]
    if first.error is None:
        return first
    tied = [
        one for one in ranked if one.stable and not one.ran_away and _alike(one, first)
    ]
    return min(
        tied, key=lambda one: (one.coefficients, one.method in OTHERS), default=first
    )


def _alike(one: Standing, first: Standing) -> bool:
    excess = np.array(
        [
            (one.errors[name] or 0.0) - (error or 0.0)
            for name, error in first.errors.items()
        ]
    )
    chance = float(np.std(excess, ddof=1)) / np.sqrt(len(excess))
    return bool(excess.mean() <= max(chance, LEAST_DIFFERENCE * (first.error or 0.0)))
