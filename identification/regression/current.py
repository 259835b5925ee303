"""A steady current, estimated from trials whose velocities are over ground.

Ground velocity is R(psi) (u, v) + (V_N, V_E). How surge and sway follow from measured
yaw rate, rudder and shaft speed is simulated by quadratic equations of any ship, whose
coefficients have a wide prior and are fitted with the current, in which ground velocity
is linear (Maine & Iliff 1985, NASA RP-1138, output error with prior). So the current
does not depend on the structure to be identified. Its covariance is that of estimates
with each trial, or each third of one, left out (jackknife): it holds what the equations
miss.

All quantities of the simulation are in units of the ship's length and service speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from identification.regression.velocities import over_ground
from shipgym import Trial
from shipgym.arrays import Floats, Integers
from shipgym.ships.simulate import wind_accelerations
from shipgym.trials.navigation import rotate_to_body

STEP = 0.2  # of the simulation, in the time to sail one ship length
STEPS = 5  # in a window, over which velocities are averaged
DIFFERENCE = 1e-4  # of finite differences


class CurrentEstimate(NamedTuple):
    """Currents of some trials, each north and east, and their covariance."""

    mean: Floats  # m/s, shape (2 n_trials,); the same pair repeated where shared
    covariance: Floats  # (m/s)^2, shape (2 n_trials, 2 n_trials)
    #: of the equations of surge and sway, in deviations of the prior, shape (18,)
    coefficients: Floats


class Coefficients(NamedTuple):
    """Coefficients of `accelerations`."""

    X_0: Any
    X_u: Any
    X_uu: Any
    X_vr: Any
    X_vv: Any
    X_rr: Any
    X_dd: Any
    X_uudd: Any
    Y_0: Any
    Y_uv: Any
    Y_vv: Any
    Y_ur: Any
    Y_rr: Any
    Y_vr: Any
    Y_rv: Any
    Y_uud: Any
    Y_d: Any
    wind: Any


#: Mean and standard deviation of the coefficients before any trial.
PRIOR = Coefficients(
    X_0=(0.0, 0.02),
    X_u=(-0.10, 0.2),
    X_uu=(-0.05, 0.2),
    X_vr=(0.9, 0.6),
    X_vv=(-0.5, 1.5),
    X_rr=(0.0, 0.3),
    X_dd=(-0.03, 0.15),
    X_uudd=(-0.03, 0.15),
    Y_0=(0.0, 0.02),
    Y_uv=(-0.9, 0.6),
    Y_vv=(-3.0, 4.0),
    Y_ur=(-0.35, 0.25),
    Y_rr=(0.0, 0.5),
    Y_vr=(-0.5, 1.5),
    Y_rv=(0.0, 1.5),
    Y_uud=(-0.06, 0.1),
    Y_d=(-0.04, 0.1),
    wind=(1.0, 0.25),
)
MEAN, DEVIATION = np.array(PRIOR).T
N_COEFFICIENTS = len(PRIOR)


class SurgeSwayInputs(NamedTuple):
    """Measured quantities that move a ship in surge and sway."""

    r: Any
    delta: Any
    n: Any  # by that at the start
    ahead: Any  # acceleration by wind
    aside: Any


def accelerations(
    u: Any, v: Any, at: SurgeSwayInputs, c: Coefficients
) -> tuple[Any, Any]:
    """Surge and sway acceleration by quadratic equations of any ship."""
    return _surge_acceleration(u, v, at, c), _sway_acceleration(u, v, at, c)


def _surge_acceleration(u: Any, v: Any, at: SurgeSwayInputs, c: Coefficients) -> Any:
    return (
        c.X_0
        + c.X_u * (u - at.n)
        + c.X_uu * (u**2 - at.n**2)
        + c.X_vr * v * at.r
        + c.X_vv * v**2
        + c.X_rr * at.r**2
        + (c.X_dd + c.X_uudd * u**2) * at.delta**2
        + c.wind * at.ahead
    )


def _sway_acceleration(u: Any, v: Any, at: SurgeSwayInputs, c: Coefficients) -> Any:
    return (
        c.Y_0
        + c.Y_uv * u * v
        + c.Y_vv * v * abs(v)
        + c.Y_ur * u * at.r
        + c.Y_rr * at.r * abs(at.r)
        + c.Y_vr * v * abs(at.r)
        + c.Y_rv * at.r * abs(v)
        + (c.Y_uud * u**2 + c.Y_d) * at.delta
        + c.wind * at.aside
    )


def estimate_current(
    trials: Sequence[Trial],
    length: float,
    speed: float,
    shared: bool,
    known: Floats | None = None,
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
    known : array of shape (18,), optional
        Coefficients of another estimate, which are then not fitted.
    """
    runs = _together(trials, length, speed)
    problem = _Problem(runs, shared, known)
    fit = problem.fitted()
    n_parts = 1 if shared and len(trials) > 2 else 3
    covariance = _covariance(problem, fit, n_parts)

    columns = problem.current_columns.ravel()
    return CurrentEstimate(
        mean=speed * fit.x[columns],
        covariance=speed**2 * covariance[np.ix_(columns, columns)],
        coefficients=fit.x[:N_COEFFICIENTS],
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


class _Record(NamedTuple):
    """A trial in units of length and service speed, arrays of shape (n_samples,)."""

    t: Floats
    inputs: SurgeSwayInputs
    psi: Floats
    #: velocity north and east over ground, and ahead through the water; NaN where not
    #: measured
    seen: tuple[Floats, Floats, Floats]

    def inputs_on(self, grid: Floats, shaft_speed: float | None) -> Floats:
        """Inputs at the times of a grid, shaft speeds by that at the start.

        Shape (n_times, 5).
        """
        shaft = np.ones(len(self.t))
        if shaft_speed is not None:
            shaft = self.inputs.n / shaft_speed
        relative = self.inputs._replace(n=shaft)
        return _on_grid(grid, self.t, relative)

    def seen_on(self, grid: Floats) -> Floats:
        """Velocities at the times of a grid; NaN after the end, shape (n_times, 3)."""
        velocities = _on_grid(grid, self.t, self.seen)
        is_after = grid > self.t[-1]
        velocities[is_after] = np.nan
        return velocities


def _record(trial: Trial, travel_time: float, speed: float) -> _Record:
    wind = wind_accelerations(trial) * travel_time / speed
    shaft = np.zeros(len(trial))
    if "n" in trial:
        shaft = trial["n"]
    psi = trial["psi"]
    ahead, aside = over_ground(trial)
    north, east = rotate_to_body(ahead, aside, -psi)
    logged = np.full(len(trial), np.nan)
    if "v" in trial.derived and "u" not in trial.derived:
        logged = trial["u"]

    inputs = SurgeSwayInputs(
        r=trial["r"] * travel_time,
        delta=trial["delta"],
        n=shaft,
        ahead=wind[:, 0],
        aside=wind[:, 1],
    )
    return _Record(
        t=(trial.t - trial.t[0]) / travel_time,
        inputs=inputs,
        psi=psi,
        seen=(north / speed, east / speed, logged / speed),
    )


@dataclass(frozen=True, eq=False)
class _Runs:
    """Trials on one grid of time; a shorter one stays at its last sample."""

    inputs: Floats  # as of `Inputs`, shape (n_times, 5, n_trials)
    psi: Floats  # shape (n_times, n_trials)
    seen: Floats  # means over windows of time, shape (n_windows, 3, n_trials)

    @property
    def n_trials(self) -> int:
        return len(self.psi[0])


def _together(trials: Sequence[Trial], length: float, speed: float) -> _Runs:
    """The trials on one grid, in units of length and service speed."""
    travel_time = length / speed
    records = [_record(trial, travel_time, speed) for trial in trials]
    shaft_speed = _starting_shaft_speed(trials)

    longest = max(record.t[-1] for record in records)
    window = STEP * STEPS
    n_steps = int(longest / window) * STEPS
    grid: Floats = np.arange(n_steps + 1, dtype=np.float64) * STEP

    inputs, headings, seen = [], [], []
    for record in records:
        inputs.append(record.inputs_on(grid, shaft_speed))
        headings.append(np.interp(grid, record.t, record.psi))
        seen.append(record.seen_on(grid))
    return _Runs(
        inputs=np.stack(inputs, axis=-1),
        psi=np.stack(headings, axis=-1),
        seen=_averaged(np.stack(seen, axis=-1)),
    )


def _on_grid(grid: Floats, t: Floats, rows: Sequence[Floats]) -> Floats:
    """Rows of samples at the times of the grid, shape (n_times, n_rows)."""
    columns = [np.interp(grid, t, row) for row in rows]
    return np.column_stack(columns)


def _starting_shaft_speed(trials: Sequence[Trial]) -> float | None:
    """Median shaft speed at the start, 1/s; None where not all trials turn ahead."""
    starts = []
    for trial in trials:
        if "n" not in trial:
            return None
        start = trial["n"][0]
        if not start > 0.0:
            return None
        starts.append(start)
    return float(np.median(starts))


def _averaged(values: Floats) -> Floats:
    """Means over the windows of the grid, whose times are the first axis."""
    windows = values[:-1].reshape(-1, STEPS, *values.shape[1:])
    return np.asarray(windows.mean(axis=1))


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

    def __init__(self, runs: _Runs, shared: bool, known: Floats | None) -> None:
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
        self.centre = np.zeros(len(deviations))
        if known is not None:
            deviations[:N_COEFFICIENTS] = 1e-4
            self.centre[:N_COEFFICIENTS] = known
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
        return _averaged(velocities)

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
        n_unknowns = len(self.centre)
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
        x = self.centre
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
        freedom = max(n_measured - len(self.centre), 1)
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
        from_prior = self.weights**2 * (x - self.centre)
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
        from_prior = self.weights * (x - self.centre)
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
