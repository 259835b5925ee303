"""From trials to a ship model by the regression of each equation of motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.estimators.covariance import without_trials
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
from identification.samples.problem import Problem
from shipgym import ShipModel, Trial, list_structures
from shipgym.ships import Structure, get_structure
from shipgym.ships.structures import GREY_BOX


@dataclass(frozen=True, eq=False)
class RegressionFit:
    """A structure fitted by regression, and what it would be without some trials."""

    problem: Problem
    method: Method
    fit: GuardedFit  # refined where the method asks for it

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
        if self.fit.covariance is None:
            samples = self.problem.samples
            estimators, _ = without_trials(self.fit.estimators, samples, trials)
            return with_coefficients(self.fit.model, estimators)
        others = self.problem.without(trials)
        return _refined(
            self.fit,
            others,
            self.method,
            rounds=1,
        ).model

    def result(self, options: Options) -> IdentificationResult:
        """The model with provenance, uncertainty and predictions of all trials."""
        provenance = provenance_of(
            options,
            self._made_by,
            self.fit,
            self.problem,
        )
        if self.fit.refinement is not None:
            provenance["refinement"] = self.fit.refinement
        return with_uncertainty(
            self.fit, self.problem, provenance, options, self.without
        )

    @property
    def _made_by(self) -> str:
        """Name of the method that made the numbers: the start's, where that stayed."""
        refinement = self.method.refinement
        if refinement is None or self.fit.covariance is not None:
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
    own, fit = with_rudder_bias(found, options)
    return fit.result(own)


def differentiates_heading(trials: Sequence[Trial], options: Options) -> bool:
    """Return True for a structure of yaw alone on yaw rates derived from the heading.

    Differentiation biases a regression on them, but not what is fitted to the heading.
    """
    table = options.structure
    if table in list_structures() and table != GREY_BOX:
        table = get_structure(str(table))
    if not isinstance(table, Structure) or set(table.equations) != {"r"}:
        return False
    fitted = [trial for trial in trials if trial.use == "fit"]
    return all("r" in trial.derived and "psi" in trial for trial in fitted)


def _by_heading(trials: Sequence[Trial]) -> Refinement:
    """Output error of whole trials, in wind, by which the heading drifts, of parts."""
    if any("wind_speed" in trial for trial in trials):
        return Refinement()
    return whole_trials()


def with_rudder_bias(
    found: RegressionFit, options: Options
) -> tuple[Options, RegressionFit]:
    """Options and fit of the same structure with the constant of a biased rudder.

    As they were where there is none to add, or where the fit with it runs away.
    """
    table = None
    if options.rudder_bias != "none":
        table = with_bias(found.model, found.problem)
    if table is None:
        return options, found
    own = replace(
        options,
        structure=table,
    )
    fit = fit_regression(found.problem.trials, own)
    return (own, fit) if fit.stable else (options, found)


def fit_regression(trials: Sequence[Trial], options: Options) -> RegressionFit:
    """The fit of `by_regression`, before its uncertainty and predictions."""
    problem = pose(trials, options)
    method = get_method(options.method)
    fit = guarded_fit(method, problem, options.guarded)
    return RegressionFit(problem, method, _refined(fit, problem, method))


def _refined(
    fit: GuardedFit, problem: Problem, method: Method, rounds: int = 3
) -> GuardedFit:
    """The fit, refined where the method asks for it."""
    if method.refinement is None:
        return fit

    from identification.models.refine import refine

    memory = MEMORY * problem.blank.travel_time
    return refine(fit, problem, method.refinement, memory, rounds)
