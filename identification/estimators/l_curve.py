"""Rank of a truncated decomposition by its L-curve."""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from identification.estimators.decomposition import Decomposition
from shipgym.arrays import Floats


@dataclass(frozen=True)
class LCurve:
    """Norms of residual and solution of the solutions of rank 1, 2, ..."""

    residual_norm: Floats  # Euclidean, of the residuals, shape (n_ranks,)
    solution_norm: Floats  # of the scaled coefficients, shape (n_ranks,)


def l_curve(problem: Decomposition, filters: Floats) -> LCurve:
    """Norms for every rank above rounding."""
    distinct = problem.numerical_rank
    kept = slice(distinct)
    projections = problem.projections[kept]
    squares = problem.projections**2
    outside = problem.outside + float(squares[distinct:].sum())
    beyond_rank = squares[kept].sum() - np.cumsum(squares[kept])
    shrinkage = 1.0 - problem.singular_values[kept] * filters[kept]
    within_rank = np.cumsum((projections * shrinkage) ** 2)
    residual = beyond_rank + within_rank + max(outside, 0.0)
    solution = np.cumsum((filters[kept] * projections) ** 2)
    return LCurve(
        residual_norm=np.sqrt(np.maximum(residual, 0.0)),
        solution_norm=np.sqrt(solution),
    )


def corner_rank(curve: LCurve, n_samples: int) -> int:
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
    """
    residual = curve.residual_norm
    machine = np.finfo(float)
    floor = max(machine.eps * float(residual[0]), machine.tiny)
    along = np.log(np.maximum(residual, floor))
    upward = np.log(np.maximum(curve.solution_norm, machine.tiny))
    corner = int(np.argmin(along + upward)) + 1

    full = len(residual)
    freedom = n_samples - full
    if freedom < 1:
        return corner

    # once: as array and as number a square may differ in the last bit
    squared = residual * residual
    least = max(squared[-1], floor**2)
    allowed = _allowed_growth(full, freedom)
    is_adequate = squared <= allowed * least
    passed_over = np.argmax(is_adequate[corner - 1 :])
    return corner + int(passed_over)


def _allowed_growth(full: int, freedom: int) -> Floats:
    """Growth of the squared residuals that chance explains, of each rank (F test)."""
    significance = 0.1
    dropped = np.arange(full)[::-1]
    quantile = fdtri(
        np.maximum(dropped, 1),
        freedom,
        1.0 - significance,
    )
    return np.asarray(1.0 + dropped / freedom * quantile)
