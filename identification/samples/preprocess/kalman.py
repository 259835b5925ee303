"""Kalman filter and smoother of a linear system."""

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats


@dataclass(frozen=True, eq=False)
class Filtered:
    """States of a linear system at each sample, by the measurements up to it.

    Attributes
    ----------
    predicted, states : array of shape (n_samples, n_states)
        Before and after the measurements of the sample are taken in.
    predicted_covariances, covariances : array of shape (n_samples, n_states, n_states)
        Their covariances.
    log_likelihood : float
        Of the measurements, but for a constant.
    """

    predicted: Floats
    predicted_covariances: Floats
    states: Floats
    covariances: Floats
    log_likelihood: float


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x_k+1 = F_k x_k + w_k, of which y_k = H x_k + e_k is measured.

    Attributes
    ----------
    transitions : array of shape (n_samples - 1, n_states, n_states)
        F.
    process : array of shape (n_samples - 1, n_states, n_states)
        Covariance of w.
    observation : array of shape (n_channels, n_states)
        H.
    variances : array of shape (n_channels,)
        Of e, whose components are independent.
    start, start_variances : array of shape (n_states,)
        Expected first state, and its variances.
    """

    transitions: Floats
    process: Floats
    observation: Floats
    variances: Floats
    start: Floats
    start_variances: Floats

    def filtered(self, measured: Floats) -> Filtered:
        """Kalman filter over measurements, shape (n_samples, n_channels).

        Those that are not finite are missing. Measurements are taken in one at a time,
        in Joseph's form, so that nothing is inverted.
        """
        n_samples = len(measured)
        n_states = len(self.start)
        predicted = np.empty((n_samples, n_states))
        predicted_covariances = np.empty((n_samples, n_states, n_states))
        states = np.empty_like(predicted)
        covariances = np.empty_like(predicted_covariances)

        x = self.start
        P = np.diag(self.start_variances)
        log_likelihood = 0.0
        for k in range(n_samples):
            if k > 0:
                x, P = self._moved(x, P, k - 1)
            predicted[k] = x
            predicted_covariances[k] = P

            channels = zip(self.observation, self.variances, measured[k], strict=True)
            for h, variance, y in channels:
                if np.isfinite(y):
                    x, P, log_density = _updated(x, P, h, variance, y)
                    log_likelihood += log_density
            states[k] = x
            covariances[k] = P
        return Filtered(
            predicted=predicted,
            predicted_covariances=predicted_covariances,
            states=states,
            covariances=covariances,
            log_likelihood=log_likelihood,
        )

    def _moved(self, x: Floats, P: Floats, k: int) -> tuple[Floats, Floats]:
        """State and covariance of sample k at the next one, before it is measured."""
        F = self.transitions[k]
        return F @ x, F @ P @ F.T + self.process[k]

    def smoothed(self, measured: Floats) -> Floats:
        """States by all measurements, shape (n_samples, n_states).

        Source: Rauch, Tung & Striebel 1965, AIAA Journal 3(8).
        """
        found = self.filtered(measured)
        states = found.states.copy()
        last = len(measured) - 1
        for k in reversed(range(last)):
            following = k + 1
            moved = self.transitions[k] @ found.covariances[k]
            predicted_covariance = found.predicted_covariances[following]
            gain = np.linalg.solve(predicted_covariance, moved).T
            surprise = states[following] - found.predicted[following]
            states[k] += gain @ surprise
        return states


def _updated(
    x: Floats,
    P: Floats,
    h: Floats,
    variance: float,
    y: float,
) -> tuple[Floats, Floats, float]:
    """State, its covariance and the log density of a measurement y = h x + e."""
    Ph = P @ h
    innovation = y - float(h @ x)
    innovation_variance = float(h @ Ph) + variance
    gain = Ph / innovation_variance
    x = x + gain * innovation

    # Joseph's form keeps the matrix symmetric and positive
    left = np.eye(len(x)) - np.outer(gain, h)
    of_noise = variance * np.outer(gain, gain)
    P = left @ P @ left.T + of_noise
    misfit = innovation * innovation / innovation_variance
    log_density = -0.5 * (np.log(innovation_variance) + misfit)
    return x, P, float(log_density)
