"""Coefficients by the errors of simulated segments, pulled toward a start.

The output-error method of Maine & Iliff 1985, NASA RP-1138: noise is only in what is
compared, while equation-error methods regress on noisy velocities, which biases them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.estimators.covariance import newey_west
from identification.models.least_squares import (
    Linearised,
    fit_least_squares,
)
from identification.models.segments import BLOCK, Segment
from identification.models.shooting import Shooter, Shooting
from shipgym.arrays import Floats
from shipgym.trials.resampling import usual_step


@dataclass(frozen=True, eq=False)
class Solution:
    """Parameters of least cost, and where the last round of the fit ended."""

    parameters: Floats  # as `Shooter.shoot` takes them
    scales: Floats  # of the residuals by channel, shape (n_channels,)
    pull: float  # to the start, as `OutputError.solve` takes it
    shooting: Shooting
    cost_before: float  # mean squared residual at the start, in these scales
    cost_after: float
    evaluations: int


@dataclass(frozen=True, eq=False)
class OutputError:
    """A fit by the errors of simulated segments: what is compared, and from where."""

    shooter: Shooter
    segments: Sequence[Segment]  # of the trials
    start: Floats  # parameters to begin with, toward which the coefficients are pulled
    staggered: bool  # whether a second set of segments has each sample once more

    @property
    def n_samples(self) -> int:
        """Samples of all segments."""
        return sum(len(segment.measured) for segment in self.segments)

    @property
    def bin_width(self) -> float:
        """Bins of time in which residuals are added up, s: blocks or sampling steps."""
        travel_time = self.shooter.model.travel_time
        width = float(BLOCK * travel_time)
        for segment in self.segments:
            if len(segment.times) > 1:
                step = usual_step(segment.times)
                width = max(width, step)
        return width

    def start_scales(self) -> Floats:
        """Scales of the residuals at the start; not finite where a ship runs away."""
        shooter = self.shooter
        shooting = shooter.shoot(self.start, self.segments, shooter.units)
        return self.scales(shooting, shooter.units)

    def scales(self, shooting: Shooting, scales: Floats) -> Floats:
        """Root mean square of the residuals by channel, per sample.

        `scales`: those in which the residuals are given.
        """
        by_channel = shooting.residuals.reshape(-1, len(scales))
        errors = by_channel * scales
        squares = np.sum(errors**2, axis=0)
        # a residual is a mean over a block, times the root of its samples
        rms = np.sqrt(squares / self.n_samples)
        smallest = 1e-9 * self.shooter.units
        return np.asarray(np.maximum(rms, smallest))

    def pull_weight(self, pull: float) -> float:
        """Weight of each parameter's distance from the start.

        `pull`: cost of a coefficient by that of all samples being off by their scales.
        """
        n_compared = sum(segment.measured.size for segment in self.segments)
        return float(np.sqrt(pull * n_compared))

    def solve(self, scales: Floats, pull: float, rounds: int) -> Solution:
        """Fit, renew scales and starts of the segments, and fit again.

        `scales`: to begin with; `rounds`: of fits, between which scales of the
        residuals and starts of the segments are renewed.
        """
        weight = self.pull_weight(pull)
        parameters = self.start
        segments = self.segments
        evaluations = 0
        for _ in range(rounds):
            last_scales, last_segments = scales, segments
            fit = self._fit(parameters, segments, scales, weight)
            parameters = fit.x
            evaluations += fit.nfev
            shooting = self.shooter.shoot(parameters, segments, scales)
            segments = self.shooter.moved(segments, shooting.moves)
            scales = self.scales(shooting, scales)

        before = self.shooter.shoot(self.start, last_segments, last_scales)
        return Solution(
            parameters=parameters,
            scales=last_scales,
            pull=pull,
            shooting=shooting,
            cost_before=self._mean_square(before),
            cost_after=self._mean_square(shooting),
            evaluations=evaluations,
        )

    def _fit(
        self,
        start: Floats,
        segments: Sequence[Segment],
        scales: Floats,
        weight: float,
    ) -> Any:
        """Parameters of least cost between two renewals of scales and starts."""

        def linearised(parameters: Floats) -> Linearised:
            shooting = self.shooter.shoot(parameters, segments, scales)
            pulled = weight * (parameters - self.start)
            return Linearised(
                residuals=np.concatenate([shooting.residuals, pulled]),
                jacobian=np.vstack([shooting.jacobian, weight * np.eye(len(pulled))]),
            )

        return fit_least_squares(
            linearised,
            start,
            x_scale="jac",
            ftol=1e-6,
            xtol=1e-6,
            max_nfev=30,
        )

    def _mean_square(self, shooting: Shooting) -> float:
        return float(np.mean(shooting.residuals**2))

    def covariance(
        self, solution: Solution, memory: float
    ) -> tuple[Floats, list[Floats]]:
        """Sandwich covariance of the coefficients of the accelerations, and influences.

        Scores are added up over the samples of the same time, which the staggered set
        has twice, and over time as by Newey & West 1987. The pull counts as known. The
        influences, by trial, are what each bin of time added to the
        coefficients, shape (n_bins, n_coefficients).
        """
        inverse = self._inverse_information(solution)
        scores = self._scores(solution.shooting)
        factor = self._freedom_factor(solution.shooting, inverse)
        sizes = self.shooter.term_sizes

        influences = []
        for trial_scores in scores:
            moves = trial_scores @ inverse
            influence = -np.sqrt(factor) * moves * sizes
            influences.append(influence)

        moment = self._score_moment(scores, memory)
        of_parameters = factor * inverse @ moment @ inverse
        units = np.outer(sizes, sizes)
        covariance = of_parameters * units
        return 0.5 * (covariance + covariance.T), influences

    def _score_moment(self, scores: Sequence[Floats], memory: float) -> Floats:
        """Long-run second moment of the scores, each trial by itself."""
        lags = round(memory / self.bin_width)
        n_parameters = len(self.start)
        moment = np.zeros((n_parameters, n_parameters))
        for trial_scores in scores:
            moment += newey_west(trial_scores, lags)
        return moment

    def _inverse_information(self, solution: Solution) -> Floats:
        """Inverse of the information of the samples and the pull."""
        jacobian = solution.shooting.jacobian
        of_samples = jacobian.T @ jacobian
        of_pull = self.pull_weight(solution.pull) ** 2 * np.eye(len(self.start))
        inverse = np.linalg.pinv(
            of_samples + of_pull,
            rcond=1e-14,
            hermitian=True,
        )
        return np.asarray(inverse, dtype=float)

    def _scores(self, shooting: Shooting) -> list[Floats]:
        """Slopes times residuals, by trial in bins of time.

        Shape (n_bins, n_parameters).
        """
        rows = shooting.jacobian * shooting.residuals[:, None]

        # the channels of a block stand together
        n_channels = len(self.shooter.channels)
        n_parameters = rows.shape[1]
        blocks = rows.reshape(-1, n_channels, n_parameters)
        scores = blocks.sum(axis=1)
        return in_bins(scores, self.segments, self.bin_width)

    def _freedom_factor(self, shooting: Shooting, inverse: Floats) -> float:
        """Samples by samples less the parameters and starts fitted to them."""
        repeats = 2.0 if self.staggered else 1.0
        n_samples = len(shooting.residuals) / repeats

        # parameters count by their leverage, as the pull gives some of them
        jacobian = shooting.jacobian
        leverage = (jacobian @ inverse) * jacobian
        parameters = float(leverage.sum())

        starts = sum(len(move) for move in shooting.moves) / repeats
        left = n_samples - parameters - starts
        return n_samples / max(left, 1.0)


def in_bins(scores: Floats, segments: Sequence[Segment], width: float) -> list[Floats]:
    """Scores of blocks, shape (n_blocks, n_parameters), added up by trial and time.

    Bins of time are `width` wide, s, from the first block of each trial on. Shapes
    (n_bins, n_parameters).
    """
    trials = [segment.trial for segment in segments]
    counts = [len(segment.times) for segment in segments]
    trial = np.repeat(trials, counts)
    times = np.concatenate([segment.times for segment in segments])

    by_trial = []
    for index in np.unique(trial):
        rows = trial == index
        sums = _sums_in_time(scores[rows], times[rows], width)
        by_trial.append(sums)
    return by_trial


def _sums_in_time(scores: Floats, times: Floats, width: float) -> Floats:
    """Scores of one trial, added up in bins of time."""
    bins = np.floor(times / width).astype(int)
    bins -= bins.min()
    n_bins = bins.max() + 1
    n_parameters = scores.shape[1]
    sums = np.zeros((n_bins, n_parameters))
    np.add.at(sums, bins, scores)
    return sums
