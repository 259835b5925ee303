"""Normal distribution of coefficients before the trials."""

from dataclasses import dataclass

import numpy as np

from shipgym.arrays import Floats


@dataclass(frozen=True, eq=False)
class CoefficientPrior:
    """Normal distribution of the coefficients before the trials.

    A point has the coefficients in numbers that are independent and of standard
    deviation 1 before the trials, shape (n_parameters,).
    """

    source: str  # in words
    mean: Floats  # shape (n_coefficients,)
    root: Floats  # of the covariance, shape (n_coefficients, n_parameters)

    @property
    def n_parameters(self) -> int:
        """Directions in which the coefficients are uncertain."""
        return int(self.root.shape[1])

    @property
    def deviations(self) -> Floats:
        """Standard deviation of each coefficient, shape (n_coefficients,)."""
        return np.asarray(np.sqrt(np.sum(self.root**2, axis=1)))

    def coefficients(self, points: Floats) -> Floats:
        """Coefficients at points, shape (n_points, n_coefficients)."""
        return np.asarray(self.mean + points @ self.root.T)

    def covariance(self, of_points: Floats) -> Floats:
        """Covariance of the coefficients from that of points."""
        return np.asarray(self.root @ of_points @ self.root.T)
