"""Kalman filter and Rauch-Tung-Striebel smoother for small linear models that vary in time."""

from __future__ import annotations

import numpy as np

from shipgym.arrays import Floats


def smooth_linear(
    transitions: Floats,
    process: Floats,
    observation: Floats,
    variances: Floats,
    measured: Floats,
    start: Floats,
    start_variances: Floats,
    only_likelihood: bool = False,
) -> tuple[Floats, float]:
    """Smooth x_k+1 = F_k x_k + w_k, y_k = H x_k + e_k (Rauch, Tung & Striebel 1965, AIAA Journal 3(8)).

    Measurements are taken in one at a time, in Joseph's form, so that nothing is inverted. `transitions`,
    `process`: F and the covariance of w from each sample to the next, shape (n_samples - 1, n_states,
    n_states); `observation`: H, shape (n_channels, n_states); `variances`: of e, above 0, shape
    (n_channels,); `measured`: y; a value that is not finite is a missing one, shape (n_samples, n_channels);
    `start`, `start_variances`: of the state at the first sample, shape (n_states,); `only_likelihood`:
    whether to filter only; the states are then the filtered ones. Returns the states, shape (n_samples,
    n_states), and the logarithm of the measurements' likelihood but for a constant.
    """
    n, size = len(measured), len(start)
    ahead, filtered = np.empty((2, n, size)), np.empty((2, n, size, size))
    x, p, likelihood, identity = start.copy(), np.diag(start_variances), 0.0, np.eye(size)
    for k in range(n):
        if k:
            x = transitions[k - 1] @ x
            p = transitions[k - 1] @ p @ transitions[k - 1].T + process[k - 1]
        ahead[0, k], filtered[0, k] = x, p
        for h, variance, y in zip(observation, variances, measured[k], strict=True):
            if not np.isfinite(y):
                continue
            ph = p @ h
            innovation_variance = float(h @ ph) + variance
            error = y - float(h @ x)
            gain = ph / innovation_variance
            x = x + gain * error
            left = identity - np.outer(gain, h)
            p = left @ p @ left.T + variance * np.outer(gain, gain)
            likelihood -= 0.5 * (np.log(innovation_variance) + error * error / innovation_variance)
        ahead[1, k], filtered[1, k] = x, p
    states = ahead[1]
    if not only_likelihood:
        for k in range(n - 2, -1, -1):
            gain = np.linalg.solve(filtered[0, k + 1], transitions[k] @ filtered[1, k]).T
            states[k] += gain @ (states[k + 1] - ahead[0, k + 1])
    return states, likelihood
