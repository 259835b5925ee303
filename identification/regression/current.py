"""A steady current, estimated from trials whose velocities are over ground.

Ground velocity is R(psi) (u, v) + (V_N, V_E). How surge and sway follow from measured
yaw rate, rudder and shaft speed is simulated by quadratic equations of any ship, whose
coefficients have a wide prior and are fitted with the current, in which ground velocity
is linear (Maine & Iliff 1985, NASA RP-1138, output error with prior). So the current
does not depend on the structure to be identified. Its covariance is that of estimates
with each trial, or each third of one, left out (jackknife): it holds what the equations
miss.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.ships.simulate import wind_accelerations
from shipgym.trials.derivatives import time_derivative
from shipgym.trials.navigation import rotate_to_body

STEP, STEPS = (
    0.2,
    5,
)  # of the simulation, ship lengths at service speed; steps in a mean
#: Mean and standard deviation of the coefficients of `_accelerations` before any trial,
#: in units of L and U0.
PRIOR = np.array(
    [
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
    ]
).T
COEFFICIENTS = PRIOR.shape[1]
START, CURRENT = (
    (0.3, 0.15),
    0.5,
)  # standard deviations of u and v at the start, and of the current, by U0
KNOWN = 1e-4  # the same of coefficients that are known, by those of the prior
ROUNDS, ENOUGH, DIFFERENCE = (
    20,
    1e-3,
    1e-4,
)  # of Levenberg-Marquardt; its end; of finite differences
SMALLEST = 0.003  # standard deviation of a residual, by U0


class CurrentEstimate(NamedTuple):
    """The currents of some trials, north and east after each other, and how certain they are."""

    mean: Floats  # m/s, shape (2 n_trials,); alike where shared
    covariance: Floats  # (m/s)^2, shape (2 n_trials, 2 n_trials)
    coefficients: (
        Floats  # of the equations of surge and sway, in deviations of the prior
    )


def estimate_current(
    trials: Sequence[Trial],
    length: float,
    speed: float,
    shared: bool,
    known: Floats | None = None,
) -> CurrentEstimate:
    """The current of each trial, or of all, from psi, r, delta and velocities over ground.

    n, accelerations by wind and a speed u through the water are used where they are
    there. `known`, shape (18,), are coefficients of another estimate, which are then
    not fitted.
    """
    runs = _Runs(trials, length, speed, shared, known)
    x, slopes, residuals = runs.fitted()
    J, changes = slopes.reshape(-1, len(x)), []
    information = J.T @ J + np.diag(runs.weights**2)
    parts = 1 if shared and len(trials) > 2 else 3
    for k in range(len(trials)):
        for rows in np.array_split(
            np.flatnonzero(np.isfinite(runs.seen[:, 0, k])), parts
        ):
            own, left = (
                slopes[rows, :, k].reshape(-1, len(x)),
                residuals[rows, :, k].ravel(),
            )
            changes.append(np.linalg.solve(information - own.T @ own, own.T @ left))
    left_out = np.cov(np.transpose(changes)) * (len(changes) - 1) ** 2 / len(changes)
    columns = runs.columns.ravel()
    joint = (left_out + np.linalg.inv(information))[np.ix_(columns, columns)]
    return CurrentEstimate(speed * x[columns], speed**2 * joint, x[:COEFFICIENTS])


def over_ground(trial: Trial) -> tuple[Floats, Floats]:
    """Velocity of midship over ground, ahead and to starboard, m/s, of a trial that knows it."""
    if len({"u", "v"} & trial.derived) != 1:
        return trial["u"], trial["v"]
    north, east = (time_derivative(trial.t, trial[name]) for name in "xy")
    return rotate_to_body(north, east, trial["psi"])


def _accelerations(
    u: Floats, v: Floats, measured: Floats, c: Floats
) -> tuple[Floats, Floats]:
    """Surge and sway of ships of coefficients `c` for measured r, delta, n and acceleration by wind."""
    r, delta, n, ahead, aside = measured
    surge = (
        c[0]
        + c[1] * (u - n)
        + c[2] * (u * u - n * n)
        + c[3] * v * r
        + c[4] * v * v
        + c[5] * r * r
    )
    sway = c[8] + c[9] * u * v + c[10] * v * abs(v) + c[11] * u * r + c[12] * r * abs(r)
    crossed = c[13] * v * abs(r) + c[14] * r * abs(v) + (c[15] * u * u + c[16]) * delta
    return (
        surge + (c[6] + c[7] * u * u) * delta * delta + c[17] * ahead,
        sway + crossed + c[17] * aside,
    )


class _Runs:
    """Trials on a grid of time, and what ships of given coefficients do there; all in units of L and U0.

    Unknowns `x` are the coefficients, in deviations of the prior, u and v at the start
    of each trial, and the current of each or of all.
    """

    def __init__(
        self,
        trials: Sequence[Trial],
        length: float,
        speed: float,
        shared: bool,
        known: Floats | None,
    ) -> None:
        travel = length / speed
        shafts = [
            trial["n"][0] for trial in trials if "n" in trial and trial["n"][0] > 0.0
        ]
        shaft = float(np.median(shafts)) if len(shafts) == len(trials) else None
        self.windows = max(
            int(trial.duration / (STEP * STEPS * travel)) for trial in trials
        )
        grid = np.arange(self.windows * STEPS + 1) * STEP
        self.measured = np.empty((len(grid), 5, 1, len(trials)))
        self.psi = np.empty((len(grid), len(trials)))
        seen = np.full((len(grid), 3, len(trials)), np.nan)
        for k, trial in enumerate(trials):
            wind = wind_accelerations(trial).T[:2] * travel / speed
            n = trial["n"] / shaft if shaft is not None else np.ones(len(trial))
            north, east = rotate_to_body(*over_ground(trial), -trial["psi"])
            has_log = (
                "v" in trial.derived and "u" not in trial.derived
            )  # of the speed through the water
            logged = trial["u"] if has_log else np.full(len(trial), np.nan)
            seen_at = [row / speed for row in (north, east, logged)]
            rows = [
                trial["r"] * travel,
                trial["delta"],
                n,
                *wind,
                trial["psi"],
                *seen_at,
            ]
            times = (trial.t - trial.t[0]) / travel
            on_grid = np.array([np.interp(grid, times, row) for row in rows])
            self.measured[:, :, 0, k], self.psi[:, k] = on_grid[:5].T, on_grid[5]
            seen[:, :, k] = np.where(grid <= times[-1], on_grid[6:], np.nan).T
        self.seen = self.averaged(seen)
        # where the currents of the trials stand among the unknowns, shape (n_trials, 2)
        self.columns = (
            COEFFICIENTS + 2 * len(trials) + np.arange(2 * len(trials)).reshape(-1, 2)
        )
        self.columns = (
            np.repeat(self.columns[:1], len(trials), axis=0) if shared else self.columns
        )
        of_current = np.full(2 if shared else 2 * len(trials), CURRENT)
        self.weights = 1.0 / np.concatenate(
            [np.ones(COEFFICIENTS), np.tile(START, len(trials)), of_current]
        )
        self.centre = np.zeros(len(self.weights))
        if known is not None:
            self.weights[:COEFFICIENTS], self.centre[:COEFFICIENTS] = 1.0 / KNOWN, known

    def averaged(self, values: Floats) -> Floats:
        """Means over the windows of the grid."""
        return np.asarray(
            values[:-1].reshape(self.windows, STEPS, *values.shape[1:]).mean(axis=1)
        )

    def at(self, x: Floats) -> tuple[Floats, Floats]:
        """What is measured less what is simulated, and the slopes of the latter by the unknowns.

        Shapes (n_windows, 3, n_trials) and (n_windows, 3, n_trials, n_unknowns): north,
        east, and ahead through the water; 0 where nothing was measured.
        """
        moves, lanes = np.arange(COEFFICIENTS), COEFFICIENTS + 3
        c = np.repeat(
            (PRIOR[0] + x[:COEFFICIENTS] * PRIOR[1])[:, None, None], lanes, axis=1
        )
        c[moves, moves + 1] += DIFFERENCE * PRIOR[1][:, None]
        start = x[COEFFICIENTS : self.columns[0, 0]].reshape(-1, 2).T[:, None]
        u, v = np.repeat(start, lanes, axis=1)
        u, v = u + self.measured[0, 2], v.copy()
        u[-2] += DIFFERENCE
        v[-1] += DIFFERENCE
        motion = np.empty((len(self.measured), 2, *u.shape))
        motion[0] = u, v
        for i, (now, then) in enumerate(
            zip(self.measured[:-1], self.measured[1:], strict=True)
        ):
            surge, sway = _accelerations(u, v, now, c)
            halfway = u + 0.5 * STEP * surge, v + 0.5 * STEP * sway
            surge, sway = _accelerations(*halfway, 0.5 * (now + then), c)
            u, v = (
                np.clip(u + STEP * surge, -2.0, 3.0),
                np.clip(v + STEP * sway, -2.0, 2.0),
            )
            motion[i + 1] = u, v
        cosine, sine = np.cos(self.psi)[:, None], np.sin(self.psi)[:, None]
        u, v = motion[:, 0], motion[:, 1]
        simulated = self.averaged(
            np.stack([u * cosine - v * sine, u * sine + v * cosine, u], axis=1)
        )
        slopes = np.zeros((*self.seen.shape, len(x)))
        steps = (
            np.moveaxis(simulated[:, :, 1:] - simulated[:, :, :1], 2, 3) / DIFFERENCE
        )
        slopes[..., :COEFFICIENTS] = steps[..., :COEFFICIENTS]
        found = simulated[:, :, 0]
        found[:, :2] += x[self.columns].T
        for k, own in enumerate(self.columns):
            slopes[:, :, k, COEFFICIENTS + 2 * k : COEFFICIENTS + 2 * k + 2] = steps[
                :, :, k, COEFFICIENTS:
            ]
            slopes[:, [0, 1], k, own] = 1.0
        missing = ~np.isfinite(self.seen)
        slopes[missing] = 0.0
        return np.where(missing, 0.0, self.seen - found), slopes

    def fitted(self) -> tuple[Floats, Floats, Floats]:
        """The most probable unknowns, and slopes and residuals there by their standard deviation."""
        x, damping, scale = self.centre, 1e-2, 0.1
        residuals, slopes = self.at(x)
        count = max(int(np.isfinite(self.seen).sum()) - len(x), 1)

        def cost(residuals: Floats, x: Floats) -> float:
            return float(
                np.sum(residuals**2) / scale**2
                + np.sum((self.weights * (x - self.centre)) ** 2)
            )

        for _ in range(ROUNDS):
            J, before = slopes.reshape(-1, len(x)), cost(residuals, x)
            A = J.T @ J / scale**2 + np.diag(self.weights**2)
            b = J.T @ residuals.ravel() / scale**2 - self.weights**2 * (x - self.centre)
            moved = x + np.linalg.solve(A + damping * np.diag(np.diag(A)), b)
            tried = self.at(moved)
            after = cost(tried[0], moved)
            damping = max(0.1 * damping, 1e-9) if after < before else 10.0 * damping
            if after < before:
                x, (residuals, slopes) = moved, tried
                scale = max(float(np.sqrt(np.sum(residuals**2) / count)), SMALLEST)
            if abs(before - after) < ENOUGH * before:
                break
        return x, slopes / scale, residuals / scale
