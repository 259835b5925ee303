"""Refinement: a model fitted to what it simulates, in segments, from where another method left off.

Equation-error methods regress on noisy velocities, which biases them; here noise is
only in what is compared. Whole trials would let a drift of heading leak into the
coefficients, hence segments (multiple shooting, Bock 1983; the output-error method of
Maine & Iliff 1985, NASA RP-1138).
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from identification.estimators.estimator import FitTask
from identification.regression.samples import Samples
from identification.simulation_error.prior import reference_turns
from identification.simulation_error.refinement import Refinement
from identification.simulation_error.segments import (
    BLOCK,
    Segment,
    Shooter,
    Shooting,
    about_mean,
    compared_channels,
    cut,
)
from identification.uncertainty.covariance import newey_west
from identification.validation.guard import GuardedFit, reasons_unstable
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Floats

# of fits, between which scales of the residuals and starts of the segments are renewed
ROUNDS = 3
OFFSET = np.radians(
    1.0
)  # standard deviation of a rudder's offset, as far as is known beforehand
# factor on the pull from attempt to attempt, while the refined model runs away
STRONGER = 10.0
ATTEMPTS = 4


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined fit."""

    fit: GuardedFit  # as the start, with the refined model
    #: of the coefficients of the accelerations; None where the start stayed, shape
    #: (n_coefficients, n_coefficients)
    covariance: Floats | None
    #: by trial: by how much stretches of time moved those coefficients, for the
    #: bootstrap, shape (n_stretches, n_coefficients)
    influences: list[Floats]
    report: dict[
        str, Any
    ]  # for the provenance: settings, cost before and after, scales, offsets, decision
    width: float = 0.0  # of the stretches, s


def refine(
    start: GuardedFit, task: FitTask, settings: Refinement, memory: float
) -> Refined:
    """Refine a fit by the errors of what its model simulates in segments of the trials.

    `start`: the fit to start from; `task`: its regression, which shows how large the
    terms are in the trials, and the trials; `memory`: time over which residuals are
    taken to be correlated, s. Returns the start itself where its model runs away
    already, or the refined ones do under every prior. Raises InputError for extra
    trials that lack channels.
    """
    problem = _Problem(start, task, settings)
    if not (
        start.stable and np.isfinite(problem.scales).all()
    ):  # it does not sail all segments
        return Refined(
            start,
            None,
            [],
            settings.plain() | {"decision": "not refined: the start runs away"},
        )
    rejected, prior = list[dict[str, Any]](), settings.pull
    for _ in range(ATTEMPTS):
        solution = problem.solve(prior)
        model = problem.model(solution.parameters)
        if not (reasons := reasons_unstable(model, task.trials)):
            fit = replace(
                start, model=model, estimators=problem.estimators(solution.parameters)
            )
            covariance, influences = problem.covariance(solution, prior, memory)
            report = (
                settings.plain()
                | problem.report(solution)
                | {
                    "decision": "refined",
                    "pull": prior,
                }
            )
            report |= {"rejected": rejected} if rejected else {}
            return Refined(fit, covariance, influences, report, problem.width)
        rejected.append({"pull": prior, "reasons": reasons})
        prior = max(prior * STRONGER, 1e-9)
    report = settings.plain() | {
        "decision": "not refined: it runs away",
        "rejected": rejected,
    }
    return Refined(start, None, [], report)


@dataclass(frozen=True, eq=False)
class _Solution:
    parameters: Floats
    scales: Floats
    shooting: Shooting
    costs: list[
        float
    ]  # mean squared residual in the last round's scales, before and after
    evaluations: int


def _check_refinable(blank: ShipModel, extra_trials: Sequence[Trial]) -> None:
    """Refuse a structure whose state is not recorded, and extra trials that lack channels."""
    if "q" in blank.table.equations:
        raise InputError(
            f"method 'output-error': structure {blank.structure!r} with a memory of yaw"
            " found, whose state no trial records, expected one without; choose method"
            " 'tls-svm'"
        )
    for trial in extra_trials:
        if missing := [c for c in blank.table.required_channels if c not in trial]:
            raise InputError(
                f"extra trial {trial.name!r}: channel {missing[0]!r} is missing,"
                f" expected {', '.join(blank.table.required_channels)}"
            )


class _Problem:
    """Segments, parameters and their prior of one refinement."""

    def __init__(self, start: GuardedFit, task: FitTask, settings: Refinement) -> None:
        self.start, self.settings, self.trials = start, settings, task.trials
        blank = start.model
        _check_refinable(blank, settings.extra_trials)
        self.sizes = np.concatenate(
            [_term_sizes(task.samples, q) for q in blank.table.equations]
        )
        channels = compared_channels(blank, [*task.trials, *settings.extra_trials])
        self.shooter = Shooter(
            blank, channels, self.sizes, settings.segment_start == "free"
        )
        self.own = self._segments(task.trials)  # of the trials to fit
        self.rows = len(channels) * sum(
            len(segment.blocks) for segment in self.own
        )  # of their residuals
        steps = [
            float(np.median(np.diff(s.times))) for s in self.own if len(s.times) > 1
        ]
        # of the bins of time in which residuals are added up, s: a block, or a sampling
        # step
        self.width = max([float(BLOCK * blank.travel_time), *steps])
        turns = (
            [] if settings.anchor is None else reference_turns(settings.anchor, blank)
        )
        weights = [settings.extra_weight] * len(settings.extra_trials) + [
            settings.anchor_weight
        ] * len(turns)
        further = [
            replace(
                segment,
                trial=len(task.trials) + segment.trial,
                weight=weights[segment.trial],
            )
            for segment in self._segments([*settings.extra_trials, *turns])
        ]
        self.segments = self.own + further
        values = np.concatenate(
            [start.estimators[q].coef_ for q in blank.table.equations]
        )
        no_offsets = np.zeros(len(task.trials) * settings.rudder_offsets)
        self.first = np.concatenate([values / self.sizes, no_offsets])
        units = self.shooter.units
        self.scales = self._scales(
            self.shooter.shoot(self.first, self.segments, units), units
        )

    def _segments(self, trials: Sequence[Trial]) -> list[Segment]:
        lengths, staggered = self.settings.segment_lengths, self.settings.staggered
        return cut(trials, self.start.model, self.shooter.channels, lengths, staggered)

    def _scales(self, shooting: Shooting, scales: Floats) -> Floats:
        """Root mean square of the residuals of each channel in the trials, per sample."""
        errors = shooting.residuals[: self.rows].reshape(-1, len(scales)) * scales
        rms = np.sqrt(
            np.sum(errors**2, axis=0)
            / sum(len(segment.measured) for segment in self.own)
        )
        return np.asarray(np.maximum(rms, 1e-9 * self.shooter.units))

    def solve(self, prior: float) -> _Solution:
        """Fit, renew scales and starts of the segments, and fit again."""
        parameters, segments, scales, evaluations = (
            self.first,
            self.segments,
            self.scales,
            0,
        )
        for _ in range(ROUNDS):
            before = self.shooter.shoot(self.first, segments, scales)
            found, shooting = self._round(
                parameters, segments, scales, self._prior_weights(prior)
            )
            parameters, evaluations, last = found.x, evaluations + found.nfev, scales
            segments = self.shooter.moved(segments, shooting.moves)
            scales = self._scales(shooting, scales)
        costs = [
            float(np.mean(one.residuals[: self.rows] ** 2))
            for one in (before, shooting)
        ]
        return _Solution(parameters, last, shooting, costs, evaluations)

    def _round(
        self,
        start: Floats,
        segments: Sequence[Segment],
        scales: Floats,
        weights: Floats,
    ) -> tuple[Any, Shooting]:
        """The fit between two renewals of scales and starts, and the shooting that it ends with."""

        @lru_cache(maxsize=1)
        def shot(z: bytes) -> Shooting:
            return self.shooter.shoot(np.frombuffer(z), segments, scales)

        def residuals(z: Floats) -> Floats:
            return np.concatenate(
                [shot(z.tobytes()).residuals, weights * (z - self.first)]
            )

        def jacobian(z: Floats) -> Floats:
            return np.vstack([shot(z.tobytes()).jacobian, np.diag(weights)])

        found = least_squares(
            residuals,
            start,
            jacobian,
            method="trf",
            x_scale="jac",
            ftol=1e-6,
            xtol=1e-6,
            max_nfev=30,
        )
        return found, shot(found.x.tobytes())

    def _prior_weights(self, prior: float) -> Floats:
        compared = sum(segment.measured.size for segment in self.own)
        weights = np.full(len(self.first), np.sqrt(prior * compared))
        weights[len(self.sizes) :] = 1.0 / OFFSET
        return weights

    def model(self, parameters: Floats) -> ShipModel:
        """The model of some parameters."""
        blank, accelerations = (
            self.start.model,
            parameters[: len(self.sizes)] * self.sizes,
        )
        return blank.with_coefficients(
            np.linalg.solve(blank.acceleration_matrix, accelerations)
        )

    def estimators(self, parameters: Floats) -> dict[str, Any]:
        """Copies of the start's estimators with the refined coefficients, for the diagnostics."""
        estimators = {
            q: copy.copy(estimator) for q, estimator in self.start.estimators.items()
        }
        for q, rows in self.start.model.table.regression_rows.items():
            estimators[q].coef_ = parameters[rows] * self.sizes[rows]
        return estimators

    def covariance(
        self, solution: _Solution, prior: float, memory: float
    ) -> tuple[Floats, list[Floats]]:
        """Sandwich covariance of the coefficients of the accelerations, and each stretch's influence.

        Scores are added up over the samples of the same time, which the staggered set
        has twice, and over time as by Newey & West 1987. Extra trials and the prior
        count as known.
        """
        shooting, n_terms = solution.shooting, len(self.sizes)
        jacobian, precision = (
            shooting.jacobian,
            np.diag(self._prior_weights(prior) ** 2),
        )
        inverse = np.linalg.pinv(
            jacobian.T @ jacobian + precision, rcond=1e-14, hermitian=True
        )
        slopes, times = (
            jacobian * shooting.residuals[:, None],
            2.0 if self.settings.staggered else 1.0,
        )
        blocks = (
            slopes[: self.rows]
            .reshape(-1, len(self.scales), slopes.shape[1])
            .sum(axis=1)
        )
        scores = _in_bins(blocks, self.own, self.width)
        used = float(
            np.einsum(
                "ij,jk,ik->", jacobian[: self.rows], inverse, jacobian[: self.rows]
            )
        )
        used += sum(len(move) for move in shooting.moves[: len(self.own)]) / times
        samples = self.rows / times
        factor = samples / max(samples - used, 1.0)
        total = np.zeros_like(inverse)
        for score in scores:
            total += newey_west(score, round(memory / self.width))
        cov = (factor * inverse @ total @ inverse)[:n_terms, :n_terms] * np.outer(
            self.sizes, self.sizes
        )
        influences = [
            -np.sqrt(factor) * (score @ inverse)[:, :n_terms] * self.sizes
            for score in scores
        ]
        return 0.5 * (cov + cov.T), influences

    def report(self, solution: _Solution) -> dict[str, Any]:
        """For the provenance."""
        names = [trial.name for trial in self.trials]
        offsets = np.degrees(
            about_mean(solution.parameters[len(self.sizes) :])
        ).tolist()
        (before, after), channels = solution.costs, self.shooter.channels
        return {
            "segments": len(self.own),
            "cost_before": before,
            "cost_after": after,
            "evaluations": solution.evaluations,
            "residual_rms": dict(zip(channels, solution.scales.tolist(), strict=True)),
            "rudder_offsets_deg": (
                dict(zip(names, offsets, strict=True)) if offsets else {}
            ),
        }


def _term_sizes(samples: Samples, equation: str) -> Floats:
    """Coefficients whose terms would make up the whole change of a velocity, shape (n_terms,)."""
    whole = np.sqrt(np.mean(samples.targets[equation] ** 2))
    terms = np.sqrt(np.mean(samples.features[equation] ** 2, axis=0))
    return np.asarray(
        whole / np.where(terms > 0.0, terms, np.inf) + np.finfo(float).tiny
    )


def _in_bins(scores: Floats, segments: Sequence[Segment], width: float) -> list[Floats]:
    """Scores of blocks, shape (n_blocks, n_parameters), added up by trial in bins of time of some width."""
    trial = np.concatenate(
        [np.full(len(segment.times), segment.trial) for segment in segments]
    )
    times, found = (
        np.floor(np.concatenate([segment.times for segment in segments]) / width),
        [],
    )
    for own in (trial == index for index in np.unique(trial)):
        bins = (times[own] - times[own].min()).astype(int)
        found.append(np.zeros((bins.max() + 1, scores.shape[1])))
        np.add.at(found[-1], bins, scores[own])
    return found
