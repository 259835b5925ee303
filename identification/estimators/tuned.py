"""LS-SVM that chooses its own weight of the errors."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from identification.estimators.decomposition import check_scale
from identification.estimators.estimator import Estimators, FitTask
from identification.estimators.linear import LinearRegressor, check_weight, validated
from identification.estimators.lssvm import LSSVM
from identification.estimators.objectives import (
    ErrorOfC,
    check_folds,
    held_out_error,
    time_blocks,
    training_error,
)
from identification.estimators.optimisers import OPTIMISERS, get_optimiser
from identification.estimators.search import Optimiser
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_flag, check_whole


@dataclass(eq=False, repr=False)
class TunedLSSVM(LinearRegressor):
    """LS-SVM with a linear kernel and C found by a search over its logarithm.

    Source: Zhu 2018, sections 5.2.1, 5.2.2 (bee colony) and 7.4.4 (the others).

    Parameters
    ----------
    optimiser : {"abc", "pso", "grid"}, table or Optimiser
        Artificial bee colony, particle swarm or grid; with its settings as
        `{"name": "abc", "rounds": 60}`.
    objective : {"k-fold", "training"}
        Error on held-out blocks of time; error on the fitted samples, as in the thesis,
        whose optimum is the upper bound.
    bounds : tuple of float
        Least and largest C.
    folds : int or "trials"
        Number of blocks of time of the k-fold objective, or a block for each trial.
    seed : int, at least 0
        Of the search; the same seed gives the same search.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    fit_intercept : bool
        As of `LSSVM`.
    robust : bool
        As of `LSSVM`; the blocks are then weighted as in the fit with the largest C.

    Attributes
    ----------
    coef_, intercept_, singular_values_, covariance_, inverse_moment_, noise_variance_,
    weights_, n_features_in_
        As of `LSSVM`.
    C_ : float
        The weight of the errors that was found.
    chosen_ : dict
        For the provenance.
    """

    options: ClassVar[tuple[str, ...]] = (
        "optimiser",
        "objective",
        "bounds",
        "folds",
        "seed",
        "scale",
        "robust",
    )

    optimiser: str | Mapping[str, Any] | Optimiser = "abc"
    objective: str = "k-fold"
    bounds: tuple[float, float] = (1e-2, 1e12)
    folds: int | str = 5
    seed: int = 0
    scale: bool | ArrayLike = True
    fit_intercept: bool = True
    robust: bool = False

    @property
    def method_name(self) -> str:
        """Name of the method by its search."""
        kind = type(get_optimiser(self.optimiser))
        # Names of the methods by their search.
        method_names = {
            "abc": "abc-lssvr",
            "pso": "pso-lssvr",
            "grid": "cv-lssvr",
        }
        for name, known in OPTIMISERS.items():
            if kind is known:
                return method_names[name]
        return super().method_name

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        get_optimiser(self.optimiser)
        objectives = ("k-fold", "training")
        check_choice(self.objective, objectives, "objective")
        self._log_bounds()
        check_folds(self.folds)
        check_whole(self.seed, "seed", at_least=0)
        check_scale(self.scale)
        check_flag(self.robust, "robust")

    def fit(self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Search for C and fit.

        Samples of shape (n_samples, n_features) are in the order of time. Targets have
        the shape (n_samples,), as have `groups`: the trial of each sample, for
        folds="trials".
        """
        self.check()
        features, targets = validated(self, X, y)
        search = get_optimiser(self.optimiser).minimise(
            self._objective(features, targets, groups),
            bounds=[self._log_bounds()],
            seed=self.seed,
        )
        self.C_ = 10.0 ** float(search.x[0])
        self.chosen_ = {
            "C": self.C_,
            "objective": self.objective,
            "value": search.value,
            "evaluations": search.evaluations,
        }
        fitted = self._estimator(self.C_).fit(features, targets)
        for name, value in vars(fitted).items():
            if name.endswith("_"):
                setattr(self, name, value)
        return self

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return float(self.C_)

    def _log_bounds(self) -> tuple[float, float]:
        """Bounds of log10 C, checked."""
        try:
            low, high = self.bounds
        except (TypeError, ValueError):
            raise InputError(
                "bounds: expected the least and the largest C, such as (0.01, 1e12),"
                f" got {self.bounds!r}"
            ) from None
        low = check_weight(low, "bounds")
        high = check_weight(high, "bounds")
        if not low < high < np.inf:
            raise InputError(
                "bounds: expected a least C and a finite one that is larger, got"
                f" {(low, high)}"
            )
        return float(np.log10(low)), float(np.log10(high))

    def _estimator(self, C: float) -> LSSVM:
        return LSSVM(
            C=C,
            scale=self.scale,
            fit_intercept=self.fit_intercept,
            robust=self.robust,
        )

    def _objective(self, X: Floats, y: Floats, groups: ArrayLike | None) -> ErrorOfC:
        weights = None
        if self.robust:
            _, largest = self._log_bounds()
            weights = self._estimator(10.0**largest).fit(X, y).weights_
        if self.objective == "training":
            return training_error(
                X,
                y=y,
                scale=self.scale,
                fit_intercept=self.fit_intercept,
                weights=weights,
            )

        folds = self.folds
        if isinstance(folds, int):
            folds = min(folds, len(y))
        blocks = time_blocks(len(y), folds, groups)
        return held_out_error(
            X,
            y=y,
            scale=self.scale,
            fit_intercept=self.fit_intercept,
            blocks=blocks,
            weights=weights,
        )

    def fit_equations(self, task: FitTask) -> Estimators:
        """Copies fitted to all equations; trials may be blocks."""
        samples = task.samples
        found: Estimators = {}
        for q, X, y in samples.by_equation():
            own = clone(self)
            found[q] = own.fit(X, y, groups=samples.trial)
        return found
