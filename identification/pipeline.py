"""From trials to a ship model: `identify`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from identification.estimators.estimator import Estimators, FitTask
from identification.estimators.kernel_residual import (
    INPUT_CHANNELS,
    KernelResidual,
    fit_kernel,
    inputs_of,
    stabilised,
)
from identification.estimators.methods import get_method
from identification.estimators.rm_svm import RMSVM
from identification.estimators.threads import single_threaded
from identification.evaluation import (
    MEMORY,
    evaluated,
    provenance_of,
    scaled_covariance,
)
from identification.options import AUTO, Given, Options, name_of, stage, whole_call
from identification.regression.grey_box import explained_samples
from identification.regression.preprocess import Preprocessing, smoothed_channels
from identification.regression.problem import held_out, pose
from identification.regression.samples import Sampling
from identification.result import IdentificationResult
from identification.simulation_error.maximum_a_posteriori import (
    MAP,
    checked_mmg,
    fit_mmg,
)
from identification.simulation_error.prior import with_prior
from identification.simulation_error.prior_knowledge import PriorKnowledge
from identification.simulation_error.refine import refine
from identification.uncertainty.uncertainty import Uncertainty
from identification.validation.guard import GuardedFit, guarded_fit, reasons_unstable
from identification.validation.selection import select
from shipgym import InputError, ShipModel, SteeringGear, Trial
from shipgym.checks import quoted
from shipgym.ships import GreyBox, Structure
from shipgym.ships.catalogue import fitted_box
from shipgym.ships.grey_boxes import GREY_BOX
from shipgym.ships.mmg import MMG

#: The structure beneath a kernel where none is named.
BLACK_BOX = "linear"
#: Methods that an identification with a kernel may have; those of its reference ship.
KERNEL_METHODS = ("tls-svm", "ls-svm", "rm-svm", "output-error", MAP)


@single_threaded()
def identify(
    trials: Sequence[Trial],
    structure: str | Structure = "abkowitz",
    method: Any = "tls-svm",
    samples: str | Sampling = "spline",
    particulars: Given = None,
    steering: SteeringGear | None = None,
    *,
    preprocessing: str | Preprocessing = "spline",
    reference_model: str | ShipModel | None = None,
    kernel: str | KernelResidual | None = None,
    prior: str | ShipModel | PriorKnowledge | None = None,
    uncertainty: str | Uncertainty = "analytic",
    current: str | Mapping[str, float] = "auto",
    wind: str | Mapping[str, Any] = "auto",
    hold_out: str | Sequence[str] = (),
    guarded: bool = True,
    name: str | None = None,
    service_shaft_speed: float | None = None,
) -> IdentificationResult:
    """Identify a manoeuvring model from recorded trials.

    `Options` documents all arguments but the trials. A stage is an object, such as
    `method=TruncatedLSSVM(rank=12)`, or the name of a default one, such as "tls-svm".

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" are fitted; they need the channels u, v, r and delta, and
        n for structures that know the shaft speed. Those marked "validate" are
        predicted, and influence no coefficient.

    Raises
    ------
    InputError
        For trials that excite nothing, lack channels or samples, and for particulars
        that do not suffice.
    """
    options = Options(
        structure=structure,
        method=method,
        samples=stage(Sampling, samples),
        particulars=particulars,
        steering=steering,
        preprocessing=stage(Preprocessing, preprocessing),
        reference_model=reference_model,
        kernel=None if kernel is None else stage(KernelResidual, kernel),
        prior=None if prior is None else stage(PriorKnowledge, prior),
        uncertainty=stage(Uncertainty, uncertainty),
        current=current,
        wind=wind,
        hold_out=hold_out,
        guarded=guarded,
        name=name,
        service_shaft_speed=service_shaft_speed,
    )
    return identified(trials, options)


def identified(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Identify by regression, unless the options ask for another way."""
    if options.kernel is not None:
        return _by_kernel(trials, options, options.kernel)
    if options.structure == AUTO:
        return _by_selection(trials, options)
    if options.structure == MMG:
        return _by_simulation(trials, checked_mmg(options))
    return _by_regression(trials, options)


def _by_regression(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Fit the regression of each equation, guard the model, and refine it where asked."""
    method = get_method(options.method)
    problem = pose(trials, options)
    task = FitTask(problem.samples, problem.blank, problem.used)
    if options.prior is not None:
        method = with_prior(method, options.prior, task.blank)
    fit = guarded_fit(method, task, options.guarded)
    refined = None
    if method.refinement is not None:
        memory = MEMORY * task.blank.travel_time
        refined = refine(fit, task, method.refinement, memory)
        fit = refined.fit

    provenance = provenance_of(options, method.name, fit, problem)
    if options.prior is not None:
        provenance |= {"prior": name_of(options.prior.source), **_prior_report(fit)}
    if refined is not None:
        provenance["refinement"] = refined.report
    if options.uncertainty.covariance != "analytic":
        provenance["uncertainty"] = options.uncertainty.covariance
    covariance, error = scaled_covariance(options.uncertainty, fit, refined, problem)
    if error:
        provenance["model_error"] = error
    model = replace(fit.model, covariance=covariance)
    call = whole_call(options, problem.trials)
    return evaluated(model, fit, problem, provenance, call)


def _prior_report(fit: GuardedFit) -> dict[str, Any]:
    """How strong a prior was; every estimator has the same report."""
    for estimator in fit.estimators.values():
        return dict(getattr(estimator, "prior_", {}))
    return {}


def _by_selection(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """By the structure and method that predict the trials to fit best, each held out, with the ranking."""
    marked = held_out(trials, options.hold_out)
    to_fit = [trial for trial in marked if trial.use == "fit"]
    chosen, ranking = select(identified, to_fit, options)
    best = identified(trials, chosen)
    provenance = {**(best.model.provenance or {}), "selection": ranking}
    return replace(
        best,
        model=replace(best.model, provenance=provenance),
        metrics=best.metrics | {"selection": ranking},
        settings=whole_call(options, marked),
    )


def _by_kernel(
    trials: Sequence[Trial], options: Options, kernel: KernelResidual
) -> IdentificationResult:
    """A reference ship, fitted to the trials or named, and a kernel on what she leaves."""
    beneath = reference_options(options)
    problem = pose(trials, beneath)
    blank, box = problem.blank, problem.table
    if not isinstance(box, GreyBox):
        blank = identified(trials, beneath).model
        if beneath.structure == BLACK_BOX:
            blank = stabilised(blank)
        box = fitted_box(blank)

    channels = [
        smoothed_channels(trial, INPUT_CHANNELS, options.preprocessing.smoothing)
        for trial in problem.used
    ]
    found = fit_kernel(
        kernel,
        blank,
        problem.used,
        box,
        inputs_of(channels, blank.particulars),
        lambda table: problem.rows_of(table, blank),
    )
    problem = replace(
        problem, blank=found.model, table=found.model.table, samples=found.samples
    )
    fit = _unguarded(found.model, found.estimators, problem.used)
    named = replace(options, structure=beneath.structure)
    provenance = provenance_of(named, name_of(options.method), fit, problem)
    provenance["kernel"] = found.report
    covariance, error = scaled_covariance(options.uncertainty, fit, None, problem)
    if error:
        provenance["model_error"] = error
    model = replace(found.model, covariance=covariance)
    call = whole_call(options, problem.trials)
    return evaluated(model, fit, problem, provenance, call)


def reference_options(options: Options) -> Options:
    """The options by which the reference ship beneath a kernel is identified; a grey box names hers."""
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


def _by_simulation(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """The MMG form by its simulation error; its regression is that on the model's own accelerations."""
    problem = pose(trials, options)
    model, report = fit_mmg(problem, options)
    samples, estimators = explained_samples(problem.used, model, **problem.sampling)
    problem = replace(problem, samples=samples, blank=model)
    fit = _unguarded(model, estimators, problem.used)
    provenance = provenance_of(options, MAP, fit, problem) | report
    call = whole_call(options, problem.trials)
    return evaluated(model, fit, problem, provenance, call)


def _unguarded(
    model: ShipModel, estimators: Estimators, used: Sequence[Trial]
) -> GuardedFit:
    """A fit that was not guarded, and whether it runs away."""
    reasons = reasons_unstable(model, used)
    report: dict[str, Any] = {"decision": "stable as fitted"}
    if reasons:
        report = {"decision": "runs away", "rejected": reasons}
    return GuardedFit(model, estimators, not reasons, report)
