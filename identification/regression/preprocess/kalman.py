"""Kalman filter and Rauch-Tung-Striebel smoother for small linear models that vary in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A smoothed course."""

    states: Floats  # shape (n_samples, n_states)
    variances: Floats  # shape (n_samples, n_states)
    log_likelihood: float  # of the measurements, but for a constant


def smooth_linear(
    transitions: Floats,
    process: Floats,
    observation: Floats,
    variances: Floats,
    measured: Floats,
    start: Floats,
    start_variances: Floats,
    only_likelihood: bool = False,
) -> Smoothed:
    """Smooth x_k+1 = F_k x_k + w_k, y_k = H x_k + e_k (Rauch, Tung & Striebel 1965, AIAA Journal 3(8)).

    Measurements are taken in one at a time, in Joseph's form, so that nothing is inverted. `transitions`,
    `process`: F and the covariance of w from each sample to the next, shape (n_samples - 1, n_states,
    n_states); `observation`: H, shape (n_channels, n_states); `variances`: of e, above 0, shape
    (n_channels,); `measured`: y; a value that is not finite is a missing one, shape (n_samples, n_channels);
    `start`, `start_variances`: of the state at the first sample, shape (n_states,); `only_likelihood`:
    whether to filter only; the states are then the filtered ones.
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
    states, covariances = ahead[1], filtered[1]
    if not only_likelihood:
        for k in range(n - 2, -1, -1):
            gain = np.linalg.solve(filtered[0, k + 1], transitions[k] @ covariances[k]).T
            states[k] += gain @ (states[k + 1] - ahead[0, k + 1])
            covariances[k] += gain @ (covariances[k + 1] - filtered[0, k + 1]) @ gain.T
    return Smoothed(states, np.diagonal(covariances, axis1=1, axis2=2).copy(), likelihood)
