"""Coordinates in which a posterior of curved least squares is nearly standard normal.

What the trials determine well depends on what they leave open, and not linearly:
walkers would have to follow narrow curved valleys. Second differences of the errors
tell how the valleys bend.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

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
