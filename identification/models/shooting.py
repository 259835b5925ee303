"""Errors of what a model simulates in segments of trials, and their slopes.

Multiple shooting (Bock 1983): whole trials would let a drift of heading leak into the
coefficients.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.models.segments import Segment
from shipgym import ShipModel
from shipgym.arrays import Floats, Integers
from shipgym.engine.compiled_ship import STILL_WATER
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import LANES
from shipgym.sea.open_sea import OPEN_SEA


@dataclass(frozen=True, eq=False)
class Shooting:
    """Errors of all segments at a set of parameters."""

    #: simulated less measured, by the scale of the channel, blocks averaged: those of
    #: all segments one after the other, the channels of a block together, shape
    #: (n_rows,)
    residuals: Floats
    jacobian: Floats  # shape (n_rows, n_parameters)
    moves: list[Floats]  # by segment: how its start would move, shape (n_free,)


class _LaneNumbers(NamedTuple):
    """Numbers of the ship, offset of the rudder and start that lanes sail with."""

    nominal: Floats  # shape (n_numbers + 1 + n_state,)
    varied: Integers  # places of those that have slopes, shape (n_varied,)
    units: Floats  # by which they vary, shape (n_varied,)


class Shooter:
    """Sails all segments with a model and with its neighbours, a lane each.

    The model gives the compiled accelerations and all but their coefficients;
    `channels` are compared; `term_sizes`, shape (n_coefficients,), are coefficients of
    the accelerations (SI) that stand for a parameter of 1; `free`: whether each
    segment's start is fitted with it, else the smoothed measurement.
    """

    def __init__(
        self,
        model: ShipModel,
        channels: Sequence[str],
        term_sizes: Floats,
        free: bool,
    ) -> None:
        self.model = model
        self.channels = tuple(channels)
        self.term_sizes = term_sizes
        self.columns = [model.state_names.index(name) for name in channels]
        self.free = self.columns if free else []
        self.numbers = model.ship_numbers()
        self.units = channel_units(model, channels)

    @property
    def start_units(self) -> Floats:
        """Units in which the starts of segments move, shape (n_free,)."""
        return self.units[: len(self.free)]

    def split(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Coefficients of the accelerations, SI units, and offsets of the rudder, rad.

        `parameters`: as for `shoot`.
        """
        n_terms = len(self.term_sizes)
        coefficients = parameters[:n_terms] * self.term_sizes
        offsets = about_mean(parameters[n_terms:])
        return coefficients, offsets

    def shoot(
        self, parameters: Floats, segments: Sequence[Segment], scales: Floats
    ) -> Shooting:
        """Residuals and Jacobian at some parameters, without what the starts explain.

        The residual of a segment that may choose its start is what a linear step of the
        start leaves (variable projection, Golub & Pereyra 1973, SIAM J. Numer. Anal.
        10(2), with the Jacobian of Kaufman 1975). `parameters`: coefficients by
        `term_sizes`, then offsets of the rudder, rad, of the first trials or of none,
        of which only the differences from their mean matter, shape (n_coefficients +
        n_offsets,); `scales`: residuals that count as 1, shape (n_channels,). Not
        finite where a ship ran away.
        """
        coefficients, offsets = self.split(parameters)
        n_offsets = len(offsets)
        n_free = len(self.free)

        residuals, jacobians, moves = [], [], []
        for segment in segments:
            trial = segment.trial
            offset = 0.0
            if trial < n_offsets:
                offset = float(offsets[trial])
            errors, slopes = self._block_errors(coefficients, offset, segment, scales)
            residual, slopes, move = without_start(errors, slopes, n_free)
            residuals.append(residual)
            jacobians.append(self._jacobian(slopes, trial, n_offsets))
            moves.append(move)
        return Shooting(
            residuals=np.concatenate(residuals),
            jacobian=np.concatenate(jacobians),
            moves=moves,
        )

    def _jacobian(self, slopes: Floats, trial: int, n_offsets: int) -> Floats:
        """Slopes by all parameters from those by coefficients and the own offset."""
        n_terms = len(self.term_sizes)
        n_rows = len(slopes)
        jacobian = np.zeros((n_rows, n_terms + n_offsets))
        jacobian[:, :n_terms] = slopes[:, :n_terms]
        if trial < n_offsets:
            about_others = about_mean(np.eye(n_offsets))
            by_offset = slopes[:, n_terms]
            jacobian[:, n_terms:] = np.outer(by_offset, about_others[trial])
        return jacobian

    def moved(
        self, segments: Sequence[Segment], moves: Sequence[Floats]
    ) -> list[Segment]:
        """The segments with their starts moved."""
        found = []
        for segment, move in zip(segments, moves, strict=True):
            step = move * self.start_units
            start = segment.start.copy()
            start[self.free] += step
            found.append(replace(segment, start=start))
        return found

    def _block_errors(
        self, coefficients: Floats, offset: float, segment: Segment, scales: Floats
    ) -> tuple[Floats, Floats]:
        """Errors of a segment averaged over blocks, and their slopes, in scales.

        Shapes (n_rows,) and (n_rows, n_coefficients + 1 + n_free).
        """
        blocks = segment.blocks
        counts = segment.block_sizes
        weights = np.sqrt(segment.weight * counts)
        factors = weights[:, None] / scales

        channels, slopes = self._channels(coefficients, offset, segment)
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
            errors = channels - segment.measured
            errors = factors * averaged(errors, blocks, counts)
            slopes = factors[:, :, None] * averaged(slopes, blocks, counts)
        return errors.ravel(), slopes.reshape(errors.size, -1)

    def _channels(
        self, coefficients: Floats, offset: float, segment: Segment
    ) -> tuple[Floats, Floats]:
        """Simulated channels, and their slopes by parameter, rudder offset and start.

        Forward differences of parameters that are about 1: in each lane but the first
        one number of the ship, the offset or the start is larger by a step.
        """
        numbers = self._lane_numbers(coefficients, offset, segment)
        step = 1e-5
        parts = []
        for begin in range(0, len(numbers.varied), LANES - 1):
            batch = slice(begin, begin + LANES - 1)
            rows = numbers.varied[batch]
            lane = 1 + np.arange(len(rows))
            lanes = in_all_lanes(numbers.nominal)
            lanes[rows, lane] += step * numbers.units[batch]

            sailed = self._sailed(segment, lanes)
            channels = sailed[:, :, 0]
            with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
                changes = sailed[:, :, lane] - channels[:, :, None]
                parts.append(changes / step)
        return channels, np.concatenate(parts, axis=2)

    def _lane_numbers(
        self, coefficients: Floats, offset: float, segment: Segment
    ) -> _LaneNumbers:
        """Numbers to sail with; those that have slopes are the ones that are fitted."""
        n_numbers = len(self.numbers)
        first_term = n_numbers - len(coefficients)  # the terms' numbers come last
        nominal = np.concatenate([self.numbers, [offset], segment.start])
        nominal[first_term:n_numbers] = coefficients

        first_start = n_numbers + 1
        terms_and_offset = np.arange(first_term, first_start)
        starts = [first_start + column for column in self.free]
        return _LaneNumbers(
            nominal=nominal,
            varied=np.append(terms_and_offset, starts).astype(int),
            units=np.concatenate([self.term_sizes, [1.0], self.start_units]),
        )

    def _sailed(self, segment: Segment, lanes: Floats) -> Floats:
        """Compared channels of all lanes, shape (n_samples, n_channels, LANES).

        `lanes`: numbers of the ships, offset and start, a column for each lane.
        """
        n_numbers = len(self.numbers)
        states = sail_lanes(
            self.model,
            segment,
            ships=lanes[:n_numbers],
            starts=lanes[n_numbers + 1 :],
            offsets=lanes[n_numbers],
        )
        return np.asarray(states[:, self.columns])


def channel_units(model: ShipModel, channels: Sequence[str]) -> Floats:
    """Units in which channels are compared, shape (n_channels,).

    Service speed, that by ship length, and 1 rad.
    """
    speed = model.particulars["speed"]
    rate = speed / model.particulars["length"]
    units = {"u": speed, "v": speed, "r": rate, "p": rate, "psi": 1.0}
    return np.array([units[name] for name in channels])


def sail_lanes(
    model: ShipModel,
    segment: Segment,
    ships: Floats,
    starts: Floats,
    offsets: Floats,
) -> Floats:
    """States of the ships of all lanes at the samples of a segment.

    Numbers of the ships and states at the start, a column for each lane, and offsets of
    their rudders, rad. Shape (n_samples, n_state, LANES).
    """
    loop = ship_loop(
        model.compiled, "segments", OPEN_SEA if segment.has_wind else STILL_WATER
    )
    n_samples = len(segment.measured)
    states = np.empty((n_samples, starts.size))
    loop(
        starts.ravel(),
        ships.ravel(),
        offsets,
        segment.inputs,
        segment.samples,
        states,
    )
    return states.reshape(n_samples, -1, LANES)


def in_all_lanes(values: Floats) -> Floats:
    """The same values in a column for each lane, shape (n_values, LANES)."""
    return np.repeat(values, LANES).reshape(-1, LANES)


def about_mean(values: Floats) -> Floats:
    """Values less their mean along the first axis."""
    if not len(values):
        return values
    return np.asarray(values - values.mean(axis=0))


def averaged(values: Floats, blocks: Integers, counts: Integers) -> Floats:
    """Means over blocks along the first axis, from their first samples and sizes."""
    sums = np.add.reduceat(values, blocks)
    sizes = np.expand_dims(counts, tuple(range(1, values.ndim)))
    return np.asarray(sums / sizes)


def without_start(
    residual: Floats, slopes: Floats, n_free: int
) -> tuple[Floats, Floats, Floats]:
    """Residuals and slopes without what a move of the start explains, and that move.

    The last `n_free` columns of the slopes are those by the start. Of a ship that ran
    away nothing is taken out.
    """
    if not n_free:
        return residual, slopes, np.zeros(0)

    others = slopes[:, :-n_free]
    by_start = slopes[:, -n_free:]
    finite = np.isfinite(slopes).all() and np.isfinite(residual).all()
    if not finite:
        return residual, others, np.zeros(n_free)

    q, r = np.linalg.qr(by_start)
    explained = q.T @ residual
    move, *_ = np.linalg.lstsq(r, -explained, rcond=1e-10)
    residual = residual - q @ explained
    others = others - q @ (q.T @ others)
    return residual, others, move
