"""How many singular directions to keep: the L-curve and generalised cross-validation."""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from shipgym.arrays import Floats


@dataclass(frozen=True)
class LCurve:
    """Norms of residual and solution of the solutions of rank 1, 2, ..."""

    residual_norm: Floats  # Euclidean, of the residuals, shape (n_ranks,)
    solution_norm: Floats  # of the scaled coefficients, shape (n_ranks,)


def l_curve(
    singular_values: Floats, projections: Floats, filters: Floats, outside: float
) -> LCurve:
    """Norms for every rank from the directions of a `Decomposition`, shape (n_ranks,)."""
    whole = projections**2
    beyond_rank = whole.sum() - np.cumsum(whole)
    shrinkage = 1.0 - singular_values * filters
    within_rank = np.cumsum((projections * shrinkage) ** 2)

    residual = beyond_rank + within_rank + max(outside, 0.0)
    solution = np.cumsum((filters * projections) ** 2)
    return LCurve(np.sqrt(np.maximum(residual, 0.0)), np.sqrt(solution))


def corner_rank(curve: LCurve, n_samples: int, significance: float = 0.1) -> int:
    """Rank, from 1 to n_ranks, at the corner of the L-curve (Xu 2020, section 3.2).

    The corner is the point farthest towards the origin of the doubly logarithmic curve,
    where a line of slope -1 touches it (Reginska 1996, SIAM J. Sci. Comput. 17(3)).
    Unlike the point of largest curvature this one is well defined on the few points of
    a truncated decomposition, and can be an end: data without noise keep every
    direction. A corner whose residuals are larger than those of full rank by more than
    chance (F test) is passed over for the first rank where they are not: what the data
    do determine is not dropped.

    Parameters
    ----------
    curve : LCurve
        Of all ranks.
    n_samples : int
        Number of samples fitted.
    significance : float
        Level of the F test.
    """
    residual, solution = curve.residual_norm, curve.solution_norm
    full = len(residual)
    tiny = np.finfo(float).tiny
    floor = max(np.finfo(float).eps * float(residual[0]), tiny)
    height = np.log(np.maximum(residual, floor)) + np.log(np.maximum(solution, tiny))
    corner = int(np.argmin(height)) + 1

    freedom = n_samples - full
    if freedom < 1:
        return corner

    dropped = np.arange(full - 1, -1, -1)
    quantile = fdtri(np.maximum(dropped, 1), freedom, 1.0 - significance)
    allowed = 1.0 + dropped / freedom * quantile
    # once: as array and as number a square may differ in the last bit
    squared = residual * residual
    adequate = squared <= allowed * max(squared[-1], floor**2)
    return int(np.flatnonzero(adequate[corner - 1 :])[0]) + corner


def gcv_rank(curve: LCurve, n_samples: int) -> int:
    """Rank that minimises generalised cross-validation (Golub, Heath & Wahba 1979)."""
    ranks = np.arange(1, len(curve.residual_norm) + 1)
    freedom = n_samples - ranks
    score = curve.residual_norm**2 / np.maximum(freedom, 1) ** 2
    score[freedom <= 0] = np.inf
    return int(np.argmin(score)) + 1


def variance_rank(singular_values: Floats, share: float) -> int:
    """Least rank that holds a share, 0 to 1, of the variance of the features."""
    held = np.cumsum(singular_values**2)
    # the last sum is compared with itself, so that a share of 1 keeps all
    needed = int(np.searchsorted(held, share * held[-1])) + 1
    return min(needed, len(held))
