"""Errors of ships of given coefficients in parts of trials, many ships at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.models.segments import Segment
from identification.models.shooting import channel_units, in_all_lanes, sail_lanes
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES
from shipgym.ships import Structure


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

    Coefficients are points of the prior.
    """

    def __init__(
        self, blank: ShipModel, channels: Sequence[str], prior: CoefficientPrior
    ) -> None:
        self.blank = blank
        self.channels = channels  # that are compared
        self.prior = prior
        self.floors = least_scales(blank, channels)
        self._columns = [blank.state_names.index(name) for name in channels]
        self._rows, self._matrix = _number_map(blank)

    def independent_errors(self, part: Segment) -> float:
        """Times to sail a ship length, over which errors are one error."""
        return part.duration / self.blank.travel_time

    def ships(self, points: Floats) -> Floats:
        """Numbers of ships, a column for each point."""
        coefficients = self.prior.coefficients(points)
        numbers = self.blank.ship_numbers()
        ships = np.repeat(numbers[:, None], len(points), axis=1)
        ships[self._rows] = self._matrix @ coefficients.T
        return ships

    def errors_in(self, part: Segment, ships: Floats) -> Floats:
        """Errors of ships in a part, by the root of their share.

        A share is that of a sample in the time over which errors are one error. Shape
        (n_samples, n_channels, n_ships). Not finite where a ship ran away.
        """
        tiles = []
        for begin in range(0, ships.shape[1], LANES):
            tile = ships[:, begin : begin + LANES]
            n_ships = tile.shape[1]
            spare = np.repeat(tile[:, -1:], LANES - n_ships, axis=1)
            starts = in_all_lanes(part.start)  # the ships move on from them
            states = sail_lanes(self.blank, part, np.hstack([tile, spare]), starts)
            # at the first sample the ships have not moved yet
            simulated = states[1:, self._columns, :n_ships]
            tiles.append(simulated - part.measured[1:, :, None])
        off = np.concatenate(tiles, axis=2)
        share = self.independent_errors(part) / len(off)
        return np.asarray(off * np.sqrt(share))


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
