"""Errors of what a model simulates in segments of trials, and their slopes.

Multiple shooting (Bock 1983): whole trials would let a drift of heading leak into the
coefficients.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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


class Shooter:
    """Sails all segments with a model and with its neighbours, a lane each.

    The model gives the compiled accelerations and all but their coefficients;
    `channels` are compared, and each segment's start is fitted in them; `term_sizes`,
    shape (n_coefficients,), are coefficients of the accelerations (SI) that stand for a
    parameter of 1.
    """

    def __init__(
        self, model: ShipModel, channels: Sequence[str], term_sizes: Floats
    ) -> None:
        self.model = model
        self.channels = tuple(channels)
        self.term_sizes = term_sizes
        self.columns = [model.state_names.index(name) for name in channels]
        self.numbers = model.ship_numbers()
        self.units = channel_units(model, channels)

    def shoot(
        self, parameters: Floats, segments: Sequence[Segment], scales: Floats
    ) -> Shooting:
        """Residuals and Jacobian at some parameters, without what the starts explain.

        The residual of a segment is what a linear step of its start leaves (variable
        projection, Golub & Pereyra 1973, SIAM J. Numer. Anal. 10(2), with the Jacobian
        of Kaufman 1975). `parameters`: coefficients by `term_sizes`, shape
        (n_coefficients,); `scales`: residuals that count as 1, shape (n_channels,). Not
        finite where a ship ran away.
        """
        coefficients = parameters * self.term_sizes
        residuals, jacobians, moves = [], [], []
        for segment in segments:
            errors, slopes = self._block_errors(coefficients, segment, scales)
            residual, slopes, move = without_start(errors, slopes, len(self.columns))
            residuals.append(residual)
            jacobians.append(slopes)
            moves.append(move)
        return Shooting(
            residuals=np.concatenate(residuals),
            jacobian=np.concatenate(jacobians),
            moves=moves,
        )

    def moved(
        self, segments: Sequence[Segment], moves: Sequence[Floats]
    ) -> list[Segment]:
        """The segments with their starts moved."""
        found = []
        for segment, move in zip(segments, moves, strict=True):
            start = segment.start.copy()
            start[self.columns] += move * self.units
            found.append(replace(segment, start=start))
        return found

    def _block_errors(
        self, coefficients: Floats, segment: Segment, scales: Floats
    ) -> tuple[Floats, Floats]:
        """Errors of a segment averaged over blocks, and their slopes, in scales.

        Shapes (n_rows,) and (n_rows, n_coefficients + n_channels).
        """
        blocks = segment.blocks
        counts = segment.block_sizes
        factors = np.sqrt(counts)[:, None] / scales

        channels, slopes = self._channels(coefficients, segment)
        with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
            errors = channels - segment.measured
            errors = factors * averaged(errors, blocks, counts)
            slopes = factors[:, :, None] * averaged(slopes, blocks, counts)
        return errors.ravel(), slopes.reshape(errors.size, -1)

    def _channels(
        self, coefficients: Floats, segment: Segment
    ) -> tuple[Floats, Floats]:
        """Simulated channels, and their slopes by parameter and start.

        Forward differences of parameters that are about 1: in each lane but the first
        one number of the ship or the start is larger by a step.
        """
        n_numbers = len(self.numbers)
        first_term = n_numbers - len(coefficients)  # the terms' numbers come last
        nominal = np.concatenate([self.numbers, segment.start])
        nominal[first_term:n_numbers] = coefficients
        starts = [n_numbers + column for column in self.columns]
        varied = np.append(np.arange(first_term, n_numbers), starts).astype(int)
        units = np.concatenate([self.term_sizes, self.units])

        step = 1e-5
        parts = []
        for begin in range(0, len(varied), LANES - 1):
            rows = varied[begin : begin + LANES - 1]
            lane = 1 + np.arange(len(rows))
            lanes = in_all_lanes(nominal)
            lanes[rows, lane] += step * units[begin : begin + LANES - 1]

            ships, begun = lanes[:n_numbers], lanes[n_numbers:]
            sailed = sail_lanes(self.model, segment, ships, begun)[:, self.columns]
            channels = sailed[:, :, 0]
            with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
                changes = sailed[:, :, lane] - channels[:, :, None]
                parts.append(changes / step)
        return channels, np.concatenate(parts, axis=2)


def channel_units(model: ShipModel, channels: Sequence[str]) -> Floats:
    """Units in which channels are compared, shape (n_channels,).

    Service speed, that by ship length, and 1 rad.
    """
    speed = model.particulars["speed"]
    rate = speed / model.particulars["length"]
    units = {"u": speed, "v": speed, "r": rate, "p": rate, "psi": 1.0}
    return np.array([units[name] for name in channels])


def sail_lanes(
    model: ShipModel, segment: Segment, ships: Floats, starts: Floats
) -> Floats:
    """States of the ships of all lanes at the samples of a segment.

    Numbers of the ships and states at the start, a column for each lane. Shape
    (n_samples, n_state, LANES).
    """
    loop = ship_loop(
        model.compiled, "segments", OPEN_SEA if segment.has_wind else STILL_WATER
    )
    n_samples = len(segment.measured)
    states = np.empty((n_samples, starts.size))
    loop(
        starts.ravel(),
        ships.ravel(),
        np.zeros(LANES),  # offsets of the rudders
        segment.inputs,
        segment.samples,
        states,
    )
    return states.reshape(n_samples, -1, LANES)


def in_all_lanes(values: Floats) -> Floats:
    """The same values in a column for each lane, shape (n_values, LANES)."""
    return np.repeat(values, LANES).reshape(-1, LANES)


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
