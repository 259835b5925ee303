"""Prior times the likelihood of whole trials to a power.

A coarsened posterior (Miller & Dunson 2019, Journal of the American Statistical
Association 114): equations that are not the ship's make errors that are not noise.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.judging.quadratic_map import QuadraticMap, quadratic_map
from identification.models.whole_trials import WholeTrials
from shipgym import ShipModel
from shipgym.arrays import Flags, Floats


class Mode(NamedTuple):
    """The most probable point, and the Gauss-Newton covariance there."""

    point: Floats
    covariance: Floats


@dataclass(frozen=True, eq=False)
class CoarsenedPosterior:
    """Prior times the likelihood of whole trials to a power."""

    trials: WholeTrials
    scales: Floats  # of the errors by channel
    power: float

    @property
    def all_parts(self) -> Flags:
        """Parts of all trials."""
        return np.ones(len(self.trials.parts), dtype=np.bool_)

    def log_density(self, points: Floats, kept: Flags | None = None) -> Floats:
        """Logarithm of the density but for a constant, shape (n_points,)."""
        if kept is None:
            kept = self.all_parts
        misfits = self.trials.misfits(points, self.scales, kept)
        from_prior = np.sum(points**2, axis=1)
        return np.asarray(-0.5 * (self.power * misfits + from_prior))

    def mode(self, start: Floats, kept: Flags | None = None) -> Mode:
        """The most probable point by Gauss-Newton steps; `kept` are parts of trials."""
        if kept is None:
            kept = self.all_parts
        point = start
        lengths = 0.5 ** np.arange(12)
        best = float(self.log_density(point[None], kept)[0])
        for _ in range(10):
            covariance, gradient = self._quadratic(point, kept)
            step = covariance @ gradient
            reached = point - lengths[:, None] * step
            values = self.log_density(reached, kept)
            taken = int(values.argmax())
            value = float(values[taken])
            gain = value - best
            if gain > 0.0:
                point = reached[taken]
                best = value
            if gain < 1e-2:
                break
        covariance, _ = self._quadratic(point, kept)
        return Mode(point, covariance)

    def map(self, mode: Mode) -> QuadraticMap:
        """Coordinates in which the density is nearly standard normal."""
        root = np.sqrt(self.power)
        kept = self.all_parts
        slopes = self.trials.slopes(mode.point, self.scales, kept)
        jacobian = root * slopes.jacobian

        def errors(points: Floats) -> Floats:
            scaled = self.trials.scaled_errors(points, self.scales, kept)
            return np.asarray(root * scaled)

        return quadratic_map(mode.point, jacobian.T @ jacobian, jacobian, errors)

    def _quadratic(self, point: Floats, kept: Flags) -> tuple[Floats, Floats]:
        """Gauss-Newton covariance, and gradient of minus the log density."""
        errors, jacobian = self.trials.slopes(point, self.scales, kept)
        information = self.power * jacobian.T @ jacobian + np.eye(len(point))
        gradient = self.power * jacobian.T @ errors + point
        inverse = np.linalg.inv(information)
        return 0.5 * (inverse + inverse.T), gradient

    def model(self, mode: Mode) -> ShipModel:
        """The model of a mode, with its covariance."""
        prior = self.trials.prior
        values = prior.coefficients(mode.point[None])[0]
        model = self.trials.blank.with_coefficients(values)
        return replace(model, covariance=prior.covariance(mode.covariance), draws=None)
