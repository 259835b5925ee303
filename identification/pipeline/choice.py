"""Structures and methods tried on the same trials, for `structure = "auto"`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from identification.judging.selection import (
    RESPONSES,
    RankedFit,
    fit_name,
    rank_by_likelihood,
    simplest,
)
from identification.models.refinement import Refinement, whole_trials
from identification.models.similarity import with_usual_hull
from identification.pipeline.by_regression import with_rudder_bias
from identification.pipeline.options import MAP, Options, name_of
from identification.progress import counted
from identification.samples.folds import pieces
from shipgym import InputError, Trial
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


#: From trials and options of a structure that is named to its fit.
FitTrials = Callable[[Sequence[Trial], Options], Any]


class Choice(NamedTuple):
    """The structure and method that predict best."""

    options: Options
    fit: Any  # of all trials
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
    single = len(to_fit) == 1
    parts, held_out = list(trials), "each trial in turn"
    if single:
        parts = [part.with_(kind=None) for part in pieces(to_fit[0])]
        held_out = "each third of the only trial"
    attempts = _Attempts(
        fit,
        parts,
        options,
    )
    free = options.method_is_default
    for structure in counted("structures", STRUCTURES):
        attempts.add(structure, _usual_method(structure, options))
    if not attempts.ranked:
        raise InputError(next(iter(attempts.refused.values())))
    tables = [one for one in attempts.by_rank() if one.structure in REFINED]
    if free and tables:
        attempts.add(tables[0].structure, Refinement())

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
    if options.rudder_bias == "none" or best.structure == MMG:
        return found
    return _with_bias(found, fit, trials)


def _with_bias(choice: Choice, fit: FitTrials, trials: Sequence[Trial]) -> Choice:
    """The same table with a constant, where it has none and the bias differs from 0.

    Of a response by the standard error of the bias in the fit to all trials: in what is
    predicted from the start of a short piece it hardly shows.
    """
    options, report = choice.options, choice.report
    biased = f"{name_of(options.structure)}-bias"
    if biased not in RESPONSES or not isinstance(options.method, Refinement):
        return Choice(*with_rudder_bias(choice.fit, options), report)
    asked = replace(options, structure=biased)
    other = fit(trials, asked)
    bias = other.result(asked).metrics.get("rudder_bias")
    report = report | {"rudder_bias": bias}
    if bias is None or not bias["significant"] or not other.stable:
        return choice._replace(report=report)
    return Choice(asked, other, report)


@dataclass(frozen=True, eq=False)
class _Attempts:
    """Structures and methods that were tried on the same trials."""

    fit: FitTrials
    trials: Sequence[Trial]
    options: Options
    ranked: list[RankedFit] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # why, by name
    fits: dict[str, tuple[Options, Any]] = field(default_factory=dict)  # by name

    def add(self, structure: str, method: Any) -> None:
        """Try a structure and a method, or remember why it cannot be fitted."""
        asked = self.options
        own = replace(
            asked,
            structure=structure,
            method=method,
            reference_model=asked.reference_model if structure == GREY_BOX else None,
            prior=asked.prior if structure == MMG else None,
        )
        if structure in (GREY_BOX, MMG) and own.particulars is not None:
            own = replace(own, particulars=with_usual_hull(own.particulars))
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


def _usual_method(structure: str, options: Options) -> Any:
    """The method that a structure is fitted by: the one that is named, if any."""
    if options.method_is_default and structure in RESPONSES:
        return whole_trials()
    if options.method_is_default and structure == GREY_BOX:
        return RM_SVM
    return options.method
