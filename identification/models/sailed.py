"""Fits by the errors of ships in parts of trials, many ships at once, and a prior."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identification.least_squares import Linearised, fit_least_squares
from identification.models.segments import Segment
from identification.models.shooting import channel_units, in_columns, sail
from shipgym import ShipModel
from shipgym.arrays import Floats, Integers
from shipgym.engine.motion import Ship
from shipgym.ships import Structure

LARGEST = 1e3  # error of a ship that runs away, in scales


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


class Sailed:
    """Ships of given coefficients in parts of trials, by the measured rudder.

    Coefficients are points of the prior, in which a fit is nonlinear least squares:
    errors in their scales, then the distance from the prior times a strength (Maine &
    Iliff 1985, NASA RP-1138, 2.5, output error with prior). `which` are places of the
    parts that count, by default all.
    """

    def __init__(
        self,
        blank: ShipModel,
        channels: Sequence[str],
        prior: CoefficientPrior,
        parts: Sequence[Segment],
    ) -> None:
        self.blank = blank
        self.channels = channels  # that are compared
        self.prior = prior
        self.parts = parts
        self.of_trials = np.array([part.trial for part in parts])
        self.floors = least_scales(blank, channels)
        self._columns = [blank.state_names.index(name) for name in channels]
        self._rows, self._matrix = _number_map(blank)

    def model(self, point: Floats, covariance: Floats | None = None) -> ShipModel:
        """The model of a point, with a covariance of points."""
        values = self.prior.coefficients(point[None])[0]
        model = self.blank.with_coefficients(values)
        if covariance is None:
            return model
        return replace(
            model,
            covariance=self.prior.covariance(covariance),
            draws=None,
        )

    def n_errors(self, which: Integers | None = None) -> float:
        """Independent errors of a channel: one for each length that a ship sails."""
        parts = self._parts(which)
        return sum(self._lengths(part) for part in parts)

    def errors(self, points: Floats, which: Integers | None = None) -> Floats:
        """Errors of ships, by the root of their share of an independent error.

        Shape (n_samples, n_channels, n_points). Not finite where a ship ran away.
        """
        coefficients = self.prior.coefficients(points)
        ships = in_columns(self.blank.ship_numbers(), len(points))
        ships[self._rows] = self._matrix @ coefficients.T
        return np.concatenate(
            [self._errors(part, ships) for part in self._parts(which)]
        )

    def scales(self, point: Floats) -> Floats:
        """Root mean square error by channel, above the floors; not finite if lost."""
        with np.errstate(invalid="ignore", over="ignore"):  # of a ship that runs away
            squares = np.sum(self.errors(point[None]) ** 2, axis=(0, 2))
        return np.asarray(np.maximum(np.sqrt(squares / self.n_errors()), self.floors))

    def linearised(
        self, point: Floats, scales: Floats, which: Integers | None = None
    ) -> Linearised:
        """Errors in their scales, in a row, and their forward differences.

        Those of a ship that runs away are large, and have no slope.
        """
        step = 1e-4  # standard deviations of the prior
        points = np.vstack([point, point + step * np.eye(len(point))])
        with np.errstate(invalid="ignore", over="ignore"):
            lanes = self.errors(points, which) / scales[:, None]
            errors = lanes[:, :, 0]
            slopes = (lanes[:, :, 1:] - errors[:, :, None]) / step
        errors = np.clip(np.nan_to_num(errors, nan=LARGEST), -LARGEST, LARGEST)
        slopes = np.nan_to_num(
            slopes,
            posinf=0.0,
            neginf=0.0,
        )
        return Linearised(errors.ravel(), slopes.reshape(errors.size, -1))

    def most_probable(
        self,
        start: Floats,
        scales: Floats,
        strength: float,
        tolerance: float,
        which: Integers | None = None,
    ) -> Any:
        """The most probable point `x`, as `scipy.optimize.least_squares` returns it."""

        def cost(point: Floats) -> Linearised:
            return with_prior(self.linearised(point, scales, which), point, strength)

        return fit_least_squares(
            cost, start, ftol=tolerance, xtol=tolerance, max_nfev=30
        )

    def _parts(self, which: Integers | None) -> Sequence[Segment]:
        return self.parts if which is None else [self.parts[k] for k in which]

    def _lengths(self, part: Segment) -> float:
        """Times to sail a ship length, over which errors are one error."""
        return part.duration / self.blank.travel_time

    def _errors(self, part: Segment, ships: Floats) -> Floats:
        """Errors of ships, a column of numbers each, in a part, as in `errors`."""
        # the ships move on from their start, at the first sample
        starts = in_columns(part.start, ships.shape[1])
        simulated = sail(self.blank, part, ships, starts)[1:, self._columns]
        off = simulated - part.measured[1:, :, None]
        share = self._lengths(part) / len(off)
        return np.asarray(off * np.sqrt(share))


def with_prior(data: Linearised, point: Floats, strength: float) -> Linearised:
    """Errors in their scales, then the distance from the prior times a strength."""
    return Linearised(
        residuals=np.append(data.residuals, strength * point),
        jacobian=np.vstack([data.jacobian, strength * np.eye(len(point))]),
    )


def covariance_of(jacobian: Floats) -> Floats:
    """Gauss-Newton covariance of a point by slopes of errors, and the prior as it is.

    A stronger one chosen for the fit is no knowledge.
    """
    information = jacobian.T @ jacobian + np.eye(jacobian.shape[1])
    inverse = np.linalg.inv(information)
    return np.asarray(0.5 * (inverse + inverse.T))


def least_scales(ship: ShipModel, channels: Sequence[str]) -> Floats:
    """Least scales of errors by channel, SI units; of others that of the yaw rate.

    Velocities by service speed U0, yaw rate by U0 / L, heading in rad.
    """
    least = {"u": 0.0017, "v": 0.0017, "r": 0.0021, "psi": np.radians(0.1)}
    parts = np.array([least.get(name, least["r"]) for name in channels])
    return np.asarray(parts * channel_units(ship, channels))


def _number_map(blank: ShipModel) -> tuple[slice, Floats]:
    """Numbers of a ship that depend on her coefficients, and how, linearly."""
    n_coefficients = len(blank.coefficients)
    if isinstance(blank.dynamics, Structure):
        return slice(-n_coefficients, None), blank.acceleration_matrix
    first = len(Ship._fields)
    return slice(first, first + n_coefficients), np.eye(n_coefficients)
