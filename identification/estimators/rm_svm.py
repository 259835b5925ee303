"""RM-SVM: a linear support vector regression of what a reference ship leaves.

Source: Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via
adaptive RM-SVM with minor rudder. The Lagrangian printed there (9) is that of LS-SVM,
but insensitive band and solver are those of the epsilon-SVR that is fitted here
(Drucker et al. 1997, Support vector regression estimators).
"""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.svm import LinearSVR

from identification.arrays import column_rms, root_mean_square
from identification.estimators.decomposition import scales_of
from identification.estimators.linear import Estimators, LinearRegressor, validated
from identification.samples.prediction import predict
from identification.samples.problem import FOLDS, TRIALS, Problem, held_out_rows
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_number
from shipgym.ships import GreyBox


def pattern_search(objective: Callable[[Floats], float], start: Floats) -> Floats:
    """Minimise a function of a point of the unit cube without derivatives.

    Each round polls the 2n neighbours on the mesh and moves to the best of them if it
    is better; else the mesh, 1/4 at first, is halved until it is finer than 1/64. No
    point is evaluated twice, and no round begins after 200 evaluations.
    """
    mesh, finest = 0.25, 1.0 / 64.0

    @cache
    def value_at(*point: float) -> float:
        return objective(np.array(point))

    best = np.clip(start, 0.0, 1.0)
    value_at(*best.tolist())
    axes = np.eye(len(best))
    directions = np.vstack([axes, -axes])
    while mesh >= finest and value_at.cache_info().currsize < 200:
        neighbours = np.clip(best + mesh * directions, 0.0, 1.0).tolist()
        nearest = min(neighbours, key=lambda point: value_at(*point))
        if value_at(*nearest) < value_at(*best.tolist()):
            best = np.array(nearest)
        else:
            mesh *= 0.5
    return best


#: Weight of the errors at which nothing is added to the reference ship.
NO_CORRECTION = 0.0
WEAKEST = 0.01  # weight of the errors of the weakest correction
WEIGHTS = (NO_CORRECTION, *np.geomspace(WEAKEST, 100.0, 9).tolist())
FIRST_BAND = 0.1

Choice = TypeVar("Choice")


@dataclass(eq=False, repr=False)
class RMSVM(LinearRegressor):
    """The linear correction of one equation, by epsilon-SVR.

    Minimises w.w / 2 + C mean(max(|e| - epsilon, 0)) with the w of the standardised
    features and e in standard deviations of the target.

    Parameters
    ----------
    C : float or None, at least 0
        Weight of the errors, by the mean over samples; 0 adds nothing to the reference
        ship. None: 1; `identify` chooses it by trials held out.
    epsilon : float or None, at least 0
        The insensitive band in [0, 1], standard deviations of the target. None: 0.1;
        `identify` finds it by a pattern search.
    folds : {"trials", "largest-rudder"}
        What `identify` holds out: each trial in turn, or the trials of the largest
        rudder together, for models that are to turn harder than any trial.

    Attributes
    ----------
    coef_ : array of shape (n_features,)
        Of the features as given.
    inverse_moment_ : array of shape (n_features, n_features)
        Of the ridge regression of the same strength, at C = 0 of the weakest: an SVR
        has none of its own.
    n_features_in_ : int
        Number of features.
    """

    name = "rm-svm"
    options = ("C", "epsilon", "folds")

    C: float | None = None
    epsilon: float | None = None
    folds: str = TRIALS

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        check_choice(self.folds, FOLDS, "folds")
        if self.C is not None:
            check_number(self.C, "C", at_least=0.0)
        if self.epsilon is not None:
            hint = "in standard deviations of the target"
            check_number(self.epsilon, "epsilon", at_least=0.0, hint=hint)

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        self.check()
        features, targets = validated(self, X, y)
        scale = scales_of(column_rms(features), True)
        deviation = root_mean_square(targets) or 1.0
        weight = 1.0 if self.C is None else self.C
        self.coef_ = np.zeros(features.shape[1])
        if weight != NO_CORRECTION:
            C = weight / len(targets)
            slopes = _through_zero(
                features / scale,
                targets / deviation,
                C,
                self.band,
            )
            self.coef_ = slopes * deviation / scale

        # the uncertainty of no correction is that of the weakest
        strength = len(targets) / (weight or WEAKEST)
        self._set_moment(features, strength * scale**2)
        return self

    def _set_moment(self, features: Floats, penalty: Floats) -> None:
        """Set that of a ridge regression."""
        moment = features.T @ features + np.diag(penalty)
        self.inverse_moment_ = np.linalg.pinv(moment, hermitian=True)

    @property
    def band(self) -> float:
        """The insensitive band, where none is given a tenth."""
        return FIRST_BAND if self.epsilon is None else float(self.epsilon)

    def error(self, model: ShipModel, trial: Trial) -> float:
        """What the search for weight and bands makes small."""
        return heading_error(model, trial)

    def fit_equations(self, problem: Problem) -> Estimators:
        """Copies fitted to all equations, weight and bands chosen where not given.

        The model of `problem` is the bare reference ship as a model of the target.
        Raises InputError for a model without a reference ship.
        """
        self.check()
        blank = problem.blank
        if not isinstance(blank.table, GreyBox):
            raise InputError(
                "method 'rm-svm': expected structure 'grey-box', which has a reference"
                f" ship, got {blank.structure!r}; give the structure with a"
                " reference_model ('auto', a shipped model's name or a model file), or"
                " choose another method, such as 'tls-svm'"
            )
        tuner = _Tuner(self, problem)
        weight = tuner.weight() if self.C is None else float(self.C)
        bands = tuner.bands(weight)
        found: Estimators = {}
        for q, band in zip(problem.samples.features, bands, strict=True):
            found[q] = tuner.fitted(q, weight, band, tuner.everything)
            found[q].chosen_ = {"C": weight, "epsilon": band}  # type: ignore[attr-defined]
        return found


def _through_zero(Z: Floats, e: Floats, C: float, band: float) -> Floats:
    """Slopes of an epsilon-SVR without offset, by coordinate descent."""
    machine = LinearSVR(
        C=C,
        epsilon=band,
        fit_intercept=False,
        dual=True,
        tol=1e-6,
        max_iter=20_000,
        random_state=0,
    )
    with warnings.catch_warnings(action="ignore", category=ConvergenceWarning):
        return np.asarray(machine.fit(Z, e).coef_, dtype=float)


class _Tuner:
    """Fits with different settings, and simulations with what they give."""

    def __init__(self, asked: RMSVM, problem: Problem, most_rows: int = 600) -> None:
        self.asked = asked
        self.samples = problem.samples
        self.blank = problem.blank
        self.trials = problem.used
        # sequential minimal optimisation takes the square of the number of rows
        n_rows = len(problem.samples)
        self.every = max(1, math.ceil(n_rows / most_rows))
        self.everything = np.ones(n_rows, dtype=bool)
        self.first_bands = [asked.band] * len(problem.samples.features)
        self._known: dict[tuple[Any, ...], RMSVM] = {}

    def fitted(self, equation: str, weight: float, band: float, rows: Flags) -> RMSVM:
        """The estimator of one equation for some of the rows."""
        key = (equation, weight, band, rows.tobytes())
        if key not in self._known:
            used = np.flatnonzero(rows)[:: self.every]
            self._known[key] = (
                clone(self.asked)
                .set_params(C=weight, epsilon=band)
                .fit(
                    self.samples.features[equation][used],
                    self.samples.targets[equation][used],
                )
            )
        return self._known[key]

    def model(self, weight: float, bands: Sequence[float], rows: Flags) -> ShipModel:
        """The grey box with the corrections fitted to some of the rows."""
        return self.blank.with_accelerations(
            {
                q: self.fitted(q, weight, band, rows).coef_
                for q, band in zip(self.samples.features, bands, strict=True)
            }
        )

    def weight(self) -> float:
        """The least weight of the errors nearly as good as the best, on data held out.

        Simulated headings are compared, not accelerations: collinear terms hardly
        change these. Where it makes no difference the reference ship is to be believed,
        because the hard turn is in no zigzag.
        """
        folds = list(held_out_rows(self.trials, self.samples, self.asked.folds))

        def error(weight: float) -> float:
            errors = [
                self.asked.error(self.model(weight, self.first_bands, rows), held)
                for rows, held in folds
            ]
            return float(np.mean(errors))

        errors = [error(weight) for weight in WEIGHTS]
        return float(most_regularised(WEIGHTS, errors))

    def bands(self, weight: float) -> list[float]:
        """The insensitive bands, by a pattern search on simulated headings."""
        first = self.first_bands
        if self.asked.epsilon is not None or weight == NO_CORRECTION:
            return first

        def error(bands: Floats) -> float:
            model = self.model(weight, bands.tolist(), self.everything)
            errors = [self.asked.error(model, trial) for trial in self.trials]
            return float(np.mean(errors))

        found: list[float] = pattern_search(error, np.array(first)).tolist()
        return found


def most_regularised(choices: Sequence[Choice], errors: Sequence[float]) -> Choice:
    """The first choice whose error is at most 1.1 times the least.

    The first of all if none is finite.

    Parameters
    ----------
    choices : sequence
        The most regularised first.
    errors : sequence of float
        Of each choice.
    """
    allowed = 1.1 * min(errors)
    as_good = (
        choice for choice, one in zip(choices, errors, strict=True) if one <= allowed
    )
    return next(as_good, choices[0])


def heading_error(model: ShipModel, trial: Trial) -> float:
    """Root mean square error of the simulated heading of a trial, open loop, rad.

    Infinite where the model runs away.
    """
    prediction = predict(model, trial)
    if prediction is None:
        return np.inf
    return root_mean_square(prediction["psi"] - trial["psi"])
