"""Structures and methods tried on the same trials, for `structure = "auto"`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

from identification.judging.rudder_bias import with_bias
from identification.judging.selection import (
    RESPONSES,
    Fitted,
    RankedFit,
    fit_name,
    rank_by_likelihood,
    simplest,
)
from identification.models.refinement import Refinement, whole_trials
from identification.models.similarity import AUTO, with_usual_hull
from identification.pipeline.options import MAP, Options, name_of
from identification.pipeline.result import IdentificationResult
from identification.progress import counted
from identification.samples.folds import pieces
from shipgym import InputError, Particulars, Trial
from shipgym.ships.structures import GREY_BOX, MMG

TABLES = (
    *RESPONSES,
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
#: Tables that are fitted by output error, too, where they predict best by regression.
REFINED = ("linear-steering", "steering7", "abkowitz", "cubic")


class Candidate(Fitted, Protocol):
    """A structure fitted to trials, from which a result can be made."""

    def result(
        self, options: Options, sea: Mapping[str, Any] | None = None
    ) -> IdentificationResult:
        """The model with uncertainty and predictions."""


#: From trials and options of a structure that is named to its fit.
FitTrials = Callable[[Sequence[Trial], Options], Candidate]


class Choice(NamedTuple):
    """The structure and method that predict best."""

    options: Options
    fit: Candidate  # of all trials
    report: dict[str, Any]  # the ranking, for the provenance


def select(
    fit: FitTrials,
    trials: Sequence[Trial],
    options: Options,
) -> Choice:
    """The structure and method that predict trials left out best.

    Every structure that trials and particulars allow is fitted by its usual method, the
    table that comes first by output error too, and each trial (each third of a single
    one) predicted by fits without it; those of the largest rudder also by fits to the
    trials of less rudder. Candidates are compared by the likelihood of all channels
    that were measured (`judging.selection`). Those that run away in a hard turn are
    last. The choice is the one with the fewest coefficients within one standard error
    of the paired difference from the best. A method other than the default is the only
    one, and what does not know a setting is refused; InputError where nothing can be
    fitted, with the first reason.
    """
    to_fit = [trial for trial in trials if trial.use == "fit"]
    parts = list(trials)
    held_out = "each trial in turn"
    single = len(to_fit) == 1
    if single:
        parts = [part.with_(kind=None) for part in pieces(to_fit[0])]
        held_out = "each third of the only trial"
    attempts = _Attempts(fit, parts, options)
    attempts.add_all()

    ranked = attempts.by_rank()
    best = simplest(ranked)
    others = [other for other in ranked if other is not best]
    report = {
        "held_out": held_out,
        "ranking": [one.plain() for one in (best, *others)],
        "refused": attempts.refused,
    }
    own, whole = attempts.fits[fit_name(best.structure, best.method)]
    if single:
        whole = fit(trials, own)
    found = Choice(own, whole, report)
    if options.rudder_bias == "none":
        return found
    biased = f"{best.structure}-bias"
    if biased in STRUCTURES and options.method_is_default:
        return _response_with_bias(found, biased, fit, trials)
    return _with_bias(found, fit, trials)


def _with_bias(choice: Choice, fit: FitTrials, trials: Sequence[Trial]) -> Choice:
    """The same table with a constant, where it has none and the bias differs from 0."""
    table = with_bias(choice.fit.model, choice.fit.problem)
    if table is None:
        return choice
    options = replace(choice.options, structure=table)
    other = fit(trials, options)
    return Choice(options, other, choice.report) if other.stable else choice


def _response_with_bias(
    choice: Choice, structure: str, fit: FitTrials, trials: Sequence[Trial]
) -> Choice:
    """The same structure with the bias of the rudder, where that differs from 0.

    By the standard error of the bias in the fit to all trials: in what is predicted
    from the start of a short piece it hardly shows.
    """
    options = replace(choice.options, structure=structure, method=whole_trials())
    other = fit(trials, options)
    bias = other.result(options).metrics.get("rudder_bias")
    report = choice.report | {"rudder_bias": bias}
    if bias is None or not bias["significant"] or not other.stable:
        return choice._replace(report=report)
    return Choice(options, other, report)


@dataclass(frozen=True, eq=False)
class _Attempts:
    """Structures and methods that were tried on the same trials."""

    fit: FitTrials
    trials: Sequence[Trial]
    options: Options
    ranked: list[RankedFit] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # why, by name
    fits: dict[str, tuple[Options, Candidate]] = field(default_factory=dict)  # by name

    def add_all(self) -> None:
        """Try all structures, each by its usual methods, the best table by others too.

        Raises InputError where none can be fitted.
        """
        free = self.options.method_is_default
        for structure in counted("structures", STRUCTURES):
            method = self.options.method
            if free:
                method = _usual_method(structure, method)
            self.add(structure, method)
        if not self.ranked:
            first_reason = next(iter(self.refused.values()))
            raise InputError(first_reason)

        best = next((one for one in self.by_rank() if one.structure in REFINED), None)
        if free and best is not None:
            self.add(best.structure, Refinement())

    def add(self, structure: str, method: Any) -> None:
        """Try a structure and a method, or remember why it cannot be fitted."""
        reference = reference_of(structure, self.options.reference_model)
        own = replace(
            self.options,
            structure=structure,
            method=method,
            reference_model=reference,
            prior=self.options.prior if structure == MMG else None,
        )
        if structure in (GREY_BOX, MMG) and own.particulars is not None:
            own = replace(own, particulars=_of_usual_hull(own.particulars))
        by = MAP if structure == MMG else name_of(method)
        name = fit_name(structure, by)
        try:
            found = self.fit(self.trials, own)
            self.ranked.append(rank_by_likelihood(structure, by, found))
        except InputError as error:
            self.refused[name] = str(error)
        else:
            self.fits[name] = own, found

    def by_rank(self) -> list[RankedFit]:
        """The fits, the best first."""
        return sorted(self.ranked, key=lambda fit: fit.rank)


def _usual_method(structure: str, method: Any) -> Any:
    """The method that a structure is fitted by, where none is named."""
    if structure in RESPONSES:
        return whole_trials()
    return RM_SVM if structure == GREY_BOX else method


def _of_usual_hull(given: Particulars | Mapping[str, Any]) -> Particulars:
    """Particulars by which a reference ship or formulas are found."""
    if not isinstance(given, Particulars):
        given = Particulars.from_mapping(given)
    return with_usual_hull(given)


def reference_of(structure: str, named: Any) -> Any:
    """The reference ship of a structure that knows one, as named; None for others."""
    if structure == GREY_BOX:
        return named or AUTO
    if structure == MMG:
        return named
    return None
