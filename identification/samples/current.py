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
from scipy.optimize import least_squares

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
        """Mean velocities over windows, without current: north, east and ahead.

        Shape (n_windows, 3, n_lanes, n_trials). The first lane has the unknowns as
        given, then follow lanes in which each of the coefficients, and u and v at the
        start, are moved by `DIFFERENCE`.
        """
        c = _coefficients_by_lane(x[:N_COEFFICIENTS])
        u, v = self._starts_by_lane(x, n_lanes=c.shape[1])
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

        ahead = np.array(surge)
        aside = np.array(sway)
        heading = self.runs.psi[:, None]
        north, east = rotate_to_body(ahead, aside, -heading)
        velocities = np.stack([north, east, ahead], axis=1)
        return window_means(velocities)

    def _starts_by_lane(self, x: Floats, n_lanes: int) -> tuple[Floats, Floats]:
        """Starting u and v, shape (n_lanes, n_trials), each moved in its own lane."""
        at_start = SurgeSwayInputs(*self.runs.inputs[0])
        u, v = x[self.start_columns].T
        u = u + at_start.n
        u = np.tile(u, (n_lanes, 1))
        v = np.tile(v, (n_lanes, 1))
        u[-2] += DIFFERENCE
        v[-1] += DIFFERENCE
        return u, v

    def errors(self, x: Floats) -> tuple[Floats, Floats]:
        """Measured less simulated velocities, and slopes of the latter by the unknowns.

        Shapes (n_windows, 3, n_trials) and (n_windows, 3, n_trials, n_unknowns): north,
        east, and ahead through the water; 0 where nothing was measured.
        """
        simulated = self.simulated(x)
        lanes = np.moveaxis(simulated, 2, -1)
        predicted = lanes[..., 0].copy()
        predicted[:, :2] += x[self.current_columns].T
        errors = self.runs.seen - predicted
        slopes = self._slopes(lanes)

        is_missing = np.isnan(self.runs.seen)
        errors[is_missing] = 0.0
        slopes[is_missing] = 0.0
        return errors, slopes

    def _slopes(self, lanes: Floats) -> Floats:
        """Slopes of velocities by the unknowns, from simulated lanes as last axis."""
        as_given = lanes[..., :1]
        moved = lanes[..., 1:]
        by_unknown = (moved - as_given) / DIFFERENCE
        by_coefficient = by_unknown[..., :N_COEFFICIENTS]
        by_start = by_unknown[..., N_COEFFICIENTS:]

        *shape, _ = lanes.shape
        n_unknowns = len(self.weights)
        slopes = np.zeros((*shape, n_unknowns))
        slopes[..., :N_COEFFICIENTS] = by_coefficient
        for k in range(self.runs.n_trials):
            own_start = self.start_columns[k]
            slopes[:, :, k, own_start] = by_start[:, :, k]
            north, east = self.current_columns[k]
            slopes[:, 0, k, north] = 1.0
            slopes[:, 1, k, east] = 1.0
        return slopes

    def fitted(self) -> _Fit:
        """Fit by Levenberg & Marquardt; each round renews the residuals' scale."""
        x, scale = np.zeros(len(self.weights)), 0.1
        for _ in range(3):

            def residuals(x: Floats, scale: float = scale) -> Floats:
                errors, _ = self.errors(x)
                return np.append(errors.ravel() / scale, self.weights * x)

            def jacobian(x: Floats, scale: float = scale) -> Floats:
                _, slopes = self.errors(x)
                of_data = -slopes.reshape(-1, len(x)) / scale
                return np.vstack([of_data, np.diag(self.weights)])

            x = least_squares(
                residuals, x, jacobian, ftol=1e-3, xtol=1e-6, max_nfev=10
            ).x
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


def _coefficients_by_lane(deviations: Floats) -> Floats:
    """Coefficients of the lanes of `_Problem.simulated`, shape (18, n_lanes, 1).

    From deviations of the prior, shape (18,).
    """
    n_lanes = 1 + N_COEFFICIENTS + 2  # those given; each one moved; two starts moved
    values = np.tile(MEAN + deviations * DEVIATION, (n_lanes, 1))
    values[1:-2] += DIFFERENCE * np.diag(DEVIATION)
    return values.T[:, :, None]


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
