"""LS-SVM that chooses its own weight of the errors."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from identification.estimators.decomposition import check_scale
from identification.estimators.linear import LinearRegressor, check_weight, validated
from identification.estimators.lssvm import LSSVM
from identification.estimators.objectives import ErrorOfC, time_blocks
from identification.estimators.optimisers import Optimiser, get_optimiser
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import check_choice, check_whole


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
    folds : int, at least 2
        Number of blocks of time of the k-fold objective.
    seed : int, at least 0
        Of the search; the same seed gives the same search.
    scale : bool or array-like of shape (n_features,)
        As of `LSSVM`.
    fit_intercept : bool
        As of `LSSVM`.

    Attributes
    ----------
    coef_, intercept_, singular_values_, inverse_moment_, n_features_in_
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
    )

    optimiser: str | Mapping[str, Any] | Optimiser = "abc"
    objective: str = "k-fold"
    bounds: tuple[float, float] = (1e-2, 1e12)
    folds: int = 5
    seed: int = 0
    scale: bool | ArrayLike = True
    fit_intercept: bool = True

    @property
    def method_name(self) -> str:
        """Name of the method by its search."""
        search = get_optimiser(self.optimiser).name
        return f"{'cv' if search == 'grid' else search}-lssvr"

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        get_optimiser(self.optimiser)
        objectives = ("k-fold", "training")
        check_choice(self.objective, objectives, "objective")
        self._log_bounds()
        check_whole(self.folds, "folds", at_least=2)
        check_whole(self.seed, "seed", at_least=0)
        check_scale(self.scale)

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Search for C and fit.

        Samples of shape (n_samples, n_features) are in the order of time. Targets have
        the shape (n_samples,).
        """
        self.check()
        features, targets = validated(self, X, y)
        search = get_optimiser(self.optimiser).minimise(
            self._objective(features, targets),
            bounds=self._log_bounds(),
            seed=self.seed,
        )
        self.C_ = 10.0**search.x
        self.chosen_ = {
            "C": self.C_,
            "objective": self.objective,
            "value": search.value,
            "evaluations": search.evaluations,
        }
        self._take(LSSVM(self.C_, "linear", self.scale, self.fit_intercept), X, y)
        return self

    def _take(self, own: LSSVM, X: ArrayLike, y: ArrayLike) -> None:
        """Take what an estimator learns."""
        for name, value in vars(own.fit(X, y)).items():
            if name.endswith("_"):
                setattr(self, name, value)

    def error_weight(self) -> float:
        """Weight of the squared errors in the solution."""
        return float(self.C_)

    def _log_bounds(self) -> tuple[float, float]:
        """Bounds of log10 C, checked."""
        is_pair = isinstance(self.bounds, list | tuple) and len(self.bounds) == 2
        pair = self.bounds if is_pair else (np.inf, np.inf)
        low, high = (check_weight(one, "bounds") for one in pair)
        if not low < high < np.inf:
            raise InputError(
                "bounds: expected a least C and a finite one that is larger, such as"
                f" (0.01, 1e12), got {self.bounds!r}"
            )
        return float(np.log10(low)), float(np.log10(high))

    def _objective(self, X: Floats, y: Floats) -> ErrorOfC:
        everything = np.ones(len(y), dtype=bool)
        parts = [(everything, everything)]
        if self.objective == "k-fold":
            parts = time_blocks(len(y), min(self.folds, len(y)))
        return ErrorOfC(X, y, self.scale, self.fit_intercept, parts)
