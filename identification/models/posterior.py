"""Posterior probability of coefficients of the MMG form, by trials and a prior.

The cost is that of the simulated states in segments back to back, each started from the
smoothed measurement, by their own scatter, plus the squared distance from the prior
(Maine & Iliff 1985, NASA RP-1138, 2.5, output error with prior).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import by_name
from identification.models.coefficient_prior import CoefficientPrior
from identification.models.least_squares import (
    Linearised,
    fit_least_squares,
)
from identification.models.mmg_prior import MMGPrior
from identification.models.segments import Segment, compared_channels, cut
from identification.models.shooting import (
    channel_units,
    in_all_lanes,
    sail_lanes,
)
from shipgym import ShipModel, Trial
from shipgym.arrays import Flags, Floats, Integers
from shipgym.engine.motion import Ship
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


def least_scales(ship: ShipModel, channels: Sequence[str]) -> Floats:
    """Least scales of errors by channel, SI units; of others that of the yaw rate.

    Velocities by service speed U0, yaw rate by U0 / L, heading in rad.
    """
    least = {"u": 0.0017, "v": 0.0017, "r": 0.0021, "psi": np.radians(0.1)}
    parts = np.array([least.get(name, least["r"]) for name in channels])
    return np.asarray(parts * channel_units(ship, channels))


class Posterior:
    """Segments of trials and a prior, and the errors of ships of given coefficients.

    Coefficients are `z`, in standard deviations of the prior from its mean, shape
    (41,). `which` are indices of segments.
    """

    def __init__(
        self, blank: ShipModel, trials: Sequence[Trial], prior: MMGPrior
    ) -> None:
        self.blank = replace(blank, coefficients=prior.mean)
        self.prior = prior
        self.mean = np.array([prior.mean[name] for name in IDENTIFIED])
        self.channels = compared_channels(blank, trials)
        self.floors = least_scales(blank, self.channels)
        segment_lengths = 1.7  # of a segment, ship lengths at service speed
        sample_lengths = 0.067  # between the samples that are compared
        self.segments = cut(
            trials,
            self.blank,
            self.channels,
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
        values = self.mean + z * self.prior.deviation
        coefficients = self.prior.mean | by_name(IDENTIFIED, values)
        return replace(self.blank, coefficients=coefficients)

    @property
    def coefficient_prior(self) -> CoefficientPrior:
        """The prior of all coefficients; those known beforehand do not vary."""
        names = list(self.blank.coefficients)
        mean = np.array([self.prior.mean[name] for name in names])
        root = np.zeros((len(names), len(IDENTIFIED)))
        root[: len(IDENTIFIED)] = np.diag(self.prior.deviation)
        return CoefficientPrior(self.prior.source, mean, root)

    def errors(self, z: Floats, which: Integers) -> tuple[Floats, Floats]:
        """Errors of the simulated channels, and their slopes by z, of some segments.

        Each times the root of the share that its step has of the time over which errors
        are one error; shapes (n_samples, n_channels) and (n_samples, n_channels, 41).
        """
        step = 1e-4  # standard deviations of the prior
        known = self._sailed_with(z)
        missing = [index for index in which.tolist() if index not in known]
        if missing:
            ships = self._lanes(z, step)
        for index in missing:
            known[index] = self._weighted_errors(self.segments[index], ships)
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

    def _weighted_errors(self, segment: Segment, ships: Floats) -> Floats:
        """Errors of ships in a segment, by the root of their share."""
        names = self.blank.state_names
        columns = [names.index(name) for name in self.channels]
        used = 1 + len(IDENTIFIED)
        states = sail_lanes(
            self.blank,
            segment,
            ships=ships,
            starts=in_all_lanes(segment.start),
        )
        # at the first sample the ships have not moved yet
        simulated = states[1:, columns, :used]
        measured = segment.measured[1:, :, None]
        off = simulated - measured
        n_compared = len(off)
        share = self.independent_errors(segment) / n_compared
        return np.asarray(off * np.sqrt(share))

    def _lanes(self, z: Floats, step: float) -> Floats:
        """Numbers of ships; in each but the first a coefficient is larger by a step."""
        deviation = self.prior.deviation
        values = self.mean + z * deviation
        varied = np.arange(len(IDENTIFIED))
        lane = 1 + varied
        row = len(Ship._fields) + varied

        nominal = self.blank.ship_numbers()
        ships = in_all_lanes(nominal)
        ships[row] = values[:, None]
        ships[row, lane] += step * deviation
        return ships

    def independent_errors(self, segment: Segment) -> float:
        """Times over which errors are one error that a segment has."""
        correlated_lengths = 1.0  # over which errors are one error
        correlated = correlated_lengths * self.blank.travel_time
        return segment.duration / correlated

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
