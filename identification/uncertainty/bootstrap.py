"""Covariance of coefficients by refits to blocks of the record (bootstrap)."""

from collections.abc import Sequence

import numpy as np
from sklearn.base import clone

from identification.estimators.estimator import Estimator, Estimators
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.threads import single_threaded
from identification.progress import counted
from identification.regression.samples import Samples
from identification.uncertainty.covariance import residuals
from shipgym.arrays import Floats, Integers
from shipgym.trials.resampling import usual_step

DRAWS = 200


def moving_blocks(
    groups: Sequence[Integers],
    lengths: Sequence[int],
    rng: np.random.Generator,
) -> Integers:
    """Rows drawn in blocks with replacement, as many as there are, by group.

    Künsch 1989, Annals of Statistics 17(3): every stretch of the block's length is as
    likely. A group are rows that follow one another in time, such as those of one
    trial; lengths are rows in a block, by group.
    """
    drawn = []
    for rows, length in zip(groups, lengths, strict=True):
        n_rows = len(rows)
        block = min(length, n_rows)
        n_blocks = -(-n_rows // block)  # rounded up
        starts = rng.integers(0, n_rows - block + 1, n_blocks)
        places = starts[:, None] + np.arange(block)
        drawn.append(rows[places.ravel()[:n_rows]])
    return np.concatenate(drawn)


@single_threaded()
def bootstrap_covariance(
    estimators: Estimators,
    samples: Samples,
    memory: float,
    draws: int = DRAWS,
    seed: int = 0,
) -> Floats:
    """Covariance of the coefficients of all equations by a block bootstrap over time.

    Estimators, fitted to `samples`, that choose their rank or regularisation keep what
    they chose. LS-SVMs are fitted again, other linear estimators take the linear step
    that the drawn residuals give. Blocks are `memory` long, s; at least one row.
    Returns the covariance in the order of the equations and their features, shape
    (n_coefficients, n_coefficients).
    """
    rng = np.random.default_rng(seed)
    groups = []
    lengths = []
    for trial in np.unique(samples.trial):
        rows = np.flatnonzero(samples.trial == trial)
        groups.append(rows)
        lengths.append(rows_in(memory, samples.start[rows]))
    errors = residuals(estimators, samples)

    refits = []
    for _ in counted("bootstrap", range(draws)):
        rows = moving_blocks(groups, lengths, rng)
        coefficients = []
        for q, estimator in estimators.items():
            X = samples.features[q][rows]
            y = samples.targets[q][rows]
            coefficients.append(_refitted(estimator, X, y, errors[q][rows]))
        refits.append(np.concatenate(coefficients))
    return np.asarray(np.cov(np.transpose(refits)))


def influence_covariance(
    influences: Sequence[Floats],
    block: int,
    draws: int = DRAWS,
    seed: int = 0,
) -> Floats:
    """Covariance of coefficients by a block bootstrap of what stretches add to them.

    One Newton step instead of a refit (Davidson & MacKinnon 1999, International
    Economic Review 40(2)). Influences by trial, in the order of time, of shape
    (n_stretches, n_coefficients); a block is so many stretches.
    """
    rng = np.random.default_rng(seed)
    stacked = np.concatenate(influences)
    groups = []
    first = 0
    for stretches in influences:
        end = first + len(stretches)
        groups.append(np.arange(first, end))
        first = end
    lengths = [block] * len(groups)

    totals = []
    for _ in range(draws):
        rows = moving_blocks(groups, lengths, rng)
        totals.append(stacked[rows].sum(axis=0))
    return np.asarray(np.cov(np.transpose(totals)))


def rows_in(memory: float, start: Floats) -> int:
    """Rows of a regression that start within a time, s, at least one."""
    if len(start) < 2:
        return 1
    spacing = usual_step(start)
    if spacing <= 0.0:
        return 1
    return max(round(memory / spacing), 1)


def _refitted(estimator: Estimator, X: Floats, y: Floats, errors: Floats) -> Floats:
    """Coefficients from the drawn rows, whose errors by the estimator are given."""
    if isinstance(estimator, TruncatedLSSVM | LSSVM):
        refit = clone(estimator)
        if isinstance(estimator, TruncatedLSSVM):
            refit.set_params(rank=estimator.rank_)
        return np.asarray(refit.fit(X, y).coef_)
    step = estimator.inverse_moment_ @ (X.T @ errors)
    return np.asarray(estimator.coef_ + step)
