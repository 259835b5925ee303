"""Posterior probability of coefficients of the MMG form, by trials and a prior.

The cost is that of the simulated states in segments back to back, each started from the
smoothed measurement, by their own scatter, plus the squared distance from the prior
(Maine & Iliff 1985, NASA RP-1138, 2.5, output error with prior).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.models.least_squares import (
    Linearised,
    fit_least_squares,
)
from identification.models.mmg_prior import MMGPrior
from identification.models.sailed import CoefficientPrior, Sailed
from identification.models.segments import Segment, compared_channels, cut
from shipgym import ShipModel, Trial
from shipgym.arrays import Flags, Floats, Integers
from shipgym.ships.mmg import IDENTIFIED

LARGEST = 1e3  # residual of a ship that runs away, in scales


@dataclass(frozen=True, eq=False)
class Estimate:
    """Coefficients of greatest probability."""

    # in standard deviations of the prior from its mean, shape (41,)
    z: Floats
    scales: Floats  # of the residuals by channel
    strength: float  # of the prior
    covariance: Floats  # of z, Gauss-Newton
    evaluations: int


class HeldOutError(NamedTuple):
    """Size of the errors of segments that fits without them predict."""

    error: float  # root mean square, in scales
    factor: float  # on the standard errors, at which errors are of size one


class _GroupErrors(NamedTuple):
    """Errors of a group of segments by a fit of the others."""

    mean_square: float  # in the scales that are given
    excess: float  # sum of squares beyond the scatter, whose errors have a size of one
    expected: float  # of that, by the covariance of the fit


class Posterior(Sailed):
    """Segments of trials and a prior, and the errors of ships of given coefficients.

    Coefficients are `z`, in standard deviations of the prior from its mean, shape
    (41,). `which` are indices of segments.
    """

    def __init__(
        self, blank: ShipModel, trials: Sequence[Trial], prior: MMGPrior
    ) -> None:
        self.mmg_prior = prior
        channels = compared_channels(blank, trials)
        ship = replace(blank, coefficients=prior.mean)
        names = list(ship.coefficients)
        root = np.zeros((len(names), len(IDENTIFIED)))
        root[: len(IDENTIFIED)] = np.diag(prior.deviation)
        mean = np.array([prior.mean[name] for name in names])
        super().__init__(ship, channels, CoefficientPrior(prior.source, mean, root))
        segment_lengths = 1.7  # of a segment, ship lengths at service speed
        sample_lengths = 0.067  # between the samples that are compared
        self.segments = cut(
            trials,
            ship,
            channels,
            segment_lengths,
            staggered=False,
            interval=sample_lengths,
        )
        self._sailed: dict[bytes, dict[int, Floats]] = {}  # by coefficients and segment

    @property
    def all_segments(self) -> Integers:
        """Indices of all segments."""
        return np.arange(len(self.segments))

    def model(self, z: Floats) -> ShipModel:
        """The model of some coefficients."""
        return self.blank.with_coefficients(self.prior.coefficients(z[None])[0])

    def errors(self, z: Floats, which: Integers) -> tuple[Floats, Floats]:
        """Errors of the simulated channels, and their slopes by z, of some segments.

        Each times the root of the share that its step has of the time over which errors
        are one error; shapes (n_samples, n_channels) and (n_samples, n_channels, 41).
        """
        step = 1e-4  # standard deviations of the prior
        known = self._sailed_with(z)
        ships = self.ships(np.vstack([z, z + step * np.eye(len(z))]))
        for index in which.tolist():
            if index not in known:
                known[index] = self.errors_in(self.segments[index], ships)
        lanes = np.concatenate([known[index] for index in which.tolist()])

        errors = lanes[:, :, 0]
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that run away
            changes = lanes[:, :, 1:] - errors[:, :, None]
            slopes = changes / step
        return errors, slopes

    def _sailed_with(self, z: Floats) -> dict[int, Floats]:
        """Segments that were sailed with some coefficients, of the last few.

        Fits without a group of segments begin where the fit of all ended.
        """
        key = z.tobytes()
        known = self._sailed.pop(key, {})
        self._sailed[key] = known
        most_kept = 4
        if len(self._sailed) > most_kept:
            oldest = next(iter(self._sailed))
            del self._sailed[oldest]
        return known

    def scales(self, errors: Floats, which: Integers) -> Floats:
        """Root mean square of the errors by channel, not below the floors."""
        n_errors = self.count_errors(which)
        with np.errstate(invalid="ignore", over="ignore"):
            squares = np.sum(errors**2, axis=0)
            rms = np.sqrt(squares / n_errors)

        ran_away = ~np.isfinite(rms)
        rms[ran_away] = 1e2 * self.floors[ran_away]
        return np.asarray(np.maximum(rms, self.floors))

    def count_errors(self, which: Integers) -> float:
        """Independent errors of a channel in some segments."""
        return sum(self.independent_errors(self.segments[index]) for index in which)

    def scaled_errors(self, z: Floats, which: Integers, scales: Floats) -> Linearised:
        """Errors of some segments in their scales, in a row, and their slopes by z.

        Those of a ship that runs away are large, and have no slope.
        """
        errors, slopes = self.errors(z, which)
        with np.errstate(invalid="ignore"):
            errors = errors / scales
            slopes = slopes / scales[:, None]

        errors = np.nan_to_num(errors, nan=LARGEST)
        errors = np.clip(errors, -LARGEST, LARGEST)
        slopes = np.nan_to_num(slopes, posinf=0.0, neginf=0.0)
        return Linearised(
            residuals=errors.ravel(),
            jacobian=slopes.reshape(errors.size, -1),
        )

    def residuals(
        self, z: Floats, which: Integers, scales: Floats, strength: float
    ) -> Linearised:
        """Errors of some segments in their scales, then the distance from the prior.

        By `strength` the standard deviations of the prior are divided.
        """
        data = self.scaled_errors(z, which, scales)
        n_parameters = len(z)
        from_prior = strength * z
        prior_slopes = strength * np.eye(n_parameters)
        return Linearised(
            residuals=np.append(data.residuals, from_prior),
            jacobian=np.vstack([data.jacobian, prior_slopes]),
        )

    def most_probable(self, start: Floats, strength: float) -> Estimate:
        """Fit all segments, the scales of the residuals renewed between rounds.

        From the mean of the prior, of which z is 0, there is a round more.
        """
        tolerances = (1e-2, 1e-4) if start.any() else (1e-2, 1e-2, 1e-4)
        which = self.all_segments
        z, evaluations = start, 0
        for tolerance in tolerances:
            errors, _ = self.errors(z, which)
            scales = self.scales(errors, which)

            def cost(point: Floats, scales: Floats = scales) -> Linearised:
                return self.residuals(point, which, scales, strength)

            fit = fit_least_squares(
                cost,
                z,
                ftol=tolerance,
                xtol=tolerance,
                max_nfev=30,
            )
            z = fit.x
            evaluations += fit.nfev

        slopes = self.scaled_errors(z, which, scales).jacobian
        return Estimate(
            z=z,
            scales=scales,
            strength=strength,
            covariance=covariance_of(slopes),
            evaluations=evaluations,
        )

    def held_out(self, whole: Estimate, scales: Floats) -> HeldOutError:
        """Error of each group of segments by a fit of the others.

        The error is in the scales given; the factor makes the errors held out, by those
        that the covariance of the others' fit and the scatter of the residuals lead to
        expect, one on average; at least 1.
        """
        groups = held_out_groups(self.segments)
        mean_squares = []
        excess = 0.0
        expected = 0.0
        for group in np.unique(groups):
            found = self._group_errors(groups == group, whole, scales)
            mean_squares.append(found.mean_square)
            excess += found.excess
            expected += found.expected

        mean_square = np.mean(mean_squares)
        variance_ratio = max(excess / expected, 1.0)
        return HeldOutError(
            error=float(np.sqrt(mean_square)),
            factor=float(np.sqrt(variance_ratio)),
        )

    def _group_errors(
        self, held: Flags, whole: Estimate, scales: Floats
    ) -> _GroupErrors:
        """Errors of the segments that are held, by a fit of those that are not."""
        z, covariance = self._without(np.flatnonzero(~held), whole)
        which = np.flatnonzero(held)
        errors, slopes = self.scaled_errors(z, which, whole.scales)
        n_channels = len(scales)
        n_errors = self.count_errors(which) * n_channels

        by_channel = errors.reshape(-1, n_channels)
        in_scales = by_channel * (whole.scales / scales)
        square = float(np.sum(in_scales**2))
        variances = (slopes @ covariance) * slopes
        return _GroupErrors(
            mean_square=square / n_errors,
            excess=float(errors @ errors) - n_errors,
            expected=float(variances.sum()),
        )

    def without_trials(self, trials: Sequence[int], whole: Estimate) -> Floats:
        """Coefficients fitted to the segments of the other trials."""
        of_segments = np.array([segment.trial for segment in self.segments])
        others = np.flatnonzero(~np.isin(of_segments, trials))
        z, _ = self._without(others, whole)
        return z

    def _without(self, others: Integers, whole: Estimate) -> tuple[Floats, Floats]:
        """Coefficients fitted to some segments, and their covariance.

        From those of all segments two Gauss-Newton steps come near enough.
        """
        z = whole.z
        for _ in range(2):
            residuals, jacobian = self.residuals(
                z,
                others,
                scales=whole.scales,
                strength=whole.strength,
            )
            moment = jacobian.T @ jacobian
            gradient = jacobian.T @ residuals
            step = np.linalg.solve(moment, gradient)
            z = z - step

        of_data = slice(-len(z))  # the rows of the prior come last
        return z, covariance_of(jacobian[of_data])


def covariance_of(slopes: Floats) -> Floats:
    """Gauss-Newton covariance with the prior as it is.

    A stronger one chosen for the fit is no knowledge.
    """
    n_parameters = slopes.shape[1]
    information = slopes.T @ slopes + np.eye(n_parameters)
    inverse = np.linalg.inv(information)
    return 0.5 * (inverse + inverse.T)


def held_out_groups(segments: Sequence[Segment]) -> Integers:
    """Group of each segment, held out together: a trial, of many every fifth one.

    Of a single trial a third.
    """
    trial = np.array([segment.trial for segment in segments])
    several = trial.max() > trial.min()
    if several:
        return trial % 5
    n_segments = len(segments)
    place = np.arange(n_segments)
    return place * 3 // n_segments
