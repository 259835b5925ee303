"""LS-SVM that chooses its own weight of the errors."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from identification.estimators.decomposition import decompose
from identification.estimators.estimator import Estimator, Estimators, FitTask
from identification.estimators.linear import (
    LinearRegressor,
    check_weight,
    settings,
    validated,
)
from identification.estimators.lssvm import LSSVM
from identification.search import get_optimiser
from identification.search.objectives import (
    ErrorOfC,
    held_out_error,
    time_blocks,
    training_error,
)
from identification.search.search import Optimiser, SearchResult
from identification.validation.prediction import predict
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_whole

OBJECTIVES = ("k-fold", "training", "free-running")
COMPARED = ("u", "v", "r")
RAN_AWAY = 1e3  # error, relative to the motion, of a ship that ran away


@settings()
class TunedLSSVM(LinearRegressor):
    """LS-SVM with a linear kernel and C found by a search over its logarithm (Zhu 2018, section 5.3).

    Parameters
    ----------
    optimiser : {"abc", "pso", "grid", "de"}, mapping or Optimiser
        Artificial bee colony, particle swarm, grid or differential evolution; with its
        settings as `{"name": "abc", "rounds": 60}`.
    objective : {"k-fold", "training", "free-running"}
        Error on held-out blocks of time; error on the fitted samples, as in the thesis,
        whose optimum is the upper bound; error of simulated trials (through `identify`
        only).
    bounds : tuple of float
        Least and largest C.
    folds : int or "trials"
        Blocks of time of the k-fold objective, or a block for each trial.
    seed : int
        Of the search.
    scale, fit_intercept, robust
        As of `LSSVM`. With `robust` the blocks are weighted as in the fit with the
        largest C.

    Attributes
    ----------
    coef_, intercept_, singular_values_, covariance_, inverse_moment_, noise_variance_,
    weights_, n_features_in_
        As of `LSSVM`.
    C_ : float
        The weight of the errors that was found.
    search_ : SearchResult
        How; its variable is log10 C.
    chosen_ : dict
        For the provenance.
    """

    optimiser: str | Mapping[str, Any] | Optimiser = "abc"
    objective: str = "k-fold"
    bounds: tuple[float, float] = (1e-2, 1e12)
    folds: int | str = 5
    seed: int = 0
    scale: bool | ArrayLike = True
    fit_intercept: bool = True
    robust: bool = False

    def fit(self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Search for C and fit to samples of shape (n_samples, n_features), in the order of time.

        Targets have the shape (n_samples,), as have `groups`: the trial of each sample,
        for folds="trials".
        """
        check_choice(self.objective, OBJECTIVES, "objective")
        check_whole(self.seed, "seed", at_least=0)
        if self.objective == "free-running":
            raise InputError(
                "objective: 'free-running' found, expected 'k-fold' or 'training':"
                " samples alone cannot be simulated; use identify(...,"
                " objective='free-running')"
            )
        optimiser, bounds = get_optimiser(self.optimiser), self.log_bounds()
        X, y = validated(self, X, y)
        objective = self._objective(X, y, groups, self._estimator(10.0 ** bounds[1]))
        return self.fit_with(X, y, optimiser.minimise(objective, [bounds], self.seed))

    def log_bounds(self) -> tuple[float, float]:
        """Bounds of log10 C, checked."""
        try:
            low, high = self.bounds
        except (TypeError, ValueError):
            raise InputError(
                f"bounds: {self.bounds!r} found, expected the least and the largest C,"
                " such as (0.01, 1e12)"
            ) from None
        low, high = check_weight(low, "bounds"), check_weight(high, "bounds")
        if not low < high < np.inf:
            raise InputError(
                f"bounds: {(low, high)} found, expected a least C and a finite one that"
                " is larger"
            )
        return float(np.log10(low)), float(np.log10(high))

    def fit_with(self, X: ArrayLike, y: ArrayLike, search: SearchResult) -> Self:
        """Take C as a search found it, and fit."""
        X, y = validated(self, X, y)
        self.C_, self.search_ = 10.0 ** float(search.x[0]), search
        fitted = vars(self._estimator(self.C_).fit(X, y))
        self.__dict__.update(
            {name: value for name, value in fitted.items() if name.endswith("_")}
        )
        found = {"value": search.value, "evaluations": search.evaluations}
        self.chosen_ = {"C": self.C_, "objective": self.objective, **found}
        return self

    def _estimator(self, C: float) -> LSSVM:
        return LSSVM(
            C=C, scale=self.scale, fit_intercept=self.fit_intercept, robust=self.robust
        )

    def _objective(
        self, X: Floats, y: Floats, groups: ArrayLike | None, loosest: LSSVM
    ) -> ErrorOfC:
        weights = loosest.fit(X, y).weights_ if self.robust else None
        if self.objective == "training":
            return training_error(X, y, self.scale, self.fit_intercept, weights)
        folds = min(self.folds, len(y)) if isinstance(self.folds, int) else self.folds
        blocks = time_blocks(len(y), folds, groups)
        return held_out_error(X, y, self.scale, self.fit_intercept, blocks, weights)


def fit_tuned(make: Callable[[], Estimator], task: FitTask) -> Estimators:
    """Fit estimators that choose their own C, which may use the trials as blocks or simulate them."""
    template, samples = make(), task.samples
    assert isinstance(template, TunedLSSVM)
    if template.objective == "free-running":
        return _fit_free_running(template, task)
    return {
        q: clone(template).fit(X, samples.targets[q], samples.trial)
        for q, X in samples.features.items()
    }


def free_running_error(model: ShipModel, trials: Sequence[Trial]) -> float:
    """Mean squared error of open-loop predictions, each channel relative to its variance in the trial.

    0 for a perfect model, 1 for one that predicts the mean; 1e3 for each trial that ran
    away.
    """
    errors = []
    for trial in trials:
        run, motion = (
            predict(model, trial),
            [c for c in COMPARED if np.ptp(trial[c]) > 0.0],
        )
        ratios = (
            [np.mean((run[c] - trial[c]) ** 2) / np.var(trial[c]) for c in motion]
            if run
            else [RAN_AWAY]
        )
        errors.append(np.mean(ratios))
    return float(np.mean(np.minimum(errors, RAN_AWAY)))


def _fit_free_running(settings: TunedLSSVM, task: FitTask) -> Estimators:
    """Estimators of all equations, their C chosen together by the error of simulated trials.

    The variables of their common search are log10 C in the order of the equations.
    """
    samples = task.samples
    whitened = {
        q: decompose(X, samples.targets[q], settings.scale, settings.fit_intercept)
        for q, X in samples.features.items()
    }

    def error(log_c: Floats) -> float:
        accelerations = {
            q: fit.coefficients(fit.filters(10.0**exponent, len(fit.singular_values)))
            for (q, fit), exponent in zip(whitened.items(), log_c, strict=True)
        }
        return free_running_error(
            task.blank.with_accelerations(accelerations), task.trials
        )

    optimiser, bounds = (
        get_optimiser(settings.optimiser),
        [settings.log_bounds()] * len(whitened),
    )
    search = optimiser.minimise(
        lambda xs: np.array([error(x) for x in xs]), bounds, settings.seed
    )
    return {
        q: clone(settings).fit_with(X, samples.targets[q], search.of(k))
        for k, (q, X) in enumerate(samples.features.items())
    }
