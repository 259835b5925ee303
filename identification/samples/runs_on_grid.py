"""Trials on one grid of time, in units of the ship's length and service speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.samples.surge_sway import SurgeSwayInputs
from identification.samples.velocities import over_ground
from shipgym import Trial
from shipgym.arrays import Floats
from shipgym.models.simulate import wind_accelerations
from shipgym.trials.navigation import rotate_to_body

STEP = 0.2  # of the grid, in the time to sail one ship length
STEPS = 5  # in a window, over which velocities are averaged


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
class Runs:
    """Trials on one grid of time; a shorter one stays at its last sample.

    In units of the ship's length and service speed.
    """

    inputs: Floats  # as of `SurgeSwayInputs`, shape (n_times, 5, n_trials)
    psi: Floats  # shape (n_times, n_trials)
    seen: Floats  # means over windows of time, shape (n_windows, 3, n_trials)

    @property
    def n_trials(self) -> int:
        """Number of trials."""
        return len(self.psi[0])


def trials_on_one_grid(trials: Sequence[Trial], length: float, speed: float) -> Runs:
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
    return Runs(
        inputs=np.stack(inputs, axis=-1),
        psi=np.stack(headings, axis=-1),
        seen=window_means(np.stack(seen, axis=-1)),
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


def window_means(values: Floats) -> Floats:
    """Means over the windows of the grid, whose times are the first axis."""
    windows = values[:-1].reshape(-1, STEPS, *values.shape[1:])
    return np.asarray(windows.mean(axis=1))
