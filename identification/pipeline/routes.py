"""Routes to a model other than the regression of a structure that is named."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from identification.estimators.estimator import Estimators
from identification.estimators.kernel_residual import KernelResidual
from identification.models.guard import GuardedFit, reasons_unstable
from identification.models.kernel_fit import fit_kernel
from identification.models.maximum_a_posteriori import (
    MMGFit,
    fit_mmg,
)
from identification.models.prior_knowledge import PriorKnowledge
from identification.pipeline.by_regression import (
    RegressionFit,
    by_regression,
    fit_regression,
)
from identification.pipeline.choice import select
from identification.pipeline.evaluation import (
    certain,
    provenance_of,
    with_uncertainty,
)
from identification.pipeline.options import (
    AUTO,
    MAP,
    Options,
    name_of,
    whole_call,
)
from identification.pipeline.pose import pose
from identification.pipeline.result import IdentificationResult, with_provenance
from identification.samples.problem import Problem
from shipgym import InputError, ShipModel, Trial
from shipgym.models.catalogue import fitted_box
from shipgym.ships import GreyBox, Structure
from shipgym.ships.structures import GREY_BOX, MMG


def identified(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Identify by the route that the options ask for."""
    if options.kernel is not None:
        return by_kernel(trials, options, options.kernel)
    if options.structure == AUTO:
        return by_selection(trials, options)
    if options.structure == MMG:
        return by_simulation(trials, options)
    return by_regression(trials, options)


def by_selection(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """By the structure and method that predict trials to fit best, each held out."""
    choice = select(fitted, trials, options)
    best: IdentificationResult = choice.fit.result(choice.options)
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
    method = name_of(options.method)
    by_lssvm = ("tls-svm", "ls-svm", "rm-svm")
    if options.structure == GREY_BOX and method not in by_lssvm:
        raise InputError(
            "method: expected none with a kernel on a grey box, which is fitted by"
            f" LS-SVM, got {method!r}; leave it out"
        )
    beneath = replace(options, kernel=None)
    problem = pose(trials, beneath)
    _check_beneath(problem.table)
    reference = problem.blank
    box = problem.table
    if not isinstance(box, GreyBox):
        reference = identified(trials, beneath).model
        box = fitted_box(reference)
    found = fit_kernel(kernel, reference, problem, box)
    problem = replace(
        problem,
        blank=found.model,
        table=found.model.table,
        samples=found.samples,
    )
    reasons = reasons_unstable(found.model, problem.used)
    fit = _guard_report(found.model, found.estimators, reasons)
    provenance = provenance_of(options, method, fit, problem)
    provenance["kernel"] = found.report
    return with_uncertainty(fit, problem, provenance, options)


def _check_beneath(table: Structure) -> None:
    """Refuse a structure that cannot take a kernel."""
    if set(table.equations) != set("uvr"):
        raise InputError(
            "kernel: expected a structure beneath it with equations of u, v and r, got"
            f" {table.name!r} with those of {', '.join(table.equations)}; choose"
            " 'linear' or 'abkowitz', or leave the kernel out"
        )


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
        provenance = provenance_of(options, MAP, fit, problem) | deepcopy(
            self.fit.report
        )
        prior = self.fit.prior
        return certain(model, fit, problem, provenance, options, self.without, prior)


def by_simulation(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """The MMG form by its simulation error."""
    return fit_simulation(trials, options).result(options)


def fit_simulation(trials: Sequence[Trial], options: Options) -> SimulationFit:
    """The fit of `by_simulation`, before its predictions."""
    options = checked_mmg(options)
    problem = pose(trials, options)
    asked = options.prior or PriorKnowledge()
    return SimulationFit(problem, fit_mmg(problem.blank, problem.used, asked))


def checked_mmg(options: Options) -> Options:
    """The options of an identification of the MMG form.

    Raises InputError for those that it does not have.
    """
    if not (options.method_is_default or options.method == MAP):
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
