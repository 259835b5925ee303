"""Structures and methods on the same trials, ranked by what they predict."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.judging.selection import RankedFit, fit_name, ranked_fit
from identification.judging.uncertainty import Uncertainty
from identification.models.methods import METHODS, get_method
from identification.pipeline import identify
from identification.pipeline.choice import (
    RM_SVM,
    STRUCTURES,
    methods_of,
    reference_of,
)
from identification.pipeline.options import AUTO, DEFAULT_METHOD, Options, name_of
from identification.pipeline.result import IdentificationResult
from identification.progress import counted
from identification.samples.problem import held_out
from shipgym import InputError, Trial, list_structures
from shipgym.checks import check_number
from shipgym.files import write_json
from shipgym.ships import Structure
from shipgym.ships.structures import GREY_BOX, MMG

#: Compared where none are named; for a grey box also RM-SVM.
USUAL = (
    "ls",
    "ridge",
    "tls-svm",
    "cv-lssvr",
    "abc-lssvr",
    "tmils",
    "output-error",
)
#: Files of a saved comparison: of the models only those of the methods, or of the
#: structures, compared.
COMPARISON_FILES = (
    "comparison.json",
    *(f"model-{name}.json" for name in (*METHODS, *list_structures())),
)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Structures and methods on the same trials, ranked."""

    #: the best first: those that run away on fewest trials, and among them the smallest
    #: error
    ranked: tuple[RankedFit, ...]
    #: identified from all trials to fit, in the same order, by method, of several
    #: structures by "STRUCTURE by METHOD"
    results: dict[str, IdentificationResult]
    refused: dict[str, str]  # why a method could not be fitted
    #: whether no trial was marked `validate`, so that each trial to fit was held out in
    #: turn
    in_turn: bool

    @property
    def best(self) -> IdentificationResult:
        """The result of the first of the ranking."""
        return next(iter(self.results.values()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        held_out = "each trial in turn" if self.in_turn else "trials marked validate"
        return {
            "held_out": held_out,
            "ranking": [asdict(fit) for fit in self.ranked],
            "refused": self.refused,
            "settings": self.best.settings | {"method": list(self.results)},
        }

    def save(self, folder: str | Path) -> None:
        """Write `comparison.json` and models.

        Of one structure the model of each method, `model-METHOD.json`; of several the
        best model of each, `model-STRUCTURE.json`.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        one_structure = self.ranked[0].method in self.results
        saved = set[str]()
        for fit, result in zip(self.ranked, self.results.values(), strict=True):
            name = fit.method if one_structure else fit.structure
            if name not in saved:
                result.model.save(folder / f"model-{name}.json")
            saved.add(name)
        write_json(self.to_dict(), folder / "comparison.json")


def compare_methods(
    trials: Sequence[Trial],
    methods: Sequence[Any] | None = None,
    structures: Sequence[str | Structure] | None = None,
    **arguments: Any,
) -> Comparison:
    """Identify by several methods, or structures too, and rank them on held-out trials.

    These are marked `validate` or named by `hold_out`; where there are none, each trial
    to fit in turn.

    Raises InputError for an unknown method, no two trials to hold one out of, and where
    nothing can be fitted.

    Parameters
    ----------
    trials : sequence of Trial
        As for `identify`.
    methods : sequence of str or estimator, optional
        By default `USUAL`, and `rm-svm` for a grey box; of several structures those of
        "auto".
    structures : sequence of str or Structure, optional
        As for `identify`; `auto` for all that it tries. A `reference_model` goes to
        those that know one.
    **arguments
        Of `identify` but for `method`.
    """
    arguments = {"rudder_bias": "none", **arguments}  # structures as they are named
    wanted = structures or [arguments.pop("structure", Options.structure)]
    several = structures is not None or AUTO in wanted
    pairs = _pairs(STRUCTURES if AUTO in wanted else wanted, methods, several)
    marked = held_out(trials, arguments.get("hold_out", ()))
    held = [trial for trial in marked if trial.use == "validate"]

    found = list[tuple[RankedFit, IdentificationResult]]()
    refused = dict[str, str]()
    for structure, method in counted("structures and methods", pairs):
        own = dict(arguments)
        if several:
            named = own.get("reference_model")
            own["reference_model"] = reference_of(structure, named)
        try:
            result = identify(trials, structure, method, **own)
            seen = {trial.name: result.metrics["trials"][trial.name] for trial in held}
            if not held:
                own = {**own, "structure": structure, "method": method}
                seen = cross_validate(marked, **own)
        except InputError as error:
            name = get_method(method).name
            refused[fit_name(name_of(structure), name) if several else name] = str(
                error
            )
            continue
        found.append((ranked_fit([result], seen, trials), result))

    if not found:
        raise InputError(next(iter(refused.values())))
    found.sort(key=lambda entry: entry[0].rank)
    results = {
        fit_name(fit.structure, fit.method) if several else fit.method: result
        for fit, result in found
    }
    ranked = tuple(fit for fit, _ in found)
    return Comparison(ranked, results, refused, in_turn=not held)


def _pairs(
    structures: Sequence[Any], methods: Sequence[Any] | None, several: bool
) -> list[tuple[Any, Any]]:
    """Structures, each with the methods that it is fitted by; neither twice.

    These are the `methods` given; of several structures the MMG form takes the first.
    """
    pairs: list[tuple[Any, Any]] = []
    for structure in {name_of(one): one for one in structures}.values():
        own = methods
        if own is None and several:
            own = methods_of(structure, DEFAULT_METHOD)
        elif own is None:
            own = (*USUAL, RM_SVM) if structure == GREY_BOX else USUAL
        elif several and structure == MMG:
            own = own[:1]
        named = {get_method(method).name: method for method in own}
        pairs += [(structure, method) for method in named.values()]
    if not pairs:
        raise InputError(
            "methods: expected at least one, such as ['ls', 'tls-svm'], got none"
        )
    return pairs


def cross_validate(
    trials: Sequence[Trial], folds: int | None = None, **arguments: Any
) -> dict[str, Any]:
    """Predict each trial by a model identified from others.

    Returns, for each trial by its name, the metrics (`IdentificationResult.metrics`) of
    its prediction. Raises InputError for fewer than 2 trials or more folds than trials.

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" take part.
    folds : int, optional
        Groups of trials that are held out together, in their order; by default each by
        itself.
    **arguments
        Of `identify`.
    """
    used = [trial for trial in trials if trial.use == "fit"]
    if len(used) < 2:
        raise InputError(
            f"trials: expected at least 2 to fit, to hold one out, got {len(used)}"
        )
    groups = check_number(
        len(used) if folds is None else folds,
        "folds",
        at_least=2,
        at_most=len(used),
        hint="at most one per trial",
    )
    own: Mapping[str, Any] = {
        "uncertainty": Uncertainty(model_error=False),
        **arguments,
    }
    group = np.arange(len(used)) * int(groups) // len(used)
    metrics = dict[str, Any]()
    for number in range(int(groups)):
        held = [used[place].name for place in np.flatnonzero(group == number)]
        result = identify(used, **{**own, "hold_out": held})
        metrics |= {name: result.metrics["trials"][name] for name in held}
    return metrics
