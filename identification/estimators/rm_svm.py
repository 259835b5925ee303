"""RM-SVM: a linear support vector regression of what a reference ship leaves of the accelerations.

Source: Mei, Sun & Shi 2019, Ship maneuvering prediction using grey box framework via
adaptive RM-SVM with minor rudder. The Lagrangian printed there (9) is that of LS-SVM,
but insensitive band and solver are those of the epsilon-SVR that is fitted here
(Drucker et al. 1997, Support vector regression estimators).
"""

import warnings
from collections.abc import Callable, Sequence
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import Ridge
from sklearn.svm import SVR, LinearSVR

from identification.estimators.estimator import Estimator, Estimators, FitTask
from identification.estimators.linear import LinearRegressor, settings, validated
from identification.search.pattern_search import pattern_search
from identification.search.search import BAND, SearchResult
from identification.validation.folds import FOLDS, TRIALS, held_out_rows
from identification.validation.prediction import predict
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_number
from shipgym.ships import GreyBox

OBJECTIVES = ("rmse", "correlation")
REGRESSIONS = ("svr", "ls-svm")
NO_CORRECTION = (
    0.0  # weight of the errors at which nothing is added to the reference ship
)
WEIGHTS = (NO_CORRECTION, *np.geomspace(0.01, 100.0, 9).tolist())
ERROR_TOLERANCE = 1.1  # times the least error counts as equally good
FIRST_BAND = 0.1
MOST_ROWS = (
    600  # of the regression: sequential minimal optimisation takes the square of it
)
MOST_SWEEPS = 20_000  # of coordinate descent through the samples

Choice = TypeVar("Choice")


@settings()
class RMSVM(LinearRegressor):
    """The linear correction of one equation: epsilon-SVR with standardised features and targets.

    Minimises w.w / 2 + C mean(max(|e| - epsilon, 0)) with the w of the standardised
    features and e in standard deviations of the target.

    Parameters
    ----------
    C : float or None
        Weight of the errors, by the mean over samples; 0 adds nothing to the reference
        ship. None: 1, or by `identify` the strongest regularisation nearly as good as
        the best on trials held out.
    epsilon : float or None
        The insensitive band in [0, 1], standard deviations of the target. None: 0.1, or
        by `identify` from a pattern search.
    objective : {"rmse", "correlation"}
        What that search compares of simulated and measured heading; "correlation" as in
        the paper, which is blind to scale and offset.
    regression : {"svr", "ls-svm"}
        Epsilon-SVR, or the LS-SVM that the paper's Lagrangian is of, which has no band.
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

    C: float | None = None
    epsilon: float | None = None
    objective: str = "rmse"
    regression: str = "svr"
    free_constant: bool = False
    constant: int | None = None
    folds: str = TRIALS

    def check(self) -> None:
        """Refuse settings that cannot be by an InputError."""
        check_choice(self.objective, OBJECTIVES, "objective")
        check_choice(self.regression, REGRESSIONS, "regression")
        check_choice(self.folds, FOLDS, "folds")
        if self.C is not None:
            check_number(self.C, "C", at_least=0.0)
        if self.epsilon is not None:
            check_number(
                self.epsilon,
                "epsilon",
                at_least=0.0,
                hint="in standard deviations of the target",
            )

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Fit to samples of shape (n_samples, n_features) and targets of shape (n_samples,)."""
        self.check()
        features, target = validated(self, X, y)
        weight = 1.0 if self.C is None else float(self.C)
        self._fit(features, target, weight or WEIGHTS[1])
        if weight == NO_CORRECTION:  # its uncertainty is that of the weakest correction
            self.coef_ = np.zeros(features.shape[1])
        self.covariance_ = (
            float(np.mean((target - features @ self.coef_) ** 2)) * self.inverse_moment_
        )
        return self

    def _fit(self, X: Floats, y: Floats, weight: float) -> None:
        band = FIRST_BAND if self.epsilon is None else float(self.epsilon)
        duration = np.ones(len(y)) if self.constant is None else X[:, self.constant]
        rows, target = X / duration[:, None], y / duration
        free = np.arange(X.shape[1]) != self.constant  # all of them without a constant
        centre, level = np.zeros(X.shape[1]), 0.0
        if self.constant is not None:
            centre, level = np.where(free, rows.mean(axis=0), 0.0), float(target.mean())
        scale = np.sqrt(np.mean((rows - centre) ** 2, axis=0))
        scale = np.where((scale > 0.0) & free, scale, 1.0)
        deviation = float(np.sqrt(np.mean((target - level) ** 2))) or 1.0
        Z, e = ((rows - centre) / scale)[:, free], (target - level) / deviation
        slope, offset = self._solve(Z, e, weight, band)
        self.coef_ = np.zeros(X.shape[1])
        self.coef_[free] = slope * deviation / scale[free]
        if self.constant is not None:
            self.coef_[self.constant] = level + deviation * offset - centre @ self.coef_
        penalty = np.diag(
            np.where(free, len(y) / weight * scale**2 * np.mean(duration) ** 2, 0.0)
        )
        self.inverse_moment_ = np.linalg.pinv(X.T @ X + penalty, hermitian=True)

    def _solve(
        self, Z: Floats, e: Floats, weight: float, band: float
    ) -> tuple[Floats, float]:
        """Slopes and offset for standardised features and targets."""
        if not Z.shape[1]:
            return np.zeros(0), 0.0
        has_offset, C, svr = (
            self.constant is not None,
            weight / len(e),
            self.regression == "svr",
        )
        if svr and not has_offset:
            return _through_zero(Z, e, C, band), 0.0
        ridge = Ridge(alpha=1.0 / C, fit_intercept=has_offset)
        solver = (SVR(kernel="linear", C=C, epsilon=band) if svr else ridge).fit(Z, e)
        return np.asarray(solver.coef_, dtype=float).ravel(), float(
            np.sum(solver.intercept_)
        )


def _through_zero(Z: Floats, e: Floats, C: float, band: float) -> Floats:
    """Slopes of an epsilon-SVR without offset.

    By coordinate descent, whose time is proportional to the number of samples; where it
    does not converge, by sequential minimal optimisation of the samples and their
    mirror image, which makes the offset zero.
    """
    solver = {"dual": True, "tol": 1e-6, "max_iter": MOST_SWEEPS, "random_state": 0}
    quick = LinearSVR(C=C, epsilon=band, fit_intercept=False, **solver)
    with warnings.catch_warnings(action="error", category=ConvergenceWarning):
        try:
            return np.asarray(quick.fit(Z, e).coef_, dtype=float)
        except ConvergenceWarning:
            both = SVR(kernel="linear", C=0.5 * C, epsilon=band).fit(
                np.vstack([Z, -Z]), np.append(e, -e)
            )
            return np.asarray(both.coef_, dtype=float).ravel()


def fit_rm_svm(make: Callable[[], Estimator], task: FitTask) -> Estimators:
    """Fit the corrections of all equations, with weight and insensitive bands chosen where not given.

    `make`: makes an unfitted `RMSVM` with the settings asked for; `task`: its model is
    the bare reference ship as a model of the target. Raises InputError for a model
    without a reference ship.
    """
    asked = make()
    assert isinstance(asked, RMSVM)
    asked.check()
    if not isinstance(task.blank.table, GreyBox):
        raise InputError(
            f"method: 'rm-svm' found with structure {task.blank.structure!r}, expected"
            " structure 'grey-box', which has a reference ship, with a"
            " reference_model: 'auto', a shipped model's name or a model file; or"
            " choose another method, such as 'tls-svm'"
        )
    tuner, found = _Tuner(asked, task), dict[str, Estimator]()
    weight = tuner.weight() if asked.C is None else float(asked.C)
    bands, search = tuner.bands(weight)
    for k, (q, band) in enumerate(zip(task.samples.features, bands, strict=True)):
        found[q] = estimator = tuner.fitted(q, weight, band, tuner.everything)
        estimator.chosen_ = {"C": weight, "epsilon": band}
        if search is not None:
            estimator.search_ = search.of(k, BAND)
    return found


class _Tuner:
    """Fits with different settings, and simulations with what they give."""

    def __init__(self, asked: RMSVM, task: FitTask) -> None:
        self.asked, self.samples, self.blank, self.trials = (
            asked,
            task.samples,
            task.blank,
            task.trials,
        )
        self.thin = max(1, -(-len(task.samples) // MOST_ROWS))
        self.everything = np.ones(len(task.samples), dtype=bool)
        band = FIRST_BAND if asked.epsilon is None else asked.epsilon
        self.first_bands = [band] * len(task.samples.features)
        self._known: dict[tuple[Any, ...], RMSVM] = {}

    def fitted(self, equation: str, weight: float, band: float, rows: Flags) -> RMSVM:
        """The estimator of one equation for some of the rows."""
        key = (equation, weight, band, rows.tobytes())
        if key not in self._known:
            names = [term.name for term in self.blank.table.terms(equation)]
            constant = (
                names.index("0") if self.asked.free_constant and "0" in names else None
            )
            used = np.flatnonzero(rows)[:: self.thin]
            X, y = (
                self.samples.features[equation][used],
                self.samples.targets[equation][used],
            )
            chosen = {"C": weight, "epsilon": band, "constant": constant}
            self._known[key] = RMSVM(**self.asked.get_params() | chosen).fit(X, y)
        return self._known[key]

    def model(self, weight: float, bands: Sequence[float], rows: Flags) -> ShipModel:
        """The grey box with the corrections fitted to some of the rows."""
        equations = zip(self.samples.features, bands, strict=True)
        coefficients = {
            q: self.fitted(q, weight, band, rows).coef_ for q, band in equations
        }
        return self.blank.with_accelerations(coefficients)

    def weight(self) -> float:
        """The least weight of the errors nearly as good as the best on what is held out.

        Simulated headings are compared, not accelerations: collinear terms hardly
        change these. Where it makes no difference the reference ship is to be believed,
        because the hard turn is in no zigzag.
        """
        folds = list(held_out_rows(self.trials, self.samples, self.asked.folds))

        def error(weight: float) -> float:
            models = (
                (self.model(weight, self.first_bands, rows), held)
                for rows, held in folds
            )
            return float(
                np.mean([heading_error(model, held, "rmse") for model, held in models])
            )

        return float(most_regularised(WEIGHTS, [error(weight) for weight in WEIGHTS]))

    def bands(self, weight: float) -> tuple[list[float], SearchResult | None]:
        """The insensitive bands, by a pattern search on the simulated heading of the trials."""
        first = self.first_bands
        if (
            self.asked.epsilon is not None
            or weight == NO_CORRECTION
            or self.asked.regression == "ls-svm"
        ):
            return first, None

        def error(bands: Floats) -> float:
            model = self.model(weight, bands.tolist(), self.everything)
            return float(
                np.mean(
                    [heading_error(model, t, self.asked.objective) for t in self.trials]
                )
            )

        search = pattern_search(error, first, np.zeros(len(first)), np.ones(len(first)))
        return search.x.tolist(), search


def most_regularised(choices: Sequence[Choice], errors: Sequence[float]) -> Choice:
    """The first of choices, the most regularised first, whose error is nearly the least, if any is finite."""
    allowed = ERROR_TOLERANCE * min(errors)
    found = (
        choice
        for choice, error in zip(choices, errors, strict=True)
        if error <= allowed
    )
    return next(found, choices[0])


def heading_error(model: ShipModel, trial: Trial, objective: str) -> float:
    """How far the heading of an open-loop simulation is from the measured one.

    Root mean square, rad ("rmse"), or 1 less Pearson's correlation; infinite where the
    model runs away.
    """
    if (prediction := predict(model, trial)) is None:
        return np.inf
    ours, theirs = prediction["psi"], trial["psi"]
    if objective == "rmse":
        return float(np.sqrt(np.mean((ours - theirs) ** 2)))
    if np.ptp(ours) == 0.0 or np.ptp(theirs) == 0.0:
        return 1.0
    return 1.0 - float(np.corrcoef(ours, theirs)[0, 1])
