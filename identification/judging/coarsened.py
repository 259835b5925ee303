"""Prior times the likelihood of whole trials to a power.

A coarsened posterior (Miller & Dunson 2019, Journal of the American Statistical
Association 114): equations that are not the ship's make errors that are not noise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.models.sailed import Sailed, covariance_of
from shipgym import ShipModel
from shipgym.arrays import Floats, Integers


@dataclass(frozen=True, eq=False)
class QuadraticMap:
    """Map from nearly standard normal coordinates to the points of a posterior.

    An axis bends by products of coordinates along axes that are less determined than
    it. So its Jacobian is triangular, and its determinant constant: a density in these
    coordinates is that of the points.
    """

    mode: Floats
    axes: Floats  # columns, from the least determined to the most
    #: coordinates of each product, both less than that of the axis that bends
    first: Integers
    second: Integers
    bends: Floats  # shape (n_products, n_parameters)

    def points(self, coordinates: Floats) -> Floats:
        """Points of coordinates, both of shape (n_points, n_parameters)."""
        products = coordinates[:, self.first] * coordinates[:, self.second]
        bent = coordinates + products @ self.bends
        return np.asarray(self.mode + bent @ self.axes.T)


def quadratic_map(
    mode: Floats,
    jacobian: Floats,
    errors: Callable[[Floats], Floats],
) -> QuadraticMap:
    """The map about a mode, with unit normal prior.

    `jacobian` is that of the errors at the mode; `errors` gives them at points, shape
    (n_rows, n_points), in units of which the squares are the data's part of the
    density.
    """
    determined, directions = np.linalg.eigh(jacobian.T @ jacobian)
    axes = directions / np.sqrt(np.maximum(determined, 0.0) + 1.0)
    along = jacobian @ axes

    def steps(coordinates: Floats) -> Floats:
        """Gauss-Newton steps of each coordinate, shape (n_points, n_parameters)."""
        return np.asarray(-errors(mode + coordinates @ axes.T).T @ along)

    n_parameters = len(mode)
    first, second = np.triu_indices(n_parameters)
    bends = _second_differences(steps, first, second)
    # an axis bends by those before it alone
    later = second[:, None] >= np.arange(n_parameters)
    bends[later] = 0.0
    counts = np.abs(bends).max(axis=1) > 1e-3
    return QuadraticMap(mode, axes, first[counts], second[counts], bends[counts])


def _second_differences(
    steps: Callable[[Floats], Floats], first: Integers, second: Integers
) -> Floats:
    """Coefficients of the products of coordinates in Gauss-Newton steps.

    Central differences over a distance of 1; 0 where a ship is lost on the way.
    """
    n_parameters = int(second.max()) + 1
    units = np.eye(n_parameters)
    with np.errstate(invalid="ignore", over="ignore"):  # of ships that run away
        middle = steps(np.zeros((1, n_parameters)))
        single = steps(units) + steps(-units) - 2.0 * middle
        corners = units[first] + units[second]
        both = steps(corners) + steps(-corners) - 2.0 * middle
        bends = 0.5 * (both - single[first] - single[second])
    squared = first == second
    bends[squared] = 0.5 * single
    return np.nan_to_num(bends, posinf=0.0, neginf=0.0)


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
