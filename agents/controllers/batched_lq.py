"""LQ gains of many sampled ships at once, as `lq_gain` designs one: for designs made while sailing.

Sources: Chu, Fan, Lin & Wang 2004, Structure-preserving algorithms for periodic discrete-time algebraic
Riccati equations, International Journal of Control 77 (doubling); Anderson & Moore 1990, Optimal Control,
chapter 3 (cross terms).
"""

from __future__ import annotations

import numpy as np

from agents.controllers.linear_loop import ERROR, INTEGRAL, RUDDER
from shipgym.arrays import Floats
from shipgym.tasks.steering import RUDDER_WEIGHT

DOUBLINGS = 40  # each doubles the horizon
ACCURACY = 1e-13


def lq_rows(
    A: Floats,
    B: Floats,
    dt: float,
    rate_weight: float,
    integral_time: float,
    rudder_weight: float = RUDDER_WEIGHT,
) -> Floats:
    """Feedback rows of order = row x that minimise the environment's cost, one a ship.

    `A`, `B`: sampled ships, shape (n, 5, 5) and (n, 5); `dt`: control interval, s; `rate_weight`,
    `integral_time`, `rudder_weight`: as in `agents.controllers.lq.lq_gain`. Returns the gains, shape (n, 5),
    NaN where no stabilising one was found.
    """
    weights = np.array([1.0, np.sqrt(rudder_weight), np.sqrt(rate_weight) / dt, 1.0 / integral_time])
    rows = [ERROR, RUDDER, RUDDER, INTEGRAL]
    C, D = A[:, rows].copy(), B[:, rows]
    C[:, 2, RUDDER] -= 1.0
    C, D, column = weights[:, None] * C, (weights * D)[:, :, None], B[:, :, None]
    Ct, Dt, row = C.transpose(0, 2, 1), D.transpose(0, 2, 1), B[:, None, :]
    R, S = Dt @ D, Dt @ C
    plain = A - column @ (S / R)  # with commands that take the cross term away
    X = riccati(plain, column @ (row / R), Ct @ C - S.transpose(0, 2, 1) @ (S / R))
    gain: Floats = (row @ X @ A + S) / (R + row @ X @ column)
    return -gain[:, 0]


def riccati(A: Floats, G: Floats, H: Floats) -> Floats:
    """Stabilising solutions X of X = A'X (I + G X)^-1 A + H, by doubling.

    `A`, `G`, `H`: G and H symmetric, not negative; all are overwritten, shape (n, m, m). Returns the
    solutions, shape (n, m, m), NaN where the doubling did not converge.
    """
    eye = np.eye(A.shape[-1])
    converged = np.zeros(len(A), dtype=np.bool_)
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(DOUBLINGS):
            going = ~converged & np.isfinite(H).all(axis=(1, 2))
            if not going.any():
                break
            a, g, h = A[going], G[going], H[going]
            left = np.linalg.solve(eye + g @ h, np.concatenate([a, g], axis=2))
            wa, wg = left[:, :, : len(eye)], left[:, :, len(eye) :]
            at = a.transpose(0, 2, 1)
            more = at @ h @ wa
            A[going], G[going], H[going] = a @ wa, g + a @ wg @ at, h + 0.5 * (more + more.transpose(0, 2, 1))
            size = np.abs(H[going]).max(axis=(1, 2))
            converged[going] = np.abs(more).max(axis=(1, 2)) <= ACCURACY * size
    H[~converged] = np.nan
    return H
