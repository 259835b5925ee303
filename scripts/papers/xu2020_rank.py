"""Truncation on the 38 collinear terms: errors against rank and noise.

Ten of the seventeen tests are fitted, X, Y and N together with the force of each in
parts of its root mean square; the others are predicted. The columns are scaled to one
root mean square, so that a coefficient's error is that of what its term contributes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.estimators.lssvm import TruncatedLSSVM
from papers.row import Row
from papers.xu2020_tank import full_regression, truth

Floats = NDArray[np.float64]

FITTED = (
    0,
    1,
    3,
    4,
    7,
    8,
    11,
    12,
    13,
    14,
)  # two of surge, two of sway, two of yaw, four of yaw with drift
NOISES = (
    0.005,
    0.015,
    0.05,
    0.15,
)  # standard deviation of each force, in parts of its root mean square
DRAWS = 5


class Problem(NamedTuple):
    """Scaled regressors and noise-free forces of fitted and of other tests."""

    X: Floats
    y: Floats
    others: Floats
    unseen: Floats
    coefficients: Floats  # true ones, of the scaled columns


class Errors(NamedTuple):
    """Root mean squares over the draws of the noise, relative."""

    coefficients: Floats  # by rank, shape (38,)
    forces: Floats  # of the tests not fitted, by rank, shape (38,)
    chosen: tuple[
        float, float
    ]  # of coefficients and forces at the rank of the L-curve's corner
    ranks: tuple[int, ...]  # that the L-curve chose


@cache
def problem() -> Problem:
    """The regression without noise."""
    whole = full_regression()
    scales, seen = whole.scales(), np.isin(whole.trial, FITTED)
    features, forces = whole.features / scales[:, None], whole.targets / scales
    size = np.sqrt(np.mean(features[seen] ** 2, axis=0))
    features = features / size
    return Problem(
        features[seen],
        forces[seen],
        features[~seen],
        forces[~seen],
        truth(tuple(whole.names)) * size,
    )


@cache
def decomposition() -> tuple[Floats, Floats, Floats]:
    """Singular value decomposition of the scaled regressors."""
    left, values, right = np.linalg.svd(problem().X, full_matrices=False)
    return left, values, right


@cache
def errors(noise: float) -> Errors:
    """Errors by rank, and at the rank that the L-curve chooses."""
    case, (left, values, right) = problem(), decomposition()
    by_rank, chosen, ranks = [], [], []
    for seed in range(DRAWS):
        y = case.y + noise * np.random.default_rng(seed).standard_normal(len(case.y))
        by_rank.append(_off(np.cumsum(right.T * (left.T @ y / values), axis=1)))
        estimator = TruncatedLSSVM(fit_intercept=False).fit(case.X, y)
        chosen.append(_off(estimator.coef_[:, None]))
        ranks.append(int(estimator.rank_))
    mean, corner = (
        np.sqrt(np.mean(np.square(found), axis=0)) for found in (by_rank, chosen)
    )
    return Errors(
        mean[0], mean[1], (float(corner[0, 0]), float(corner[1, 0])), tuple(ranks)
    )


def _off(coefficients: Floats) -> tuple[Floats, Floats]:
    """Relative errors of coefficients and of predicted forces, for each column."""
    case = problem()
    wrong = np.linalg.norm(coefficients - case.coefficients[:, None], axis=0)
    missed = np.sqrt(
        np.mean((case.others @ coefficients - case.unseen[:, None]) ** 2, axis=0)
    )
    return wrong / np.linalg.norm(case.coefficients), missed


def rows() -> Iterator[Row]:
    """Full rank, which is least squares, and the rank at the corner of the L-curve."""
    condition = decomposition()[1][0] / decomposition()[1][-1]
    for noise in NOISES:
        found = errors(noise)
        ranks = (
            f"{min(found.ranks)} to {max(found.ranks)}, least error at"
            f" {found.forces.argmin() + 1}"
        )
        for k, what in enumerate(
            ("coefficients off by, relative", "forces of other tests off by, relative")
        ):
            yield Row(
                "Section 3.2",
                f"38 terms, noise of {100 * noise:g} %: {what}",
                None,
                float(found[k][-1]),
                found.chosen[k],
                "below that of all 38 directions",
                found.chosen[k] < found[k][-1],
                f"condition number {condition:.2g}; as the paper: all 38 directions, as"
                " in LS-SVM; at best truncated at the corner of the L-curve, rank"
                f" {ranks}; {DRAWS} draws",
            )
