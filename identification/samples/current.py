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
    Coefficients,
    SurgeSwayInputs,
    accelerations,
)
from shipgym import Trial
from shipgym.arrays import Floats, Integers
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
    """Covariance of the unknowns, with that by each part of each trial left out."""
    information = problem.information(fit.slopes)
    changes = []
    for k, seen in enumerate(problem.runs.seen.T):
        is_measured = np.isfinite(seen[0])
        windows = np.flatnonzero(is_measured)
        for part in np.array_split(windows, n_parts):
            change = _change_without(
                part,
                trial=k,
                fit=fit,
                information=information,
            )
            changes.append(change)

    n_changes = len(changes)
    inflation = (n_changes - 1) ** 2 / n_changes
    scatter = np.cov(np.transpose(changes))
    of_noise = np.linalg.inv(information)
    return np.asarray(scatter * inflation + of_noise)


def _change_without(
    windows: Integers,
    trial: int,
    fit: "_Fit",
    information: Floats,
) -> Floats:
    """One step of Gauss & Newton to the estimate without some windows of a trial."""
    n_unknowns = len(fit.x)
    slopes = fit.slopes[windows, :, trial].reshape(-1, n_unknowns)
    residuals = fit.residuals[windows, :, trial].ravel()
    score = slopes.T @ residuals
    information_left = information - slopes.T @ slopes
    return np.asarray(np.linalg.solve(information_left, score))


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
        u, v = self._starts_by_lane(x, n_lanes=len(c.X_0))
        surge, sway = [u], [v]
        for now, then in pairwise(self.runs.inputs):
            u, v = _midpoint_step(u, v, now, then, c)
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

    def fitted(self, most_rounds: int = 20, enough: float = 1e-3) -> _Fit:
        """Fit by Levenberg & Marquardt; each round renews the residuals' scale."""
        x = np.zeros(len(self.weights))
        damping = 1e-2
        scale = 0.1
        errors, slopes = self.errors(x)
        for _ in range(most_rounds):
            residuals = errors / scale
            before = self._cost(x, residuals)
            moved = x + self._step(
                x,
                residuals=residuals,
                slopes=slopes / scale,
                damping=damping,
            )
            new_errors, new_slopes = self.errors(moved)
            after = self._cost(moved, new_errors / scale)
            if after < before:
                x = moved
                errors = new_errors
                slopes = new_slopes
                damping = max(0.1 * damping, 1e-9)
                scale = self._scale(errors)
            else:
                damping *= 10.0
            if abs(before - after) < enough * before:
                break
        return _Fit(
            x=x,
            slopes=slopes / scale,
            residuals=errors / scale,
        )

    def _scale(self, errors: Floats) -> float:
        """Standard deviation of the errors, at least that of the sensors' rounding."""
        is_measured = np.isfinite(self.runs.seen)
        n_measured = int(is_measured.sum())
        freedom = max(n_measured - len(self.weights), 1)
        variance = np.sum(errors**2) / freedom
        rounding = 0.003
        return max(float(np.sqrt(variance)), rounding)

    def _step(
        self,
        x: Floats,
        residuals: Floats,
        slopes: Floats,
        damping: float,
    ) -> Floats:
        """Damped step of Gauss & Newton from x."""
        J = slopes.reshape(-1, len(x))
        from_prior = self.weights**2 * x
        downhill = J.T @ residuals.ravel() - from_prior
        hessian = self.information(slopes)
        diagonal = np.diag(np.diag(hessian))
        damped = hessian + damping * diagonal
        return np.asarray(np.linalg.solve(damped, downhill))

    def information(self, slopes: Floats) -> Floats:
        """Inverse covariance of the unknowns by the slopes and the prior."""
        J = slopes.reshape(-1, len(self.weights))
        of_prior = np.diag(self.weights**2)
        return J.T @ J + of_prior

    def _cost(self, x: Floats, residuals: Floats) -> float:
        from_prior = self.weights * x
        misfit = np.sum(residuals**2)
        return float(misfit + np.sum(from_prior**2))


def _coefficients_by_lane(deviations: Floats) -> Coefficients:
    """Coefficients of the lanes of `_Problem.simulated`, each of shape (n_lanes, 1).

    From deviations of the prior, shape (18,).
    """
    n_lanes = 1 + N_COEFFICIENTS + 2  # those given; each one moved; two starts moved
    mean = MEAN + deviations * DEVIATION
    values = np.tile(mean, (n_lanes, 1))
    moved = np.arange(N_COEFFICIENTS)
    own_lane = 1 + moved
    values[own_lane, moved] += DIFFERENCE * DEVIATION

    by_coefficient = values.T
    return Coefficients(*by_coefficient[:, :, None])


def _midpoint_step(
    u: Floats,
    v: Floats,
    now: Floats,
    then: Floats,
    c: Coefficients,
) -> tuple[Floats, Floats]:
    """One step of the midpoint rule, kept within what a ship does."""
    surge, sway = accelerations(u, v, SurgeSwayInputs(*now), c)
    u_half = u + 0.5 * STEP * surge
    v_half = v + 0.5 * STEP * sway

    mean = 0.5 * (now + then)
    surge, sway = accelerations(u_half, v_half, SurgeSwayInputs(*mean), c)
    u = u + STEP * surge
    v = v + STEP * sway
    return np.clip(u, -2.0, 3.0), np.clip(v, -2.0, 2.0)
