"""From trials to a ship model by the regression of each equation of motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from identification.estimators.covariance import without_trials
from identification.estimators.estimator import FitTask
from identification.judging.rudder_bias import with_bias
from identification.models.guard import (
    GuardedFit,
    guarded_fit,
    with_coefficients,
)
from identification.models.methods import Method, get_method
from identification.models.refinement import Refinement, whole_trials
from identification.pipeline.evaluation import (
    MEMORY,
    provenance_of,
    with_uncertainty,
)
from identification.pipeline.options import Options
from identification.pipeline.pose import pose
from identification.pipeline.result import IdentificationResult
from identification.samples.problem import Problem, held_out
from shipgym import ShipModel, Trial, list_structures
from shipgym.ships import Structure, get_structure
from shipgym.ships.structures import GREY_BOX

if TYPE_CHECKING:
    from identification.models.refine import Refined


@dataclass(frozen=True, eq=False)
class RegressionFit:
    """A structure fitted by regression, and what it would be without some trials."""

    problem: Problem
    task: FitTask
    method: Method
    fit: GuardedFit  # refined where the method asks for it
    refined: Refined | None

    @property
    def model(self) -> ShipModel:
        """The model of all trials."""
        return self.fit.model

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients."""
        return len(self.model.coefficients)

    @property
    def stable(self) -> bool:
        """Whether the model of all trials passed the guard."""
        return self.fit.stable

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places.

        By the normal equations less the rows of these; one that was refined is fitted
        again from where that of all ended. The influence of a trial would not do: a
        turn that all but determines a fit hardly seems to move it.
        """
        refined = self.refined
        if refined is None or refined.covariance is None:
            samples = self.task.samples
            estimators, _ = without_trials(self.fit.estimators, samples, trials)
            return with_coefficients(self.fit.model, estimators)
        task = self.task.without(trials)
        again = _refined(
            self.fit,
            task,
            self.method,
            rounds=1,
        )
        assert again is not None
        return again.fit.model

    def result(
        self, options: Options, sea: Mapping[str, Any] | None = None
    ) -> IdentificationResult:
        """The model with provenance, uncertainty and predictions of all trials.

        `sea`: what is known of current and wind, where it was taken out before.
        """
        problem = replace(self.problem, sea={**self.problem.sea, **(sea or {})})
        provenance = provenance_of(options, self._made_by, self.fit, problem)
        if self.refined is not None:
            provenance["refinement"] = self.refined.report
        if options.uncertainty.by_sampling:
            provenance["uncertainty"] = "posterior"
        return with_uncertainty(
            self.fit,
            self.refined,
            problem,
            provenance,
            options,
            self.without,
        )

    @property
    def _made_by(self) -> str:
        """Name of the method that made the numbers: the start's, where that stayed."""
        refinement = self.method.refinement
        if refinement is None or (self.refined and self.refined.covariance is not None):
            return self.method.name
        return get_method(refinement.start).name


def by_regression(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Fit the regression of each equation, guard the model, and refine it if asked.

    A structure without a constant is fitted again with one where the bias of the rudder
    differs from zero.
    """
    if options.method_is_default and differentiates_heading(trials, options):
        options = replace(
            options,
            method=_by_heading(trials),
        )
    found = fit_regression(trials, options)
    biased = with_rudder_bias(found, options)
    if biased is None:
        return found.result(options)
    own, fit = biased
    return fit.result(own, found.problem.sea)


def differentiates_heading(trials: Sequence[Trial], options: Options) -> bool:
    """Return True for a structure of yaw alone on yaw rates derived from the heading.

    Differentiation biases a regression on them, but not what is fitted to the heading.
    """
    table = options.structure
    if table == GREY_BOX:
        return False
    if isinstance(table, str) and table in list_structures():
        table = get_structure(table)
    is_response = isinstance(table, Structure) and set(table.equations) == {"r"}
    if not is_response:
        return False
    derived = []
    for trial in held_out(trials, options.hold_out):
        if trial.use == "fit":
            derived.append("r" in trial.derived and "psi" in trial)
    return all(derived)


def _by_heading(trials: Sequence[Trial]) -> Refinement:
    """Output error of whole trials, in wind, by which the heading drifts, of parts."""
    if any("wind_speed" in trial for trial in trials):
        return Refinement()
    return whole_trials()


def with_rudder_bias(
    found: RegressionFit, options: Options
) -> tuple[Options, RegressionFit] | None:
    """Options and fit of the same structure with the constant of a biased rudder.

    None where there is none to add, or where the fit with it runs away.
    """
    if options.rudder_bias == "none":
        return None
    table = with_bias(found.model, found.problem)
    if table is None:
        return None
    own = replace(options, structure=table)
    calm = replace(own, current="none", wind="none", hold_out=())
    fit = fit_regression(found.problem.trials, calm)
    return (own, fit) if fit.stable else None


def fit_regression(trials: Sequence[Trial], options: Options) -> RegressionFit:
    """The fit of `by_regression`, before its uncertainty and predictions."""
    problem = pose(trials, options)
    task = FitTask(problem.samples, problem.blank, problem.used)
    method = get_method(options.method)
    fit = guarded_fit(method, task, options.guarded)
    refined = _refined(fit, task, method)
    if refined is not None:
        fit = refined.fit
    return RegressionFit(
        problem,
        task,
        method,
        fit,
        refined,
    )


def _refined(
    fit: GuardedFit, task: FitTask, method: Method, rounds: int = 3
) -> Refined | None:
    """The fit refined as the method asks for; None where it does not."""
    if method.refinement is None:
        return None

    from identification.models.refine import refine

    memory = MEMORY * task.blank.travel_time
    return refine(fit, task, method.refinement, memory, rounds)
