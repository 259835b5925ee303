"""Errors of many models at once in whole trials, sailed by the measured rudder."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from identification.models.sailed import CoefficientPrior, Sailed
from identification.models.segments import Segment, compared_channels, cut
from shipgym import ShipModel, Trial
from shipgym.arrays import Flags, Floats, Integers


class Slopes(NamedTuple):
    """Errors of a point, and their derivatives by it."""

    errors: Floats  # shape (n_rows,)
    jacobian: Floats  # shape (n_rows, n_parameters)


class WholeTrials(Sailed):
    """Whole trials, each sailed from its first smoothed state by the measured rudder.

    A gap in time ends a part of a trial, and the next begins at its own first state.
    """

    def __init__(
        self, blank: ShipModel, trials: Sequence[Trial], prior: CoefficientPrior
    ) -> None:
        super().__init__(blank, compared_channels(blank, trials), prior)
        self.parts = _parts(blank, trials, self.channels)

    @property
    def of_trials(self) -> Integers:
        """Trial of each part."""
        return np.array([part.trial for part in self.parts])

    @property
    def n_errors(self) -> float:
        """Independent errors of a channel."""
        return sum(self.independent_errors(part) for part in self.parts)

    def errors(self, points: Floats) -> list[Floats]:
        """Errors of the models at some points by part, as of `errors_in`."""
        ships = self.ships(points)
        return [self.errors_in(part, ships) for part in self.parts]

    def scales(self, point: Floats) -> Floats:
        """Root mean square error by channel, above the floors; not finite if lost."""
        squares = np.zeros(len(self.channels))
        with np.errstate(invalid="ignore", over="ignore"):  # of a ship that runs away
            for errors in self.errors(point[None]):
                squares += np.sum(errors**2, axis=(0, 2))
            rms = np.sqrt(squares / self.n_errors)
        return np.asarray(np.maximum(rms, self.floors))

    def misfits(self, points: Floats, scales: Floats, kept: Flags) -> Floats:
        """Sum of squared errors in their scales by point, shape (n_points,).

        Infinite where a ship is lost. `kept` are the parts that count.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            errors = self.scaled_errors(points, scales, kept)
            total = np.einsum("ij,ij->j", errors, errors)
        return np.asarray(np.nan_to_num(total, nan=np.inf))

    def scaled_errors(self, points: Floats, scales: Floats, kept: Flags) -> Floats:
        """Errors in their scales of the parts kept, shape (n_rows, n_points)."""
        n_points = len(points)
        column = scales[:, None]
        by_part = self.errors(points)
        rows = []
        for errors, counts in zip(by_part, kept, strict=True):
            if not counts:
                continue
            scaled = errors / column
            in_rows = scaled.reshape(-1, n_points)
            rows.append(in_rows)
        return np.concatenate(rows)

    def slopes(self, point: Floats, scales: Floats, kept: Flags) -> Slopes:
        """Errors at a point in their scales, and their forward differences."""
        step = 1e-3
        shifts = step * np.eye(len(point))
        points = np.vstack([point, point + shifts])
        with np.errstate(invalid="ignore", over="ignore"):
            stacked = self.scaled_errors(points, scales, kept)
            errors = stacked[:, 0]
            changes = stacked[:, 1:] - errors[:, None]
        slopes = np.nan_to_num(changes / step, posinf=0.0, neginf=0.0)
        return Slopes(errors, slopes)


def _parts(
    blank: ShipModel, trials: Sequence[Trial], channels: Sequence[str]
) -> list[Segment]:
    """Trials without gaps, sailed and compared at every fifth of a length."""
    whole = 1e9  # lengths of a part at most
    step = 0.2
    parts = cut(
        trials,
        blank,
        channels,
        whole,
        staggered=False,
        interval=step,
    )
    longest_step = step * blank.travel_time
    return [_coarser(part, longest_step) for part in parts]


def _coarser(part: Segment, longest_step: float) -> Segment:
    """A part with as few steps of the integration between its samples as may be."""
    times = part.inputs[part.samples >= 0, 0]
    steps = np.ceil(np.diff(times) / longest_step - 1e-9)
    counts = np.maximum(steps, 1).astype(int)
    sampled = np.append(0, np.cumsum(counts))
    points = np.arange(sampled[-1] + 1)
    grid = np.interp(points, sampled, times)

    samples = np.full(len(grid), -1)
    samples[sampled] = np.arange(len(times))
    fine = part.inputs
    columns = [np.interp(grid, fine[:, 0], column) for column in fine.T]
    return replace(part, inputs=np.column_stack(columns), samples=samples)
