"""Prior times the likelihood of whole trials to a power.

A coarsened posterior (Miller & Dunson 2019, Journal of the American Statistical
Association 114): equations that are not the ship's make errors that are not noise.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.judging.quadratic_map import QuadraticMap, quadratic_map
from identification.models.sailed import Sailed, covariance_of
from shipgym import ShipModel
from shipgym.arrays import Floats, Integers


class Mode(NamedTuple):
    """The most probable point, and the Gauss-Newton covariance there."""

    point: Floats
    covariance: Floats


@dataclass(frozen=True, eq=False)
class CoarsenedPosterior:
    """Prior times the likelihood of whole trials to a power."""

    trials: Sailed
    scales: Floats  # of the errors by channel
    power: float

    def errors(self, points: Floats) -> Floats:
        """Errors whose squares are twice minus the log likelihood by its power.

        Shape (n_rows, n_points); not finite where a ship is lost.
        """
        root = np.sqrt(self.power)
        with np.errstate(invalid="ignore", over="ignore"):
            errors = root * self.trials.errors(points) / self.scales[:, None]
        return np.asarray(errors.reshape(-1, len(points)))

    def log_density(self, points: Floats) -> Floats:
        """Logarithm of the density but for a constant, shape (n_points,)."""
        errors = self.errors(points)
        with np.errstate(invalid="ignore", over="ignore"):
            misfits = np.einsum("ij,ij->j", errors, errors)
        squares = misfits + np.sum(points**2, axis=1)
        return np.asarray(-0.5 * np.nan_to_num(squares, nan=np.inf))

    def mode(self, start: Floats, which: Integers | None = None) -> Mode:
        """The most probable point; `which` are places of the parts that count."""
        fit = self.trials.most_probable(
            start,
            self.scales,
            strength=1.0 / np.sqrt(self.power),
            tolerance=1e-4,
            which=which,
        )
        of_data = fit.jac[: -len(start)]
        return Mode(fit.x, covariance_of(np.sqrt(self.power) * of_data))

    def map(self, mode: Mode) -> QuadraticMap:
        """Coordinates in which the density is nearly standard normal."""
        data = self.trials.linearised(mode.point, self.scales)
        return quadratic_map(
            mode.point, np.sqrt(self.power) * data.jacobian, self.errors
        )

    def model(self, mode: Mode) -> ShipModel:
        """The model of a mode, with its covariance."""
        return self.trials.model(mode.point, mode.covariance)
