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
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from identification.least_squares import Linearised, fit_least_squares
from shipgym import Trial
from shipgym.arrays import Floats, integral
from shipgym.models.simulate import wind_accelerations
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import rotate_to_body

#: Probability of a current as large by chance below which it differs from zero.
SIGNIFICANT = 0.01
CURRENT_COLUMNS = ("current_north", "current_east")


def over_ground(trial: Trial) -> tuple[Floats, Floats]:
    """Velocity of midship over ground, ahead and to starboard, m/s.

    The trial has velocities over ground, or one of them derived from its track.
    """
    derived = {"u", "v"} & trial.derived
    if len(derived) != 1:
        return trial["u"], trial["v"]

    # the other one was logged, and is through the water
    north = time_derivative(trial.t, trial["x"])
    east = time_derivative(trial.t, trial["y"])
    return rotate_to_body(north, east, trial["psi"])


def through_water(trial: Trial, north: Any, east: Any) -> Trial:
    """The trial without a current, m/s, each a number or of shape (n_samples,).

    Its track starts where it did; velocities over ground, but for one logged, become
    those through the water.
    """
    t = trial.t
    north = np.full(len(t), north, dtype=float)
    east = np.full(len(t), east, dtype=float)
    channels = {"current_north": north, "current_east": east}
    if "x" in trial:
        channels["x"] = trial["x"] - integral(t, north)
    if "y" in trial:
        channels["y"] = trial["y"] - integral(t, east)

    if trial.over_ground and trial.channels.keys() >= {"u", "v", "psi"}:
        ahead, aside = over_ground(trial)
        drift_ahead, drift_aside = rotate_to_body(north, east, trial["psi"])
        derived = trial.derived & {"u", "v"}
        over = derived or {"u", "v"}  # one derived alone: the other was logged
        if "u" in over:
            channels["u"] = ahead - drift_ahead
        if "v" in over:
            channels["v"] = aside - drift_aside
    still = trial.with_channels(channels)
    return still.with_(over_ground=False)


#: Mean and standard deviation of the coefficients before any trial, in the order of the
#: terms of `accelerations`: those of surge, those of sway, and that of the wind.
PRIOR = (
    (0.0, 0.02),
    (-0.10, 0.2),
    (-0.05, 0.2),
    (0.9, 0.6),
    (-0.5, 1.5),
    (0.0, 0.3),
    (-0.03, 0.15),
    (-0.03, 0.15),
    (0.0, 0.02),
    (-0.9, 0.6),
    (-3.0, 4.0),
    (-0.35, 0.25),
    (0.0, 0.5),
    (-0.5, 1.5),
    (0.0, 1.5),
    (-0.06, 0.1),
    (-0.04, 0.1),
    (1.0, 0.25),
)
MEAN, DEVIATION = np.array(PRIOR).T
N_COEFFICIENTS = len(PRIOR)


def accelerations(u: Any, v: Any, at: Floats, coefficients: Floats) -> tuple[Any, Any]:
    """Surge and sway acceleration by quadratic equations of any ship.

    `at`: what moves her, as of `Runs.inputs`.
    """
    r, delta, n, ahead, aside = at
    terms = (
        1.0,
        u - n,
        u**2 - n**2,
        v * r,
        v**2,
        r**2,
        delta**2,
        u**2 * delta**2,
        1.0,
        u * v,
        v * abs(v),
        u * r,
        r * abs(r),
        v * abs(r),
        r * abs(v),
        u**2 * delta,
        delta,
    )
    *others, wind = coefficients
    parts = [c * term for c, term in zip(others, terms, strict=True)]
    of_surge = 8
    surge = sum(parts[:of_surge]) + wind * ahead
    return surge, sum(parts[of_surge:]) + wind * aside


STEP = 0.2  # of the grid, in the time to sail one ship length
STEPS = 5  # in a window, over which velocities are averaged


@dataclass(frozen=True, eq=False)
class Runs:
    """Trials on one grid of time; a shorter one stays at its last sample.

    In units of the ship's length and service speed.
    """

    #: yaw rate, rudder, shaft speed by that at the start, and accelerations by wind
    #: ahead and aside, shape (n_times, 5, n_trials)
    inputs: Floats
    psi: Floats  # shape (n_times, n_trials)
    #: velocities north and east over ground, and ahead through the water; means over
    #: windows of time, NaN where not measured, shape (n_windows, 3, n_trials)
    seen: Floats

    @property
    def n_trials(self) -> int:
        """Number of trials."""
        return len(self.psi[0])


def trials_on_one_grid(trials: Sequence[Trial], length: float, speed: float) -> Runs:
    """The trials on one grid, in units of length and service speed."""
    travel_time = length / speed
    times = [(trial.t - trial.t[0]) / travel_time for trial in trials]
    longest = max(t[-1] for t in times)
    window = STEP * STEPS
    n_steps = int(longest / window) * STEPS
    grid: Floats = np.arange(n_steps + 1, dtype=np.float64) * STEP
    shaft_speed = _starting_shaft_speed(trials)

    inputs, headings, seen = [], [], []
    for trial, t in zip(trials, times, strict=True):
        moved_by = _inputs(
            trial,
            travel_time,
            speed,
            shaft_speed,
        )
        inputs.append(_on_grid(grid, t, moved_by))
        headings.append(np.interp(grid, t, trial["psi"]))
        velocities = _on_grid(grid, t, _seen(trial, speed))
        velocities[grid > t[-1]] = np.nan
        seen.append(velocities)
    return Runs(
        inputs=np.stack(inputs, axis=-1),
        psi=np.stack(headings, axis=-1),
        seen=window_means(np.stack(seen, axis=-1)),
    )


def _inputs(
    trial: Trial, travel_time: float, speed: float, shaft_speed: float | None
) -> Sequence[Floats]:
    """What moves the ship, arrays of shape (n_samples,)."""
    wind = wind_accelerations(trial) * travel_time / speed
    shaft = np.ones(len(trial))
    if shaft_speed is not None:
        shaft = trial["n"] / shaft_speed
    return trial["r"] * travel_time, trial["delta"], shaft, *wind.T[:2]


def _seen(trial: Trial, speed: float) -> tuple[Floats, Floats, Floats]:
    """Velocity north and east over ground, and ahead through the water if logged."""
    ahead, aside = over_ground(trial)
    to_earth = -trial["psi"]
    north, east = rotate_to_body(
        ahead,
        aside,
        to_earth,
    )
    logged = np.full(len(trial), np.nan)
    if "v" in trial.derived and "u" not in trial.derived:
        logged = trial["u"]
    return north / speed, east / speed, logged / speed


def _on_grid(grid: Floats, t: Floats, rows: Sequence[Floats]) -> Floats:
    """Rows of samples at the times of the grid, shape (n_times, n_rows)."""
    columns = [np.interp(grid, t, row) for row in rows]
    return np.column_stack(columns)


def _starting_shaft_speed(trials: Sequence[Trial]) -> float | None:
    """Median shaft speed at the start, 1/s; None where not all trials turn ahead."""
    if not all("n" in trial and trial["n"][0] > 0.0 for trial in trials):
        return None
    return float(np.median([trial["n"][0] for trial in trials]))


def window_means(values: Floats) -> Floats:
    """Means over the windows of the grid, whose times are the first axis."""
    windows = values[:-1].reshape(-1, STEPS, *values.shape[1:])
    return np.asarray(windows.mean(axis=1))


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
        u = u + self.runs.inputs[0, 2]
        surge, sway = [u], [v]
        for now, then in pairwise(self.runs.inputs):
            u, v = _midpoint_step(u, v, now, then, c)
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
    u: Floats, v: Floats, now: Floats, then: Floats, c: Floats
) -> tuple[Floats, Floats]:
    """One step of the midpoint rule, kept within what a ship does."""
    surge, sway = accelerations(u, v, now, c)
    half = 0.5 * STEP
    u_half = u + half * surge
    v_half = v + half * sway
    halfway = 0.5 * (now + then)
    surge, sway = accelerations(u_half, v_half, halfway, c)
    u = np.clip(u + STEP * surge, -2.0, 3.0)
    v = np.clip(v + STEP * sway, -2.0, 2.0)
    return u, v
