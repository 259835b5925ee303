"""Covariance of coefficients by refits to blocks of the record (bootstrap)."""

from collections.abc import Mapping, Sequence

import numpy as np
from sklearn.base import clone

from identification.estimators.covariance import residuals
from identification.estimators.estimator import Estimator, Estimators
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.threads import single_threaded
from identification.progress import counted
from identification.samples.samples import Samples
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
        last_start = n_rows - block
        starts = rng.integers(0, last_start + 1, n_blocks)
        places = starts[:, None] + np.arange(block)
        kept = places.ravel()[:n_rows]
        drawn.append(rows[kept])
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
    groups = [np.flatnonzero(samples.trial == k) for k in np.unique(samples.trial)]
    lengths = [rows_in(memory, samples.start[rows]) for rows in groups]
    errors = residuals(estimators, samples)

    refits = []
    for _ in counted("bootstrap", range(draws)):
        rows = moving_blocks(groups, lengths, rng)
        refits.append(_all_refitted(estimators, samples, errors, rows))
    return np.asarray(np.cov(np.transpose(refits)))


def _all_refitted(
    estimators: Estimators,
    samples: Samples,
    errors: Mapping[str, Floats],
    rows: Integers,
) -> Floats:
    """Coefficients of all equations from the drawn rows."""
    coefficients = []
    for q, estimator in estimators.items():
        refit = _refitted(
            estimator,
            X=samples.features[q][rows],
            y=samples.targets[q][rows],
            errors=errors[q][rows],
        )
        coefficients.append(refit)
    return np.concatenate(coefficients)


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
        refit.fit(X, y)
        return np.asarray(refit.coef_)
    step = estimator.inverse_moment_ @ (X.T @ errors)
    return np.asarray(estimator.coef_ + step)
