"""Covariance of coefficients by refits to blocks of the record drawn with replacement."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from sklearn.base import clone

from identification.estimators.estimator import Estimator, Estimators
from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
from identification.estimators.threads import single_threaded
from identification.progress import counted
from identification.regression.samples import Samples
from identification.uncertainty.covariance import residuals
from shipgym.arrays import Floats, Integers

DRAWS = 200


def moving_blocks(
    groups: Sequence[Integers], lengths: Sequence[int], rng: np.random.Generator
) -> Integers:
    """Rows drawn in blocks with replacement, as many as there are, each group by itself.

    Künsch 1989, Annals of Statistics 17(3): every stretch of the block's length is as
    likely. A group are rows that follow one another in time, such as those of one
    trial; lengths are rows in a block, by group.
    """
    drawn = []
    for rows, length in zip(groups, lengths, strict=True):
        block = min(length, len(rows))
        starts = rng.integers(0, len(rows) - block + 1, -(-len(rows) // block))
        drawn.append(rows[(starts[:, None] + np.arange(block)).ravel()[: len(rows)]])
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
    groups = [
        np.flatnonzero(samples.trial == trial) for trial in np.unique(samples.trial)
    ]
    lengths = [_rows_in(memory, samples.start[rows]) for rows in groups]
    errors = residuals(estimators, samples)
    found = []
    for _ in counted("bootstrap", range(draws)):
        rows = moving_blocks(groups, lengths, rng)
        found.append(
            np.concatenate(
                [_again(estimators[q], samples, q, rows, errors[q]) for q in estimators]
            )
        )
    return np.asarray(np.cov(np.array(found).T))


def influence_covariance(
    influences: Sequence[Floats], block: int, draws: int = DRAWS, seed: int = 0
) -> Floats:
    """Covariance of coefficients by a block bootstrap of what each stretch of time adds to them.

    One Newton step instead of a refit (Davidson & MacKinnon 1999, International
    Economic Review 40(2)). Influences by trial, in the order of time, of shape
    (n_stretches, n_coefficients); a block is so many stretches.
    """
    rng = np.random.default_rng(seed)
    stacked = np.concatenate(influences)
    ends = np.cumsum([0, *(len(part) for part in influences)])
    groups = [np.arange(a, b) for a, b in pairwise(ends.tolist())]
    totals = [
        stacked[moving_blocks(groups, [block] * len(groups), rng)].sum(axis=0)
        for _ in range(draws)
    ]
    return np.asarray(np.cov(np.array(totals).T))


def _rows_in(memory: float, start: Floats) -> int:
    spacing = float(np.median(np.diff(start))) if len(start) > 1 else memory
    return max(round(memory / spacing), 1) if spacing > 0.0 else 1


def _again(
    estimator: Estimator,
    samples: Samples,
    equation: str,
    rows: Integers,
    errors: Floats,
) -> Floats:
    """Coefficients from the drawn rows."""
    features, targets = samples.features[equation], samples.targets[equation]
    if isinstance(estimator, TruncatedLSSVM | LSSVM):
        refit = clone(estimator)
        if isinstance(estimator, TruncatedLSSVM):
            refit.set_params(rank=estimator.rank_)
        return np.asarray(refit.fit(features[rows], targets[rows]).coef_)
    return np.asarray(
        estimator.coef_ + estimator.inverse_moment_ @ (features[rows].T @ errors[rows])
    )
