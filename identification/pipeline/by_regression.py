"""From trials to a ship model by the regression of each equation of motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.estimators.estimator import FitTask
from identification.estimators.methods import Method, get_method
from identification.options import Options, name_of
from identification.pipeline.evaluation import (
    MEMORY,
    provenance_of,
    with_uncertainty,
)
from identification.regression.problem import Problem, pose
from identification.result import IdentificationResult
from identification.uncertainty.model_error import without_trials
from identification.validation.guard import (
    GuardedFit,
    guarded_fit,
    with_coefficients,
)
from shipgym import ShipModel, Trial

if TYPE_CHECKING:
    from identification.simulation_error.refine import Refined


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
            estimators, _ = without_trials(
                self.fit.estimators,
                self.problem.samples,
                trials,
            )
            return with_coefficients(self.fit.model, estimators)
        others = np.setdiff1d(np.arange(len(self.problem.used)), trials)
        of_others = np.isin(self.problem.samples.trial, others)
        task = FitTask(
            samples=self.problem.samples.select(of_others),
            blank=self.task.blank,
            trials=[self.task.trials[place] for place in others],
        )
        again = _refined(self.fit, task, self.method, rounds=1)
        assert again is not None
        return again.fit.model

    def result(
        self, options: Options, sea: Mapping[str, Any] | None = None
    ) -> IdentificationResult:
        """The model with provenance, uncertainty and predictions of all trials.

        `sea`: what is known of current and wind, where it was taken out before.
        """
        problem = replace(self.problem, sea={**self.problem.sea, **(sea or {})})
        provenance = provenance_of(options, self.method.name, self.fit, problem)
        provenance |= _prior_report(options, self.fit)
        if self.refined is not None:
            provenance["refinement"] = self.refined.report
        if options.uncertainty.covariance != "analytic":
            provenance["uncertainty"] = options.uncertainty.covariance
        return with_uncertainty(
            self.fit,
            self.refined,
            problem,
            provenance,
            options,
            self.without,
        )


def by_regression(trials: Sequence[Trial], options: Options) -> IdentificationResult:
    """Fit the regression of each equation, guard the model, and refine it if asked."""
    return fit_regression(trials, options).result(options)


def fit_regression(trials: Sequence[Trial], options: Options) -> RegressionFit:
    """The fit of `by_regression`, before its uncertainty and predictions."""
    problem = pose(trials, options)
    task = FitTask(problem.samples, problem.blank, problem.used)
    method = _asked_method(options, task.blank)
    fit = guarded_fit(method, task, options.guarded)
    refined = _refined(fit, task, method)
    if refined is not None:
        fit = refined.fit
    return RegressionFit(problem, task, method, fit, refined)


def _asked_method(options: Options, blank: ShipModel) -> Method:
    """The method of the options, pulled toward their prior if there is one."""
    method = get_method(options.method)
    if options.prior is None:
        return method

    from identification.simulation_error.pulled import with_prior

    return with_prior(method, options.prior, blank)


def _refined(
    fit: GuardedFit, task: FitTask, method: Method, rounds: int = 3
) -> Refined | None:
    """The fit refined as the method asks for; None where it does not."""
    if method.refinement is None:
        return None

    from identification.simulation_error.refine import refine

    memory = MEMORY * task.blank.travel_time
    return refine(fit, task, method.refinement, memory, rounds)


def _prior_report(options: Options, fit: GuardedFit) -> dict[str, Any]:
    """Name and strength of a prior; every estimator has the same report."""
    if options.prior is None:
        return {}
    report: dict[str, Any] = {"prior": name_of(options.prior.source)}
    for estimator in fit.estimators.values():
        report |= getattr(estimator, "prior_", {})
        break
    return report
