"""Coefficients by the errors of simulated segments, pulled toward a start.

The output-error method of Maine & Iliff 1985, NASA RP-1138: noise is only in what is
compared, while equation-error methods regress on noisy velocities, which biases them.
Trials are sailed in segments, each from a start that is fitted too (multiple shooting,
Bock 1983): whole trials would let a drift of heading leak into the coefficients.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import by_name, column_rms, root_mean_square
from identification.estimators.covariance import newey_west
from identification.estimators.linear import Estimators
from identification.least_squares import (
    Linearised,
    fit_least_squares,
)
from identification.models.guard import GuardedFit, reasons_unstable
from identification.models.refinement import WHOLE, Refinement
from identification.models.sailed import (
    BLOCK,
    Segment,
    channel_units,
    compared_channels,
    cut,
    in_columns,
    sail,
    velocities,
    with_prior,
)
from identification.samples.problem import Problem
from identification.samples.samples import Samples
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats, Integers
from shipgym.trials.resampling import usual_step


class Shooting(NamedTuple):
    """Errors of all segments at a set of parameters."""

    #: simulated less measured, by the scale of the channel, blocks averaged: those of
    #: all segments one after the other, the channels of a block together, shape
    #: (n_rows,)
    residuals: Floats
    jacobian: Floats  # shape (n_rows, n_parameters)
    moves: list[Floats]  # by segment: how its start would move, shape (n_free,)


class Solution(NamedTuple):
    """Parameters of least cost, and where the last round of the fit ended."""

    parameters: Floats  # as `OutputError.shoot` takes them
    scales: Floats  # of the residuals by channel, shape (n_channels,)
    pull: float  # to the start, as `OutputError.solve` takes it
    shooting: Shooting


@dataclass(frozen=True, eq=False)
class OutputError:
    """A fit by the errors of simulated segments: what is compared, and from where."""

    model: ShipModel  # gives the compiled accelerations and all but their coefficients
    channels: Sequence[str]  # that are compared
    #: coefficients of the accelerations (SI) that stand for a parameter of 1, shape
    #: (n_coefficients,)
    term_sizes: Floats
    segments: Sequence[Segment]  # of the trials
    start: Floats  # parameters to begin with, toward which the coefficients are pulled
    staggered: bool  # whether a second set of segments has each sample once more

    @cached_property
    def columns(self) -> list[int]:
        """Places of the channels in the state."""
        return [self.model.state_names.index(name) for name in self.channels]

    @cached_property
    def free(self) -> tuple[str, ...]:
        """States in which the starts of segments are fitted."""
        return tuple(dict.fromkeys((*velocities(self.model), *self.channels)))

    @cached_property
    def free_columns(self) -> list[int]:
        """Places of these in the state."""
        return [self.model.state_names.index(name) for name in self.free]

    @cached_property
    def units(self) -> Floats:
        """Units in which the channels are compared."""
        return channel_units(self.model, self.channels)

    @property
    def bin_width(self) -> float:
        """Bins of time in which residuals are added up, s: blocks or sampling steps."""
        steps = [usual_step(one.times) for one in self.segments if len(one.times) > 1]
        return max([BLOCK * self.model.travel_time, *steps])

    def shoot(
        self, parameters: Floats, segments: Sequence[Segment], scales: Floats
    ) -> Shooting:
        """Residuals and Jacobian at some parameters, without what the starts explain.

        The residual of a segment is what a linear step of its start leaves (variable
        projection, Golub & Pereyra 1973, SIAM J. Numer. Anal. 10(2), with the Jacobian
        of Kaufman 1975). `parameters`: coefficients by `term_sizes`, shape
        (n_coefficients,); `scales`: residuals that count as 1, shape (n_channels,). Not
        finite where a ship ran away.
        """
        coefficients = parameters * self.term_sizes
        found = []
        for segment in segments:
            errors, slopes = self._block_errors(coefficients, segment, scales)
            found.append(without_start(errors, slopes, len(self.free)))
        residuals, jacobians, moves = zip(*found, strict=True)
        return Shooting(
            residuals=np.concatenate(residuals),
            jacobian=np.concatenate(jacobians),
            moves=list(moves),
        )

    def _moved_if_sailed(
        self,
        parameters: Floats,
        segments: Sequence[Segment],
        shooting: Shooting,
        scales: Floats,
    ) -> list[Segment]:
        """The segments with their starts moved, but where the ship would run away."""
        found = []
        for segment, move in zip(segments, shooting.moves, strict=True):
            start = segment.start.copy()
            start[self.free_columns] += move * channel_units(self.model, self.free)
            moved = segment._replace(start=start)
            again = self.shoot(parameters, [moved], scales)
            found.append(moved if np.isfinite(again.residuals).all() else segment)
        return found

    def _block_errors(
        self, coefficients: Floats, segment: Segment, scales: Floats
    ) -> tuple[Floats, Floats]:
        """Errors of a segment averaged over blocks, and their slopes, in scales.

        Shapes (n_rows,) and (n_rows, n_coefficients + n_free).
        """
        blocks = segment.blocks
        counts = segment.block_sizes
        factors = np.sqrt(counts)[:, None] / scales

        channels, slopes = self._channels(coefficients, segment)
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
            errors = channels - segment.measured
            errors = factors * averaged(errors, blocks, counts)
            slopes = factors[:, :, None] * averaged(slopes, blocks, counts)
        return errors.ravel(), slopes.reshape(errors.size, -1)

    def _channels(
        self, coefficients: Floats, segment: Segment
    ) -> tuple[Floats, Floats]:
        """Simulated channels, and their slopes by parameter and start.

        Forward differences of parameters that are about 1: in each column but the first
        one number of the ship or the start is larger by a step.
        """
        numbers = self.model.ship_numbers()
        n_numbers = len(numbers)
        first_term = n_numbers - len(coefficients)  # the terms' numbers come last
        nominal = np.concatenate([numbers, segment.start])
        nominal[first_term:n_numbers] = coefficients
        starts = [n_numbers + column for column in self.free_columns]
        varied = [*range(first_term, n_numbers), *starts]
        units = np.append(self.term_sizes, channel_units(self.model, self.free))

        step = 1e-5
        columns = in_columns(nominal, 1 + len(varied))
        columns[varied, range(1, 1 + len(varied))] += step * units
        ships, begun = columns[:n_numbers], columns[n_numbers:]
        sailed = sail(self.model, segment, ships, begun)[:, self.columns]
        channels = sailed[:, :, 0]
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
            slopes = (sailed[:, :, 1:] - channels[:, :, None]) / step
        return channels, slopes

    def scales(self, shooting: Shooting, scales: Floats) -> Floats:
        """Root mean square of the residuals by channel, per sample.

        `scales`: those in which the residuals are given.
        """
        errors = shooting.residuals.reshape(-1, len(scales)) * scales
        n_samples = sum(len(segment.measured) for segment in self.segments)
        # a residual is a mean over a block, times the root of its samples
        rms = np.sqrt(
            np.sum(
                errors**2,
                axis=0,
            )
            / n_samples
        )
        return np.asarray(np.maximum(rms, 1e-9 * self.units))

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
        for _ in range(rounds):
            last_scales = scales
            parameters = self._fit(parameters, segments, scales, weight)
            shooting = self.shoot(parameters, segments, scales)
            segments = self._moved_if_sailed(parameters, segments, shooting, scales)
            scales = self.scales(shooting, scales)

        return Solution(parameters, last_scales, pull, shooting)

    def _fit(
        self,
        start: Floats,
        segments: Sequence[Segment],
        scales: Floats,
        weight: float,
    ) -> Floats:
        """Parameters of least cost between two renewals of scales and starts."""

        def linearised(parameters: Floats) -> Linearised:
            shooting = self.shoot(parameters, segments, scales)
            data = Linearised(shooting.residuals, shooting.jacobian)
            return with_prior(data, parameters - self.start, weight)

        found = fit_least_squares(
            linearised, start, x_scale="jac", ftol=1e-6, xtol=1e-6, max_nfev=30
        )
        return np.asarray(found.x)

    def covariance(
        self, solution: Solution, memory: float
    ) -> tuple[Floats, list[Floats]]:
        """Sandwich covariance of the coefficients of the accelerations, and influences.

        Scores are added up over the samples of the same time, which the staggered set
        has twice, and over time as by Newey & West 1987. The pull counts as known. The
        influences, by trial, are what each bin of time added to the
        coefficients, shape (n_bins, n_coefficients).
        """
        shooting, sizes = solution.shooting, self.term_sizes
        information = shooting.jacobian.T @ shooting.jacobian
        of_pull = self.pull_weight(solution.pull) ** 2 * np.eye(len(sizes))
        inverse = np.asarray(
            np.linalg.pinv(information + of_pull, rcond=1e-14, hermitian=True),
            dtype=float,
        )
        factor = self._freedom_factor(shooting, inverse)
        scores = self._scores(shooting)
        influences = [-np.sqrt(factor) * (own @ inverse) * sizes for own in scores]

        # the long-run second moment of the scores, each trial by itself
        lags = round(memory / self.bin_width)
        moment = np.sum([newey_west(own, lags) for own in scores], axis=0)
        of_parameters = factor * inverse @ moment @ inverse
        covariance = of_parameters * np.outer(sizes, sizes)
        return 0.5 * (covariance + covariance.T), influences

    def _scores(self, shooting: Shooting) -> list[Floats]:
        """Slopes times residuals, by trial in bins of time.

        Shapes (n_bins, n_parameters).
        """
        rows = shooting.jacobian * shooting.residuals[:, None]
        # the channels of a block stand together
        scores = rows.reshape(
            -1,
            len(self.channels),
            rows.shape[1],
        ).sum(axis=1)
        times = np.concatenate([segment.times for segment in self.segments])
        trial = np.repeat(
            [segment.trial for segment in self.segments],
            [len(segment.times) for segment in self.segments],
        )
        bins = np.floor(times / self.bin_width).astype(int)
        by_trial = []
        for index in np.unique(trial):
            own = trial == index
            place = bins[own] - bins[own].min()
            sums = np.zeros((place.max() + 1, scores.shape[1]))
            np.add.at(sums, place, scores[own])
            by_trial.append(sums)
        return by_trial

    def _freedom_factor(self, shooting: Shooting, inverse: Floats) -> float:
        """Samples by samples less the parameters and starts fitted to them.

        Parameters count by their leverage, as the pull gives some of them.
        """
        repeats = 2.0 if self.staggered else 1.0
        n_samples = len(shooting.residuals) / repeats
        jacobian = shooting.jacobian
        parameters = float(np.sum((jacobian @ inverse) * jacobian))
        starts = sum(len(move) for move in shooting.moves) / repeats
        return n_samples / max(n_samples - parameters - starts, 1.0)


def averaged(values: Floats, blocks: Integers, counts: Integers) -> Floats:
    """Means over blocks along the first axis, from their first samples and sizes."""
    sizes = counts.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.add.reduceat(values, blocks) / sizes)


def without_start(
    residual: Floats, slopes: Floats, n_free: int
) -> tuple[Floats, Floats, Floats]:
    """Residuals and slopes without what a move of the start explains, and that move.

    The last `n_free` columns of the slopes are those by the start. Of a ship that ran
    away nothing is taken out.
    """
    others = slopes[:, :-n_free]
    by_start = slopes[:, -n_free:]
    finite = np.isfinite(slopes).all() and np.isfinite(residual).all()
    if not finite:
        return residual, others, np.zeros(n_free)

    q, r = np.linalg.qr(by_start)
    explained = q.T @ residual
    move, *_ = np.linalg.lstsq(
        r,
        -explained,
        rcond=1e-10,
    )
    residual = residual - q @ explained
    others = others - q @ (q.T @ others)
    return residual, others, move


def refine(
    start: GuardedFit,
    problem: Problem,
    settings: Refinement,
    memory: float,
    rounds: int = 3,
) -> GuardedFit:
    """Refine a fit by the errors of what its model simulates in segments of the trials.

    `start`: the fit to start from; `problem`: its regression shows how large the
    terms are in the trials; `memory`: time over which residuals are
    taken to be correlated, s; `rounds`: of fits, between which scales and starts of the
    segments are renewed, of which one does from near the end. A refined model that runs
    away is pulled ten times harder to the start, up to three times. Returns the start
    itself where its model runs away already, or the refined ones do however hard they
    are pulled.
    """
    fit = _posed(start, problem, settings)
    report = {name: getattr(settings, name) for name in settings.options}
    at_start = fit.shoot(fit.start, fit.segments, fit.units)
    scales = fit.scales(at_start, fit.units)  # not finite where a ship runs away
    if not (start.stable and np.isfinite(scales).all()):
        report["decision"] = "not refined: the start runs away"
        return start._replace(refinement=report)

    rejected = list[dict[str, Any]]()
    pull = settings.pull
    for _ in range(4):
        solution = fit.solve(scales, pull, rounds)
        coefficients = solution.parameters * fit.term_sizes
        blank = start.model
        values = np.linalg.solve(blank.acceleration_matrix, coefficients)
        model = blank.with_coefficients(np.asarray(values, dtype=float))
        reasons = reasons_unstable(model, problem.used)
        if reasons:
            rejected.append({"pull": pull, "reasons": reasons})
            pull = max(10.0 * pull, 1e-9)
            continue
        report |= {
            "residual_rms": by_name(fit.channels, solution.scales),
            "pull": solution.pull,
            "decision": "refined",
        }
        if rejected:
            report["rejected"] = rejected
        covariance, influences = fit.covariance(solution, memory)
        return start._replace(
            model=model,
            estimators=_with_values(start, coefficients),
            refinement=report,
            covariance=covariance,
            influences=influences,
        )

    report |= {"decision": "not refined: it runs away", "rejected": rejected}
    return start._replace(refinement=report)


def _with_values(start: GuardedFit, coefficients: Floats) -> Estimators:
    """Estimators of refined coefficients, for the diagnostics."""
    estimators = {}
    for q, rows in start.model.table.regression_rows.items():
        estimators[q] = copy.copy(start.estimators[q])
        estimators[q].coef_ = coefficients[rows]
    return estimators


def _posed(start: GuardedFit, problem: Problem, settings: Refinement) -> OutputError:
    """The problem: segments of the trials, and coefficients in units of their terms."""
    blank = start.model
    if "q" in blank.table.equations:
        raise InputError(
            "method 'output-error': expected a structure without a memory of yaw,"
            f" whose state no trial records, got {blank.structure!r}; choose method"
            " 'tls-svm'"
        )
    channels = compared_channels(blank, problem.used)
    equations = blank.table.equations
    sizes = np.concatenate([term_sizes(problem.samples, q) for q in equations])
    values = np.concatenate([start.estimators[q].coef_ for q in equations])
    lengths = settings.segment_lengths
    staggered = lengths < WHOLE
    segments = cut(problem.used, blank, channels, lengths, staggered)
    return OutputError(blank, channels, sizes, segments, values / sizes, staggered)


def term_sizes(samples: Samples, equation: str) -> Floats:
    """Coefficients whose terms would make up the whole change of a velocity.

    Shape (n_terms,).
    """
    change = root_mean_square(samples.targets[equation])
    terms = column_rms(samples.features[equation])
    # never 0: coefficients are divided by the size of a term that is not seen, too
    return change / np.where(terms > 0.0, terms, np.inf) + np.finfo(float).tiny
