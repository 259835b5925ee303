"""How certain the coefficients are, together: one covariance over all equations of motion."""

from itertools import product

import numpy as np

from identification.estimators.estimator import Estimator, Estimators, weights
from identification.estimators.threads import single_threaded
from identification.regression.samples import Samples
from shipgym.arrays import Floats


def residuals(estimators: Estimators, samples: Samples) -> dict[str, Floats]:
    """Target less prediction of each equation, arrays of shape (n_rows,)."""
    return {
        q: samples.targets[q] - estimators[q].predict(samples.features[q])
        for q in estimators
    }


@single_threaded()
def joint_covariance(
    estimators: Estimators, samples: Samples, memory: float = 0.0
) -> Floats:
    """Covariance of the coefficients of all equations, residuals correlated across equations and in time.

    With the coefficients of each equation a linear map of its targets, the covariance
    follows from that of the residuals. Without memory they are independent in time
    (classical formula, with the covariance of the residuals between equations); with
    memory it is estimated as by Newey & West 1987 (Econometrica 55(3)) with Bartlett's
    weights, each trial by itself. Exact features are assumed. Of an estimator that
    weights its samples it is the residuals times their weights that count (Huber's
    sandwich). `estimators`: fitted to `samples` without intercept, by equation;
    `samples`: the regression; `memory`: time over which residuals are taken to be
    correlated, s. Returns the covariance in the order of the equations and their
    features, shape (n_coefficients, n_coefficients).
    """
    counts = {q: weights(estimators[q], samples.features[q]) for q in estimators}
    errors = {
        q: error * counts[q] for q, error in residuals(estimators, samples).items()
    }
    freedom = {
        q: effective_freedom(estimators[q], samples.features[q]) for q in estimators
    }
    maps = {q: samples.features[q] @ estimators[q].inverse_moment_ for q in estimators}
    if memory <= 0.0:
        pairs = product(estimators, repeat=2)
        sizes = {
            (p, q): (errors[p] @ errors[q]) / np.sqrt(freedom[p] * freedom[q])
            for p, q in pairs
        }
        return np.block(
            [
                [sizes[p, q] * (maps[p].T @ maps[q]) for q in estimators]
                for p in estimators
            ]
        )
    scaled = {
        q: error * np.sqrt(len(samples) / freedom[q]) for q, error in errors.items()
    }
    scores = np.hstack([maps[q] * scaled[q][:, None] for q in estimators])
    total = np.zeros((scores.shape[1],) * 2)
    for trial in np.unique(samples.trial):
        rows = samples.trial == trial
        spacing = (
            float(np.median(np.diff(samples.start[rows]))) if rows.sum() > 1 else memory
        )
        total += newey_west(scores[rows], round(memory / spacing))
    return 0.5 * (total + total.T)


def effective_freedom(estimator: Estimator, features: Floats) -> float:
    """Samples less effective number of parameters, at least 1."""
    moment = features.T @ (features * weights(estimator, features)[:, None])
    used = float(np.einsum("ij,ji->", estimator.inverse_moment_, moment))
    return max(len(features) - used, 1.0)


def coefficient_covariance(
    acceleration_covariance: Floats, acceleration_matrix: Floats
) -> Floats:
    """Covariance of the hydrodynamic derivatives from that of the coefficients of the accelerations.

    Both have the shape (n, n), as the matrix, which maps derivatives to those
    coefficients (`Structure.acceleration_matrix`).
    """
    half = np.linalg.solve(acceleration_matrix, acceleration_covariance)
    covariance: Floats = np.linalg.solve(acceleration_matrix, half.T)
    return 0.5 * (covariance + covariance.T)


def newey_west(scores: Floats, lags: int) -> Floats:
    """Long-run second moment of the rows of scores, shape (n_columns, n_columns)."""
    lags = min(lags, len(scores) - 1)
    total: Floats = scores.T @ scores
    for lag in range(1, lags + 1):
        shifted = scores[lag:].T @ scores[:-lag]
        total += (1.0 - lag / (lags + 1.0)) * (shifted + shifted.T)
    return total
