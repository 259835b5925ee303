"""Which structure and method predict held-out trials best, for `structure = "auto"`."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from identification.options import MAP, Options, name_of
from identification.progress import counted
from identification.result import IdentificationResult
from identification.simulation_error.similarity import AUTO
from identification.uncertainty.uncertainty import Uncertainty
from identification.validation.folds import pieces
from identification.validation.ranking import (
    RankedFit,
    fit_name,
    in_turn,
    ranked_fit,
)
from shipgym import InputError, Trial
from shipgym.ships.structures import GREY_BOX, MMG

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
#: Methods that a table that predicts best is also fitted by; quick ones.
OTHERS = ("ls", "cv-lssvr")

#: From trials and options to a result, as `identify` without particulars and gear.
Identify = Callable[[Sequence[Trial], Options], IdentificationResult]


def select(
    identify: Identify,
    trials: Sequence[Trial],
    options: Options,
    structures: Sequence[str] = STRUCTURES,
) -> tuple[Options, dict[str, Any]]:
    """The options with the structure and method that predict best, and the ranking.

    Every structure that trials and particulars allow is fitted by its usual method, a
    table that comes first by others too, and each trial (each third of a single one)
    predicted by fits without it. The choice is the one with the fewest coefficients
    whose error exceeds the least by no more than one standard error of their difference
    over the trials, or by 2 %. A method other than the default is the only one, and
    what does not know a setting is refused; InputError where nothing can be fitted,
    with the first reason. The ranking is for the provenance.
    """
    parts = trials
    held_out = "each trial in turn"
    if len(trials) == 1:
        parts = pieces(trials[0])
        held_out = "each third of the only trial"
    parts = [part.with_(kind=None) for part in parts]
    attempts = _Attempts(identify, parts, options)
    attempts.add_all(structures)

    ranked = attempts.by_rank()
    best = simplest(ranked)
    others = [fit for fit in ranked if fit is not best]
    report = {
        "held_out": held_out,
        "ranking": [asdict(fit) for fit in (best, *others)],
        "refused": attempts.refused,
    }
    return _chosen(options, best), report


@dataclass(frozen=True, eq=False)
class _Attempts:
    """Structures and methods that were tried on the same trials."""

    identify: Identify
    trials: Sequence[Trial]
    options: Options
    ranked: list[RankedFit] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # why, by name

    def add_all(self, structures: Sequence[str]) -> None:
        """Try structures, each by its usual method, the best table by others too.

        Raises InputError where none can be fitted.
        """
        free = self.options.method_is_default
        for structure in counted("structures", structures):
            method = self.options.method
            if free:
                method, *_ = methods_of(structure, method)
            self.add(structure, method)
        if not self.ranked:
            first_reason = next(iter(self.refused.values()))
            raise InputError(first_reason)

        best, *_ = self.by_rank()
        if free and best.structure in TABLES:
            for method in OTHERS:
                self.add(best.structure, method)

    def add(self, structure: str, method: Any) -> None:
        """Try a structure and a method, or remember why it cannot be fitted."""
        own = replace(
            self.options,
            structure=structure,
            method=method,
            reference_model=reference_of(structure, self.options.reference_model),
            hold_out=(),
            uncertainty=Uncertainty(model_error=False),
        )
        try:
            self.ranked.append(self._predicted(own))
        except InputError as error:
            name = fit_name(structure, MAP if structure == MMG else name_of(method))
            self.refused[name] = str(error)

    def _predicted(self, options: Options) -> RankedFit:
        """The fit of some options, ranked by what it predicts of trials held out."""

        def without(held: list[str]) -> IdentificationResult:
            return self.identify(self.trials, replace(options, hold_out=held))

        most_groups = 5
        seen, results = in_turn(without, self.trials, most_groups)
        if not all(result.stable for result in results):
            # the fit of all trials is what would be used
            results = [self.identify(self.trials, options)]
        return ranked_fit(results, seen, self.trials)

    def by_rank(self) -> list[RankedFit]:
        """The fits, the best first."""
        return sorted(self.ranked, key=lambda fit: fit.rank)


def _chosen(options: Options, best: RankedFit) -> Options:
    """The options of the best fit; the method stays where one was named."""
    structure = best.structure
    method = options.method
    if options.method_is_default and structure != MMG:
        method = best.method
    return replace(
        options,
        structure=structure,
        method=method,
        reference_model=reference_of(structure, options.reference_model),
    )


def methods_of(structure: str, usual: str) -> tuple[str, ...]:
    """Methods that a structure is fitted by where none are named, the usual first."""
    if structure == GREY_BOX:
        return (RM_SVM,)
    if structure == MMG:
        return (usual,)
    return (usual, *OTHERS)


def reference_of(structure: str, named: Any) -> Any:
    """The reference ship of a structure that knows one, as named; None for others."""
    if structure == GREY_BOX:
        return named or AUTO
    if structure == MMG:
        return named
    return None


def simplest(ranked: Sequence[RankedFit]) -> RankedFit:
    """The fit of fewest coefficients whose errors differ from the first's by chance."""
    first = ranked[0]
    if first.error is None:
        return first
    as_good = []
    for fit in ranked:
        sails = fit.stable and not fit.ran_away
        if sails and _differs_by_chance(fit, first):
            as_good.append(fit)
    return min(
        as_good,
        key=lambda fit: (fit.coefficients, fit.method in OTHERS),
        default=first,
    )


def _differs_by_chance(fit: RankedFit, first: RankedFit) -> bool:
    """Tell whether errors exceed the first's by one standard error, or 2 %, at most."""
    differences = []
    for name, error in first.errors.items():
        own = fit.errors[name] or 0.0
        difference = own - (error or 0.0)
        differences.append(difference)
    n_trials = len(differences)
    excess = np.mean(differences)
    deviation = float(np.std(differences, ddof=1))
    standard_error = deviation / np.sqrt(n_trials)
    nothing = 0.02 * (first.error or 0.0)
    return bool(excess <= max(standard_error, nothing))
