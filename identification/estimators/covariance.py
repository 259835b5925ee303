"""Covariance of the coefficients of all equations of motion together."""

import copy
from collections.abc import Sequence

import numpy as np

from identification.estimators.linear import Estimator, Estimators, weights
from identification.estimators.threads import single_threaded
from identification.samples.samples import Samples
from shipgym.arrays import Flags, Floats
from shipgym.trials.resampling import usual_step


def residuals(estimators: Estimators, samples: Samples) -> dict[str, Floats]:
    """Target less prediction of each equation, arrays of shape (n_rows,)."""
    return {
        q: samples.targets[q] - estimator.predict(samples.features[q])
        for q, estimator in estimators.items()
    }


@single_threaded()
def joint_covariance(
    estimators: Estimators,
    samples: Samples,
    memory: float,
) -> Floats:
    """Covariance of the coefficients of all equations.

    With the coefficients of each equation a linear map of its targets, the covariance
    follows from that of the residuals, estimated as by Newey & West 1987 (Econometrica
    55(3)) with Bartlett's weights, each trial by itself. Exact features are assumed. Of
    an estimator that weights its samples it is the residuals times their weights that
    count (Huber's sandwich). `estimators`: fitted to `samples` without intercept, by
    equation; `samples`: the regression; `memory`: time over which residuals are taken
    to be correlated, s. Returns the covariance in the order of the equations and their
    features, shape (n_coefficients, n_coefficients).
    """
    scores = []
    unweighted = residuals(estimators, samples)
    for q, estimator in estimators.items():
        X = samples.features[q]
        counts = weights(estimator, X)
        # scaled to the variance of errors, of which fitting takes a part
        freedom = effective_freedom(estimator, X)
        scale = np.sqrt(len(samples) / freedom)
        errors = unweighted[q] * counts * scale
        scores.append(X @ estimator.inverse_moment_ * errors[:, None])
    return _long_run(
        np.hstack(scores),
        samples,
        memory,
    )


def _long_run(scores: Floats, samples: Samples, memory: float) -> Floats:
    """Covariance by scores, shape (n_rows, n_coefficients), each trial by itself."""
    n_coefficients = scores.shape[1]
    total = np.zeros((n_coefficients, n_coefficients))
    for trial in np.unique(samples.trial):
        own = samples.trial == trial
        start = samples.start[own]
        lags = round(memory / usual_step(start)) if len(start) > 1 else 1
        total += newey_west(scores[own], lags)
    return 0.5 * (total + total.T)


def effective_freedom(estimator: Estimator, features: Floats) -> float:
    """Samples less effective number of parameters, at least 1."""
    weighted = features * weights(estimator, features)[:, None]
    n_parameters = np.sum(estimator.inverse_moment_ * (features.T @ weighted).T)
    return max(len(features) - float(n_parameters), 1.0)


def coefficient_covariance(
    acceleration_covariance: Floats, acceleration_matrix: Floats
) -> Floats:
    """Covariance of the hydrodynamic derivatives from that of the accelerations.

    Of the coefficients of these, that is. Both have the shape (n, n), as the matrix,
    which maps derivatives to those coefficients (`Structure.acceleration_matrix`).
    """
    half = np.linalg.solve(acceleration_matrix, acceleration_covariance)
    covariance = np.linalg.solve(acceleration_matrix, half.T)
    return 0.5 * (covariance + covariance.T)


def newey_west(scores: Floats, lags: int) -> Floats:
    """Long-run second moment of the rows of scores, shape (n_columns, n_columns).

    By Newey & West 1987, with Bartlett's weights 1 - lag / (lags + 1).
    """
    most = min(lags, len(scores) - 1)
    total = scores.T @ scores
    for lag in range(1, most + 1):
        moment = scores[lag:].T @ scores[:-lag]
        total += (1.0 - lag / (most + 1.0)) * (moment + moment.T)
    return total


def without_trials(
    estimators: Estimators,
    samples: Samples,
    trials: Sequence[int],
) -> tuple[Estimators, Samples]:
    """Estimators as if fitted without some trials, and the rows of the others.

    Exact for linear estimators that keep their directions and penalty: the normal
    equations less the rows left out.
    """
    errors = residuals(estimators, samples)
    out = np.isin(samples.trial, trials)
    found = {
        q: _without_rows(estimator, samples.features[q], errors[q], out)
        for q, estimator in estimators.items()
    }
    return found, samples.select(~out)


def _without_rows(
    estimator: Estimator,
    features: Floats,
    errors: Floats,
    out: Flags,
) -> Estimator:
    """An estimator less the rows of its normal equations that are `out`.

    With M the inverse moment of all, that of the others is (1 - M X'W X)^-1 M, with the
    features X and weights W of the rows left out.
    """
    counts = weights(estimator, features)
    M = estimator.inverse_moment_
    X = features[out]
    XW = X.T * counts[out]
    change = np.linalg.pinv(np.eye(len(M)) - M @ XW @ X)

    inverse = change @ M
    moved = XW @ errors[out]

    found = copy.copy(estimator)
    found.coef_ = estimator.coef_ - inverse @ moved
    found.inverse_moment_ = inverse
    if hasattr(estimator, "weights_"):
        found.weights_ = counts[~out]  # type: ignore[attr-defined]
    return found
