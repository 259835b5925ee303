"""Routes to a model but for regression: structures compared, kernels, the MMG form."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

from identification.estimators.kernel_residual import KernelResidual
from identification.estimators.linear import Estimators
from identification.judging.selection import (
    RESPONSES,
    RankedFit,
    fit_name,
    rank_by_likelihood,
    share_that_runs_away,
    simplest,
)
from identification.models.guard import GuardedFit, reasons_unstable
from identification.models.kernel_fit import fit_kernel
from identification.models.maximum_a_posteriori import (
    MMGFit,
    fit_mmg,
)
from identification.models.prior_knowledge import PriorKnowledge
from identification.models.refinement import Refinement, whole_trials
from identification.models.similarity import with_usual_hull
from identification.pipeline.by_regression import (
    RegressionFit,
    by_regression,
    certain,
    fit_regression,
    provenance_of,
    with_rudder_bias,
    with_uncertainty,
)
from identification.pipeline.options import (
    AUTO,
    DEFAULT_METHOD,
    MAP,
    Options,
    name_of,
    whole_call,
)
from identification.pipeline.pose import pose
from identification.pipeline.result import IdentificationResult, with_provenance
from identification.progress import counted
from identification.samples.problem import Problem, pieces
from shipgym import InputError, ShipModel, Trial
from shipgym.models.catalogue import fitted_box
from shipgym.ships import GreyBox
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
#: Share of the ships drawn from a choice that may run away in a hard turn.
MOST_THAT_RUN_AWAY = 0.4


class Choice(NamedTuple):
    """The structure and method that predict best."""

    options: Options
    fit: Any  # of all trials
    report: dict[str, Any]  # the ranking, for the provenance
    result: IdentificationResult | None = None  # where it is known already


def select(trials: Sequence[Trial], options: Options) -> Choice:
    """The structure and method that predict trials left out best.

    Every structure that trials and particulars allow is fitted by its usual method, the
    table that comes first by output error too, and each trial (each third of a single
    one) predicted by fits without it; those of the largest rudder also by fits to the
    trials of less rudder. Candidates are compared by the likelihood of all channels
    that were measured (`judging.selection`). Those that run away in a hard turn are
    last. The choice is the one with the fewest coefficients within one standard error
    of the paired difference from the best; one is passed over where two fifths of the
    ships drawn from it run away in a hard turn, as the trials do not tell so many
    coefficients. A method other than the default is the only
    one, and what does not know a setting is refused; InputError where nothing can be
    fitted, with the first reason.
    """
    to_fit = [trial for trial in trials if trial.use == "fit"]
    single = len(to_fit) == 1
    parts, held_out = list(trials), "each trial in turn"
    if single:
        parts = [part.with_(kind=None) for part in pieces(to_fit[0])]
        held_out = "each third of the only trial"
    attempts = _Attempts(parts, options)
    free = options.method is None
    for structure in counted("structures", STRUCTURES):
        attempts.add(structure, _usual_method(structure, options))
    if not attempts.ranked:
        raise InputError(next(iter(attempts.refused.values())))
    tables = [one for one in attempts.by_rank() if one.structure in REFINED]
    if free and tables:
        attempts.add(tables[0].structure, Refinement())

    ranked = attempts.by_rank()
    best = attempts.usable(ranked)
    others = [other for other in ranked if other is not best]
    report = {
        "held_out": held_out,
        "ranking": [one.plain() for one in (best, *others)],
        "refused": attempts.refused,
        "passed_over": attempts.passed_over,
    }
    name = fit_name(best.structure, best.method)
    own, whole = attempts.fits[name]
    known = attempts.results.get(name)
    if single:
        whole, known = fitted(trials, own), None
    found = Choice(own, whole, report, known)
    if options.rudder_bias == "none" or best.structure == MMG:
        return found
    return _with_bias(found, trials)


def _with_bias(choice: Choice, trials: Sequence[Trial]) -> Choice:
    """The same table with a constant, where it has none and the bias differs from 0.

    Of a response by the standard error of the bias in the fit to all trials: in what is
    predicted from the start of a short piece it hardly shows.
    """
    options, report = choice.options, choice.report
    biased = f"{name_of(options.structure)}-bias"
    if biased not in RESPONSES or not isinstance(options.method, Refinement):
        own, fit = with_rudder_bias(choice.fit, options)
        return choice if fit is choice.fit else Choice(own, fit, report)
    asked = replace(options, structure=biased)
    other = fitted(trials, asked)
    bias = other.result(asked).metrics.get("rudder_bias")
    report = report | {"rudder_bias": bias}
    if bias is None or not bias["significant"] or not other.stable:
        return choice._replace(report=report)
    return Choice(asked, other, report)


@dataclass(frozen=True, eq=False)
class _Attempts:
    """Structures and methods that were tried on the same trials."""

    trials: Sequence[Trial]
    options: Options
    ranked: list[RankedFit] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # why, by name
    fits: dict[str, tuple[Options, Any]] = field(default_factory=dict)  # by name
    results: dict[str, IdentificationResult] = field(default_factory=dict)
    #: share of the draws that run away, by name
    passed_over: dict[str, float] = field(default_factory=dict)

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
            found = fitted(self.trials, own)
            self.ranked.append(rank_by_likelihood(structure, by, found))
        except InputError as error:
            self.refused[name] = str(error)
        else:
            self.fits[name] = own, found

    def usable(self, ranked: Sequence[RankedFit]) -> RankedFit:
        """The simplest of the best whose draws are ships; if none has, of all."""
        left = [*ranked]
        while left:
            best = simplest(left)
            name = fit_name(best.structure, best.method)
            own, whole = self.fits[name]
            self.results[name] = whole.result(own)
            share = share_that_runs_away(self.results[name].model)
            if share < MOST_THAT_RUN_AWAY:
                return best
            self.passed_over[name] = share
            left.remove(best)
        self.passed_over.clear()
        return simplest(ranked)

    def by_rank(self) -> list[RankedFit]:
        """The fits, the best first."""
        return sorted(self.ranked, key=lambda fit: fit.rank)


def _usual_method(structure: str, options: Options) -> Any:
    """The method that a structure is fitted by: the one that is named, if any."""
    if options.method is not None:
        return options.method
    if structure in RESPONSES:
        return whole_trials()
    return {GREY_BOX: RM_SVM, MMG: MAP}.get(structure, DEFAULT_METHOD)


def identified(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Identify by the route that the options ask for."""
    if options.kernel is not None:
        return by_kernel(
            trials,
            options,
            options.kernel,
        )
    if options.structure == AUTO:
        return by_selection(trials, options)
    if options.structure == MMG:
        return fit_simulation(trials, options).result(options)
    return by_regression(trials, options)


def by_selection(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """By the structure and method that predict trials to fit best, each held out."""
    choice = select(trials, options)
    best: IdentificationResult = choice.result or choice.fit.result(choice.options)
    selection = {"selection": choice.report}
    return replace(
        with_provenance(best, selection),
        metrics=best.metrics | selection,
        settings=whole_call(options, trials),
    )


def fitted(trials: Sequence[Trial], options: Options) -> RegressionFit | SimulationFit:
    """The fit of a structure that is named, before its uncertainty and predictions."""
    if options.structure == MMG:
        return fit_simulation(trials, options)
    return fit_regression(trials, options)


def by_kernel(
    trials: Sequence[Trial], options: Options, kernel: KernelResidual
) -> IdentificationResult:
    """A reference ship, fitted or named, and a kernel on what she leaves."""
    if options.uncertainty.by_sampling:
        raise InputError(
            "uncertainty: expected 'analytic' with a kernel, got 'posterior'; leave"
            " one of them out"
        )
    method = "ls-svm"
    if options.structure == GREY_BOX and options.method is not None:
        raise InputError(
            "method: expected none with a kernel on a grey box, which is fitted by"
            f" LS-SVM, got {name_of(options.method)!r}; leave it out"
        )
    beneath = replace(options, kernel=None)
    problem = pose(trials, beneath)
    reference = problem.blank
    box = problem.table
    if set(box.equations) != set("uvr"):
        raise InputError(
            "kernel: expected a structure beneath it with equations of u, v and r, got"
            f" {box.name!r} with those of {', '.join(box.equations)}; choose 'linear'"
            " or 'abkowitz', or leave the kernel out"
        )
    if not isinstance(box, GreyBox):
        reference = identified(trials, beneath).model
        method = (reference.provenance or {})["method"]
        box = fitted_box(reference)
    found = fit_kernel(kernel, reference, problem, box)
    problem = replace(
        problem,
        blank=found.model,
        table=found.model.table,
        samples=found.samples,
    )
    fit = _guard_report(
        found.model,
        found.estimators,
        reasons_unstable(found.model, problem.used),
    )
    provenance = provenance_of(options, method, fit, problem)
    provenance["kernel"] = found.report
    return with_uncertainty(fit, problem, provenance, options)


@dataclass(frozen=True, eq=False)
class SimulationFit:
    """The MMG form, and what it would be without some trials."""

    problem: Problem
    fit: MMGFit

    @property
    def model(self) -> ShipModel:
        """The model of all trials."""
        return self.fit.model

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients that the trials, and not the prior, determine."""
        return self.fit.free_coefficients

    @cached_property
    def reasons(self) -> list[str]:
        """Simulations in which the model of all trials runs away."""
        return reasons_unstable(self.model, self.problem.used)

    @property
    def stable(self) -> bool:
        """Whether the model of all trials passes the guard."""
        return not self.reasons

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places."""
        return self.fit.without(trials)

    def result(self, options: Options) -> IdentificationResult:
        """The model with provenance and predictions."""
        options = checked_mmg(options)
        model = self.model
        problem = replace(self.problem, blank=model)
        fit = _guard_report(model, {}, self.reasons)
        provenance = provenance_of(options, MAP, fit, problem)
        provenance |= deepcopy(self.fit.report)
        return certain(
            model,
            fit,
            problem,
            provenance,
            options,
            self.without,
            self.fit.prior,
        )


def fit_simulation(trials: Sequence[Trial], options: Options) -> SimulationFit:
    """The MMG form by its simulation error, before its predictions."""
    options = checked_mmg(options)
    problem = pose(trials, options)
    asked = options.prior or PriorKnowledge()
    return SimulationFit(problem, fit_mmg(problem.blank, problem.used, asked))


def checked_mmg(options: Options) -> Options:
    """The options of an identification of the MMG form.

    Raises InputError for those that it does not have.
    """
    if options.method is not None and options.method != MAP:
        raise InputError(
            "method: expected none with structure 'mmg', got"
            f" {name_of(options.method)!r}; it is not linear in its coefficients and is"
            " fitted by simulation error with a prior: leave the method and its"
            " settings out, or choose another structure"
        )
    return replace(options, method=MAP)


def _guard_report(
    model: ShipModel, estimators: Estimators, reasons: list[str]
) -> GuardedFit:
    """A fit that was not guarded, and the simulations in which it runs away."""
    report: dict[str, Any] = {"decision": "stable as fitted"}
    if reasons:
        report = {"decision": "runs away", "rejected": reasons}
    return GuardedFit(model, estimators, not reasons, report)
