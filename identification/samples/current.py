"""A steady current, estimated from trials whose velocities are over ground.

Ground velocity is R(psi) (u, v) + (V_N, V_E). How surge and sway follow from measured
yaw rate, rudder and shaft speed is simulated by quadratic equations of any ship, whose
coefficients (`surge_sway`) have a wide prior and are fitted with the current, in which
ground velocity is linear (Maine & Iliff 1985, NASA RP-1138, output error with prior).
So the current does not depend on the structure to be identified. Its covariance is that
of estimates with each trial, or each third of one, left out (jackknife): it holds what
the equations miss.

All quantities of the simulation are in units of the ship's length and service speed.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from identification.least_squares import Linearised, fit_least_squares
from identification.samples.runs_on_grid import (
    STEP,
    Runs,
    trials_on_one_grid,
    window_means,
)
from identification.samples.surge_sway import (
    DEVIATION,
    MEAN,
    N_COEFFICIENTS,
    SurgeSwayInputs,
    accelerations,
)
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.trials.navigation import rotate_to_body

DIFFERENCE = 1e-4  # of finite differences


class CurrentEstimate(NamedTuple):
    """Currents of some trials, each north and east, and their covariance."""

    mean: Floats  # m/s, shape (2 n_trials,); the same pair repeated where shared
    covariance: Floats  # (m/s)^2, shape (2 n_trials, 2 n_trials)


def estimate_current(
    trials: Sequence[Trial],
    length: float,
    speed: float,
    shared: bool,
) -> CurrentEstimate:
    """Estimate the current of each trial, or of all, from velocities over ground.

    n, accelerations by wind and a speed u through the water are used where they are
    there.

    Parameters
    ----------
    trials : sequence of Trial
        With psi, r, delta, u and v.
    length, speed : float
        Of the ship, m and m/s.
    shared : bool
        Whether the trials have one current.
    """
    runs = trials_on_one_grid(trials, length, speed)
    problem = _Problem(runs, shared)
    fit = problem.fitted()
    n_parts = 1 if shared and len(trials) > 2 else 3
    covariance = _covariance(problem, fit, n_parts)

    columns = problem.current_columns.ravel()
    return CurrentEstimate(
        mean=speed * fit.x[columns],
        covariance=speed**2 * covariance[np.ix_(columns, columns)],
    )


def _covariance(problem: "_Problem", fit: "_Fit", n_parts: int) -> Floats:
    """Covariance of the unknowns, with that by each part of each trial left out.

    Without it the estimate changes by one step of Gauss & Newton.
    """
    information = problem.information(fit.slopes)
    changes = []
    for trial, seen in enumerate(problem.runs.seen.T):
        windows = np.flatnonzero(np.isfinite(seen[0]))
        for part in np.array_split(windows, n_parts):
            residuals = fit.residuals[part, :, trial].ravel()
            slopes = fit.slopes[part, :, trial].reshape(len(residuals), -1)
            left = information - slopes.T @ slopes
            change = np.linalg.solve(left, slopes.T @ residuals)
            changes.append(change)
    n_changes = len(changes)
    inflation = (n_changes - 1) ** 2 / n_changes
    scatter = np.cov(np.transpose(changes))
    return np.asarray(scatter * inflation + np.linalg.inv(information))


class _Fit(NamedTuple):
    """The most probable unknowns, and slopes and residuals there.

    Both are divided by the standard deviation of the residuals.
    """

    x: Floats
    slopes: Floats  # shape (n_windows, 3, n_trials, n_unknowns)
    residuals: Floats  # shape (n_windows, 3, n_trials)


class _Problem:
    """Least-squares problem of the motions of ships of given coefficients in trials.

    Unknowns are the coefficients, in deviations of the prior, then u and v at the start
    of each trial, then the current of each trial or of all.
    """

    def __init__(self, runs: Runs, shared: bool) -> None:
        self.runs = runs
        n_trials = runs.n_trials
        n_currents = 1 if shared else n_trials
        pairs = np.arange(2 * n_trials).reshape(-1, 2)
        self.start_columns = N_COEFFICIENTS + pairs
        self.current_columns = self.start_columns + pairs.size
        if shared:
            first = self.current_columns[0]
            self.current_columns = np.tile(first, (n_trials, 1))

        of_coefficients = np.ones(N_COEFFICIENTS)
        of_starts = np.tile([0.3, 0.15], n_trials)  # u and v
        of_currents = np.full(2 * n_currents, 0.5)
        deviations = np.concatenate([of_coefficients, of_starts, of_currents])
        self.weights = 1.0 / deviations

    def simulated(self, x: Floats) -> Floats:
        """Mean velocities over windows: over ground north and east, and ahead.

        Shape (n_windows, 3, n_rows, n_trials), of unknowns of shape (n_rows,
        n_unknowns).
        """
        ahead, aside = self._sailed(x)
        heading = self.runs.psi[:, None]
        north, east = rotate_to_body(ahead, aside, -heading)
        means = window_means(np.stack([north, east, ahead], axis=1))
        means[:, :2] += np.moveaxis(x[:, self.current_columns], -1, 0)
        return means

    def _sailed(self, x: Floats) -> tuple[Floats, Floats]:
        """Surge and sway through the water, shape (n_times, n_rows, n_trials)."""
        deviations = x[:, :N_COEFFICIENTS]
        c = (MEAN + deviations * DEVIATION).T[:, :, None]
        u, v = np.moveaxis(x[:, self.start_columns], -1, 0)
        u = u + SurgeSwayInputs(*self.runs.inputs[0]).n
        surge, sway = [u], [v]
        for now, then in pairwise(self.runs.inputs):
            u, v = _midpoint_step(
                u,
                v,
                now,
                then,
                c,
            )
            surge.append(u)
            sway.append(v)
        return np.array(surge), np.array(sway)

    def errors(self, x: Floats) -> tuple[Floats, Floats]:
        """Measured less simulated velocities, and slopes of the latter by the unknowns.

        Shapes (n_windows, 3, n_trials) and (n_windows, 3, n_trials, n_unknowns); 0
        where nothing was measured.
        """
        rows = np.vstack([x, x + DIFFERENCE * np.eye(len(x))])
        means = np.moveaxis(self.simulated(rows), 2, -1)
        as_given, moved = means[..., :1], means[..., 1:]
        errors = self.runs.seen - as_given[..., 0]
        slopes = (moved - as_given) / DIFFERENCE
        is_missing = np.isnan(self.runs.seen)
        errors[is_missing] = 0.0
        slopes[is_missing] = 0.0
        return errors, slopes

    def fitted(self) -> _Fit:
        """Fit by Levenberg & Marquardt; each round renews the residuals' scale."""
        x, scale = np.zeros(len(self.weights)), 0.1
        for _ in range(3):

            def linearised(x: Floats, scale: float = scale) -> Linearised:
                errors, slopes = self.errors(x)
                of_data = -slopes.reshape(-1, len(x)) / scale
                return Linearised(
                    np.append(errors.ravel() / scale, self.weights * x),
                    np.vstack([of_data, np.diag(self.weights)]),
                )

            x = fit_least_squares(linearised, x, ftol=1e-3, xtol=1e-6, max_nfev=10).x
            errors, slopes = self.errors(x)
            scale = self._scale(errors)
        return _Fit(x, slopes / scale, errors / scale)

    def _scale(self, errors: Floats) -> float:
        """Standard deviation of the errors, at least that of the sensors' rounding."""
        n_measured = int(np.isfinite(self.runs.seen).sum())
        freedom = max(n_measured - len(self.weights), 1)
        return max(float(np.sqrt(np.sum(errors**2) / freedom)), 0.003)

    def information(self, slopes: Floats) -> Floats:
        """Inverse covariance of the unknowns by the slopes and the prior."""
        J = slopes.reshape(-1, len(self.weights))
        of_prior = np.diag(self.weights**2)
        return J.T @ J + of_prior


def _midpoint_step(
    u: Floats,
    v: Floats,
    now: Floats,
    then: Floats,
    c: Floats,
) -> tuple[Floats, Floats]:
    """One step of the midpoint rule, kept within what a ship does."""
    at_start = SurgeSwayInputs(*now)
    surge, sway = accelerations(u, v, at_start, c)
    half = SurgeSwayInputs(*(0.5 * (now + then)))
    u_half = u + 0.5 * STEP * surge
    v_half = v + 0.5 * STEP * sway
    surge, sway = accelerations(u_half, v_half, half, c)
    u = u + STEP * surge
    v = v + STEP * sway
    return np.clip(u, -2.0, 3.0), np.clip(v, -2.0, 2.0)
