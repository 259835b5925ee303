"""RM-SVM: a linear support vector regression of what a reference ship leaves.

Source: Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via
adaptive RM-SVM with minor rudder. The Lagrangian printed there (9) is that of LS-SVM,
but insensitive band and solver are those of the epsilon-SVR that is fitted here
(Drucker et al. 1997, Support vector regression estimators).
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.svm import SVR, LinearSVR

from identification.arrays import column_rms, mean_square, root_mean_square
from identification.estimators.estimator import Estimators, FitTask
from identification.estimators.linear import LinearRegressor, validated
from identification.estimators.pattern_search import pattern_search
from identification.estimators.search import BAND, SearchResult
from identification.samples.folds import FOLDS, TRIALS, held_out_rows
from identification.samples.prediction import predict
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_flag, check_number, check_whole
from shipgym.ships import GreyBox

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
        ship. None: 1, or by `identify` the strongest regularisation nearly as good as
        the best on trials held out.
    epsilon : float or None, at least 0
        The insensitive band in [0, 1], standard deviations of the target. None: 0.1, or
        by `identify` from a pattern search.
    objective : {"rmse", "correlation"}
        What that search compares of simulated and measured heading; "correlation" as in
        the paper, which is blind to scale and offset.
    free_constant : bool
        Whether `identify` leaves the constant unpenalised, as the paper does. By
        default it is penalised like the other terms, so that the weight leads from the
        bare reference ship to the free fit in small steps.
    folds : {"trials", "largest-rudder"}
        What `identify` chooses the weight by: each trial held out in turn (of a single
        one, pieces), or the trials of the largest rudder together, for models that are
        to turn harder than any trial.
    constant : int or None
        Column that is a free constant, or its integral, by which rows are divided;
        `identify` finds it.

    Attributes
    ----------
    coef_ : array of shape (n_features,)
        Of the features as given.
    inverse_moment_, covariance_ : array of shape (n_features, n_features)
        Of the ridge regression of the same strength, at C = 0 of the weakest: an SVR
        has none of its own.
    n_features_in_ : int
        Number of features.
    """

    name: ClassVar[str] = "rm-svm"
    options: ClassVar[tuple[str, ...]] = (
        "C",
        "epsilon",
        "objective",
        "free_constant",
        "folds",
        "constant",
    )

    C: float | None = None
    epsilon: float | None = None
    objective: str = "rmse"
    free_constant: bool = False
    constant: int | None = None
    folds: str = TRIALS

    def check(self) -> None:
        """Refuse settings that cannot be, by an InputError that names the setting."""
        objectives = ("rmse", "correlation")
        check_choice(self.objective, objectives, "objective")
        check_choice(self.folds, FOLDS, "folds")
        check_flag(self.free_constant, "free_constant")
        if self.constant is not None:
            check_whole(self.constant, "constant", at_least=0)
        if self.C is not None:
            check_number(self.C, "C", at_least=0.0)
        if self.epsilon is not None:
            hint = "in standard deviations of the target"
            check_number(self.epsilon, "epsilon", at_least=0.0, hint=hint)

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples (n_samples, n_features) and targets (n_samples,)."""
        self.check()
        features, targets = validated(self, X, y)
        rows = _Standardised(features, targets, self.constant)
        weight = 1.0 if self.C is None else float(self.C)
        if weight == NO_CORRECTION:
            self.coef_ = np.zeros(features.shape[1])
            # its uncertainty is that of the weakest correction
            self.inverse_moment_ = rows.inverse_moment(WEAKEST)
        else:
            slopes, offset = self._solve(rows, weight)
            self.coef_ = rows.coefficients(slopes, offset)
            self.inverse_moment_ = rows.inverse_moment(weight)

        residuals = targets - features @ self.coef_
        self.covariance_ = mean_square(residuals) * self.inverse_moment_
        return self

    def _solve(self, rows: "_Standardised", weight: float) -> tuple[Floats, float]:
        """Slopes and offset for standardised features and targets."""
        Z = rows.features
        e = rows.targets
        if not Z.shape[1]:
            return np.zeros(0), 0.0

        band = FIRST_BAND
        if self.epsilon is not None:
            band = float(self.epsilon)
        C = weight / len(e)
        if self.constant is None:
            return _through_zero(Z, e, C=C, band=band), 0.0
        solver = SVR(kernel="linear", C=C, epsilon=band).fit(Z, e)
        slopes = np.asarray(solver.coef_, dtype=float).ravel()
        offset = float(np.sum(solver.intercept_))
        return slopes, offset

    def fit_equations(self, task: FitTask) -> Estimators:
        """Copies fitted to all equations, weight and bands chosen where not given.

        The model of `task` is the bare reference ship as a model of the target. Raises
        InputError for a model without a reference ship.
        """
        self.check()
        blank = task.blank
        if not isinstance(blank.table, GreyBox):
            raise InputError(
                "method 'rm-svm': expected structure 'grey-box', which has a reference"
                f" ship, got {blank.structure!r}; give the structure with a"
                " reference_model ('auto', a shipped model's name or a model file), or"
                " choose another method, such as 'tls-svm'"
            )
        tuner = _Tuner(self, task)
        weight = tuner.weight() if self.C is None else float(self.C)
        bands, search = tuner.bands(weight)

        found: Estimators = {}
        for k, q in enumerate(task.samples.features):
            band = bands[k]
            estimator = tuner.fitted(
                q,
                weight=weight,
                band=band,
                rows=tuner.everything,
            )
            estimator.chosen_ = {"C": weight, "epsilon": band}
            if search is not None:
                estimator.search_ = search.of(k, BAND)
            found[q] = estimator
        return found


class _Standardised:
    """Features and targets of unit size, and of zero mean where a constant is free.

    Attributes
    ----------
    features : array of shape (n_samples, n_penalised)
        Of the penalised terms.
    targets : array of shape (n_samples,)
        In standard deviations.
    """

    def __init__(self, X: Floats, y: Floats, constant: int | None) -> None:
        n_samples, n_features = X.shape
        self._X = X
        self._constant = constant
        self._penalised = np.arange(n_features) != constant
        self._duration = np.ones(n_samples)
        if constant is not None:
            self._duration = X[:, constant]
        self._standardise_features(X / self._duration[:, None])
        self._standardise_targets(y / self._duration)

    def _standardise_features(self, rows: Floats) -> None:
        self._centre = np.zeros(rows.shape[1])
        if self._constant is not None:
            means = rows.mean(axis=0)
            self._centre = np.where(self._penalised, means, 0.0)
        deviations = rows - self._centre
        size = column_rms(deviations)
        has_size = (size > 0.0) & self._penalised
        self._scale = np.where(has_size, size, 1.0)
        standardised = deviations / self._scale
        self.features = standardised[:, self._penalised]

    def _standardise_targets(self, targets: Floats) -> None:
        self._level = 0.0
        if self._constant is not None:
            self._level = float(targets.mean())
        deviations = targets - self._level
        self._deviation = root_mean_square(deviations) or 1.0
        self.targets = deviations / self._deviation

    def coefficients(self, slopes: Floats, offset: float) -> Floats:
        """Coefficients of the features as given, shape (n_features,)."""
        penalised = self._penalised
        found = np.zeros(len(penalised))
        scale = self._scale[penalised]
        found[penalised] = slopes * self._deviation / scale
        if self._constant is not None:
            level = self._level + self._deviation * offset
            at_centre = self._centre @ found
            found[self._constant] = level - at_centre
        return found

    def inverse_moment(self, weight: float) -> Floats:
        """Regularised inverse of X'X of the ridge regression of the same strength."""
        X = self._X
        usual_duration = np.mean(self._duration)
        strength = len(X) / weight * usual_duration**2
        penalty = strength * self._scale**2
        penalty[~self._penalised] = 0.0
        moment = X.T @ X + np.diag(penalty)
        inverse = np.linalg.pinv(moment, hermitian=True)
        return np.asarray(inverse)


def _through_zero(Z: Floats, e: Floats, C: float, band: float) -> Floats:
    """Slopes of an epsilon-SVR without offset.

    By coordinate descent, whose time is proportional to the number of samples; where it
    does not converge, by sequential minimal optimisation of the samples and their
    mirror image, which makes the offset zero.
    """
    quick = LinearSVR(
        C=C,
        epsilon=band,
        fit_intercept=False,
        dual=True,
        tol=1e-6,
        max_iter=20_000,
        random_state=0,
    )
    with warnings.catch_warnings(action="error", category=ConvergenceWarning):
        try:
            return np.asarray(quick.fit(Z, e).coef_, dtype=float)
        except ConvergenceWarning:
            pass

    both = SVR(kernel="linear", C=0.5 * C, epsilon=band)
    both.fit(np.vstack([Z, -Z]), np.append(e, -e))
    return np.asarray(both.coef_, dtype=float).ravel()


class _Tuner:
    """Fits with different settings, and simulations with what they give."""

    def __init__(self, asked: RMSVM, task: FitTask, most_rows: int = 600) -> None:
        self.asked = asked
        self.samples = task.samples
        self.blank = task.blank
        self.trials = task.trials
        # sequential minimal optimisation takes the square of the number of rows
        n_rows = len(task.samples)
        self.every = max(1, math.ceil(n_rows / most_rows))
        self.everything = np.ones(n_rows, dtype=bool)
        band = FIRST_BAND if asked.epsilon is None else asked.epsilon
        self.first_bands = [band] * len(task.samples.features)
        self._known: dict[tuple[Any, ...], RMSVM] = {}

    def fitted(self, equation: str, weight: float, band: float, rows: Flags) -> RMSVM:
        """The estimator of one equation for some of the rows."""
        key = (equation, weight, band, rows.tobytes())
        if key not in self._known:
            estimator = clone(self.asked).set_params(
                C=weight,
                epsilon=band,
                constant=self._free_constant(equation),
            )
            chosen = np.flatnonzero(rows)
            used = chosen[:: self.every]
            X = self.samples.features[equation][used]
            y = self.samples.targets[equation][used]
            self._known[key] = estimator.fit(X, y)
        return self._known[key]

    def _free_constant(self, equation: str) -> int | None:
        """Column of the constant that has no penalty."""
        terms = self.blank.table.terms(equation)
        names = [term.name for term in terms]
        if self.asked.free_constant and "0" in names:
            return names.index("0")
        return None

    def model(self, weight: float, bands: Sequence[float], rows: Flags) -> ShipModel:
        """The grey box with the corrections fitted to some of the rows."""
        coefficients = {}
        equations = self.samples.features
        for q, band in zip(equations, bands, strict=True):
            estimator = self.fitted(q, weight, band, rows)
            coefficients[q] = estimator.coef_
        return self.blank.with_accelerations(coefficients)

    def weight(self) -> float:
        """The least weight of the errors nearly as good as the best, on data held out.

        Simulated headings are compared, not accelerations: collinear terms hardly
        change these. Where it makes no difference the reference ship is to be believed,
        because the hard turn is in no zigzag.
        """
        folds = list(held_out_rows(self.trials, self.samples, self.asked.folds))

        def error(weight: float) -> float:
            errors = []
            for rows, held in folds:
                model = self.model(
                    weight,
                    bands=self.first_bands,
                    rows=rows,
                )
                own = heading_error(model, held, "rmse")
                errors.append(own)
            return float(np.mean(errors))

        errors = [error(weight) for weight in WEIGHTS]
        return float(most_regularised(WEIGHTS, errors))

    def bands(self, weight: float) -> tuple[list[float], SearchResult | None]:
        """The insensitive bands, by a pattern search on simulated headings."""
        first = self.first_bands
        asked = self.asked
        if asked.epsilon is not None or weight == NO_CORRECTION:
            return first, None

        def error(bands: Floats) -> float:
            model = self.model(
                weight,
                bands=bands.tolist(),
                rows=self.everything,
            )
            errors = []
            for trial in self.trials:
                own = heading_error(model, trial, asked.objective)
                errors.append(own)
            return float(np.mean(errors))

        search = pattern_search(
            error,
            start=first,
            low=np.zeros(len(first)),
            high=np.ones(len(first)),
        )
        return search.x.tolist(), search


def most_regularised(
    choices: Sequence[Choice],
    errors: Sequence[float],
    tolerance: float = 1.1,
) -> Choice:
    """The first choice whose error is nearly the least.

    The first of all if none is finite.

    Parameters
    ----------
    choices : sequence
        The most regularised first.
    errors : sequence of float
        Of each choice.
    tolerance : float
        Times the least error counts as equally good.
    """
    allowed = tolerance * min(errors)
    for choice, error in zip(choices, errors, strict=True):
        if error <= allowed:
            return choice
    return choices[0]


def heading_error(model: ShipModel, trial: Trial, objective: str) -> float:
    """Error of the simulated heading of a trial, open loop.

    Root mean square, rad ("rmse"), or 1 less Pearson's correlation with the measured
    one ("correlation"). Infinite where the model runs away.
    """
    prediction = predict(model, trial)
    if prediction is None:
        return np.inf
    predicted = prediction["psi"]
    measured = trial["psi"]
    if objective == "rmse":
        return root_mean_square(predicted - measured)
    if np.ptp(predicted) == 0.0 or np.ptp(measured) == 0.0:
        return 1.0
    correlations = np.corrcoef(predicted, measured)
    return 1.0 - float(correlations[0, 1])
