"""Trials on one grid of time, in units of the ship's length and service speed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.samples.surge_sway import SurgeSwayInputs
from identification.samples.velocities import over_ground
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.models.simulate import wind_accelerations
from shipgym.trials.navigation import rotate_to_body

STEP = 0.2  # of the grid, in the time to sail one ship length
STEPS = 5  # in a window, over which velocities are averaged


@dataclass(frozen=True, eq=False)
class Runs:
    """Trials on one grid of time; a shorter one stays at its last sample.

    In units of the ship's length and service speed.
    """

    inputs: Floats  # as of `SurgeSwayInputs`, shape (n_times, 5, n_trials)
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
) -> SurgeSwayInputs:
    """What moves the ship, arrays of shape (n_samples,)."""
    wind = wind_accelerations(trial) * travel_time / speed
    shaft = np.ones(len(trial))
    if shaft_speed is not None:
        shaft = trial["n"] / shaft_speed
    return SurgeSwayInputs(
        r=trial["r"] * travel_time,
        delta=trial["delta"],
        n=shaft,
        ahead=wind[:, 0],
        aside=wind[:, 1],
    )


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
