"""Routes to a model other than the regression of a structure that is named."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from identification.estimators.estimator import Estimators
from identification.estimators.kernel_fit import (
    INPUT_CHANNELS,
    KernelFit,
    fit_kernel,
    inputs_of,
    stabilised,
)
from identification.estimators.kernel_residual import KernelResidual
from identification.estimators.rm_svm import RMSVM
from identification.options import AUTO, MAP, Options, name_of, whole_call
from identification.pipeline.by_regression import by_regression
from identification.pipeline.evaluation import (
    evaluated,
    provenance_of,
    with_uncertainty,
)
from identification.regression.grey_box import explained_samples
from identification.regression.preprocess import smoothed_channels
from identification.regression.problem import Problem, held_out, pose
from identification.result import IdentificationResult
from identification.simulation_error.maximum_a_posteriori import (
    checked_mmg,
    fit_mmg,
)
from identification.validation.guard import GuardedFit, reasons_unstable
from identification.validation.selection import select
from shipgym import InputError, ShipModel, Trial
from shipgym.checks import quoted
from shipgym.ships import GreyBox
from shipgym.ships.catalogue import fitted_box
from shipgym.ships.structures import GREY_BOX, MMG

#: The structure beneath a kernel where none is named.
BLACK_BOX = "linear"
#: Methods that an identification with a kernel may have; those of its reference ship.
KERNEL_METHODS = ("tls-svm", "ls-svm", "rm-svm", "output-error", MAP)


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
    marked = held_out(trials, options.hold_out)
    to_fit = [trial for trial in marked if trial.use == "fit"]
    chosen, ranking = select(identified, to_fit, options)
    best = identified(trials, chosen)
    selection = {"selection": ranking}
    provenance = best.model.provenance or {}
    return replace(
        best,
        model=replace(best.model, provenance=provenance | selection),
        metrics=best.metrics | selection,
        settings=whole_call(options, marked),
    )


def by_kernel(
    trials: Sequence[Trial], options: Options, kernel: KernelResidual
) -> IdentificationResult:
    """A reference ship, fitted or named, and a kernel on what she leaves."""
    beneath = reference_options(options)
    problem = pose(trials, beneath)
    reference, box = _reference_box(trials, beneath, problem)
    found = _fitted_kernel(kernel, reference, box, problem, options)
    problem = replace(
        problem,
        blank=found.model,
        table=found.model.table,
        samples=found.samples,
    )
    fit = _unguarded(found.model, found.estimators, problem.used)
    named = replace(options, structure=beneath.structure)
    provenance = provenance_of(named, name_of(options.method), fit, problem)
    provenance["kernel"] = found.report
    return with_uncertainty(fit, None, problem, provenance, options)


def _reference_box(
    trials: Sequence[Trial], options: Options, problem: Problem
) -> tuple[ShipModel, GreyBox]:
    """Reference ship beneath a kernel, and her table; fitted where none is named."""
    if isinstance(problem.table, GreyBox):
        return problem.blank, problem.table

    model = identified(trials, options).model
    if options.structure == BLACK_BOX:
        model = stabilised(model)
    return model, fitted_box(model)


def _fitted_kernel(
    kernel: KernelResidual,
    reference: ShipModel,
    box: GreyBox,
    problem: Problem,
    options: Options,
) -> KernelFit:
    """The kernel on a reference ship, from inputs smoothed as the options ask for."""
    used = problem.used
    smoothing = options.preprocessing.smoothing
    channels = [smoothed_channels(trial, INPUT_CHANNELS, smoothing) for trial in used]
    return fit_kernel(
        kernel,
        reference,
        used,
        box,
        inputs_of(channels, reference.particulars),
        lambda table: problem.rows_of(table, reference),
    )


def reference_options(options: Options) -> Options:
    """The options by which the reference ship beneath a kernel is identified.

    A grey box names hers.
    """
    method = options.method
    if name_of(method) not in KERNEL_METHODS:
        raise InputError(
            f"method: expected one of {quoted(KERNEL_METHODS)} with a kernel, got"
            f" {name_of(method)!r}; choose 'rm-svm' or 'ls-svm', or leave the kernel"
            " out"
        )
    if isinstance(method, RMSVM):
        has_band = method.regression != "ls-svm" or method.epsilon is not None
        if has_band:
            raise InputError(
                "method: expected RM-SVM by regression 'ls-svm' without epsilon with a"
                " kernel, which is fitted by LS-SVM only, got epsilon-SVR"
            )

    structure = options.structure
    if structure in (Options.structure, AUTO):  # none was named
        structure = BLACK_BOX if options.reference_model is None else GREY_BOX
    if structure != GREY_BOX and name_of(method) == RMSVM.name:
        method = "ls-svm"
    return replace(options, structure=structure, method=method, kernel=None)


def by_simulation(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """The MMG form by its simulation error.

    The regression of the result is on the model's own accelerations.
    """
    options = checked_mmg(options)
    problem = pose(trials, options)
    model, report = fit_mmg(problem, options)
    samples, estimators = explained_samples(problem.used, model, **problem.sampling)
    problem = replace(problem, samples=samples, blank=model)
    fit = _unguarded(model, estimators, problem.used)
    provenance = provenance_of(options, MAP, fit, problem)
    provenance |= report
    return evaluated(model, fit, problem, provenance, options)


def _unguarded(
    model: ShipModel, estimators: Estimators, used: Sequence[Trial]
) -> GuardedFit:
    """A fit that was not guarded, and whether it runs away."""
    reasons = reasons_unstable(model, used)
    report: dict[str, Any] = {"decision": "stable as fitted"}
    if reasons:
        report = {"decision": "runs away", "rejected": reasons}
    return GuardedFit(model, estimators, not reasons, report)
