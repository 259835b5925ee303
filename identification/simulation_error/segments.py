"""Stretches of trials that a model sails from a start of their own: multiple shooting."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.regression import preprocess
from identification.regression.rudder import Rudder, rebuild, straight
from identification.regression.samples import between_gaps
from shipgym import ShipModel, Trial
from shipgym.arrays import Floats, Integers
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import LANES
from shipgym.ships import Structure
from shipgym.ships.simulate import LONGEST_STEP, wind_accelerations

STEP = 1e-5  # of finite differences, of parameters that are about 1
BLOCK = 0.05  # time over which residuals are averaged, of that to sail one ship length
FEWEST_SAMPLES = 5


@dataclass(frozen=True, eq=False)
class Segment:
    """A stretch of a trial."""

    trial: int  # index of the trial
    #: time, s, rudder, rad, shaft speed, 1/s, and the accelerations in surge, sway and
    #: yaw by wind, on the grid of the integration, shape (n_points, 6)
    inputs: Floats
    samples: (
        Integers  # sample at each point of the grid, -1 for none, shape (n_points,)
    )
    measured: Floats  # what is compared with, shape (n_samples, n_channels)
    # first sample of each block over which residuals are averaged, shape (n_blocks,)
    blocks: Integers
    times: Floats  # when the blocks begin, s, shape (n_blocks,)
    # state at the first sample, in the order of the model's `state_names`, shape
    # (n_state,)
    start: Floats
    weight: float = 1.0  # of its squared residuals


def compared_channels(model: ShipModel, trials: Sequence[Trial]) -> tuple[str, ...]:
    """Channels whose residuals are minimised: velocities that the model has equations of, and heading."""
    velocities = _velocities(model)
    heading = "r" in velocities and all("psi" in trial for trial in trials)
    return velocities + (("psi",) if heading else ())


def _velocities(model: ShipModel) -> tuple[str, ...]:
    """Those that the model has equations of."""
    table = model.dynamics
    return tuple(table.equations) if isinstance(table, Structure) else ("u", "v", "r")


def cut(
    trials: Sequence[Trial],
    model: ShipModel,
    channels: Sequence[str],
    lengths: float,
    staggered: bool,
    interval: float = 0.0,
) -> list[Segment]:
    """Cut trials into segments, and, staggered, again into a set that begins half a segment later.

    A gap in time ends a segment. A segment is the time to sail so many ship `lengths`
    at service speed; it starts from the smoothed state. Compared are samples at least
    an `interval` apart, in ship lengths; where it is 0, all.
    """
    travel = model.travel_time
    segments = []
    for index, trial in enumerate(trials):
        for piece in between_gaps(trial, model.particulars):
            t, delta, states = piece.t, piece["delta"], _states(piece, model)
            noisy = preprocess.is_noisy(t, (piece[q] for q in _velocities(model)))
            rudder = straight(t, delta) if noisy else rebuild(t, delta, model.steering)
            every = max(int(interval * travel / np.median(np.diff(t)) + 1e-9), 1)
            for shift in (0.0, 0.5) if staggered else (0.0,):
                edges = _edges(t, lengths * travel, shift)
                segments += [
                    _segment(piece, index, rows, states, channels, rudder, model)
                    for rows in map(
                        slice, edges[:-1], edges[1:] + 1, [every] * len(edges)
                    )
                ]
    return segments


def _edges(t: Floats, duration: float, shift: float) -> Integers:
    """First samples of the segments, and the last sample; the last segment may be half as long again."""
    if shift * duration >= t[-1] - t[0]:
        return np.zeros(0, dtype=np.int64)
    count = max(round((t[-1] - t[0]) / duration - shift), 1)
    times = (
        t[0]
        + shift * duration
        + np.arange(count) * (t[-1] - t[0] - shift * duration) / count
    )
    edges = np.append(np.searchsorted(t, times), len(t) - 1)
    apart = np.append(np.diff(edges) >= FEWEST_SAMPLES, True)
    apart[0] = True
    return np.asarray(edges[apart] if len(t) > FEWEST_SAMPLES else edges[[0, -1]])


def _states(trial: Trial, model: ShipModel) -> Floats:
    """States along a trial, smoothed, shape (n_samples, n_state)."""
    states = np.zeros((len(trial), len(model.state_names)))
    for k, name in enumerate(model.state_names):
        if name in trial and name not in ("x", "y"):
            exact = name in ("delta", "n")
            states[:, k] = (
                trial[name] if exact else preprocess.smooth(trial.t, trial[name])
            )
    return states


def _segment(
    trial: Trial,
    index: int,
    rows: slice,
    states: Floats,
    channels: Sequence[str],
    rudder: Rudder,
    model: ShipModel,
) -> Segment:
    t, travel = trial.t[rows], model.travel_time
    steps = np.maximum(np.ceil(np.diff(t) / (LONGEST_STEP * travel) - 1e-9), 1).astype(
        int
    )
    parts = [
        a + (b - a) * np.arange(n) / n
        for a, b, n in zip(t[:-1], t[1:], steps, strict=True)
    ]
    inside = rudder.corners[(rudder.corners > t[0]) & (rudder.corners < t[-1])]
    times = np.union1d(np.concatenate([*parts, t[-1:]]), inside)
    samples = np.full(len(times), -1)
    samples[np.searchsorted(times, t)] = np.arange(len(t))
    n = np.interp(times, trial.t, trial["n"]) if "n" in trial else np.zeros(len(times))
    wind = [
        np.interp(times, trial.t, row)
        for row in wind_accelerations(trial, model.dynamics).T
    ]
    inputs = np.column_stack([times, rudder(times), n, *wind])
    measured = np.column_stack([trial[name][rows] for name in channels])
    blocks = np.arange(0, len(t), max(int(BLOCK * travel / np.median(np.diff(t))), 1))
    return Segment(
        index, inputs, samples, measured, blocks, t[blocks], states[rows.start]
    )


@dataclass(frozen=True, eq=False)
class Shooting:
    """What the segments of all trials say of a set of parameters."""

    #: simulated less measured, by the scale of the channel, blocks averaged: those of
    #: all segments one after the other, the channels of a block together, shape
    #: (n_rows,)
    residuals: Floats
    jacobian: Floats  # shape (n_rows, n_parameters)
    moves: list[Floats]  # by segment: how its start would move, shape (n_free,)


class Shooter:
    """Sails all segments with a model and with its neighbours, a lane each.

    The model gives the compiled accelerations and all but their coefficients;
    `channels` are compared; `term_sizes`, shape (n_coefficients,), are coefficients of
    the accelerations (SI) that stand for a parameter of 1; `free`: whether each
    segment's start is fitted with it, else the smoothed measurement.
    """

    def __init__(
        self, model: ShipModel, channels: Sequence[str], term_sizes: Floats, free: bool
    ) -> None:
        self.model, self.channels, self.sizes = model, tuple(channels), term_sizes
        self.columns = [model.state_names.index(name) for name in channels]
        self.free = self.columns if free else []
        self.numbers = model.ship_numbers()
        self.units = channel_units(model, channels)

    def shoot(
        self, parameters: Floats, segments: Sequence[Segment], scales: Floats
    ) -> Shooting:
        """Residuals and Jacobian at some parameters, the starts of the segments projected out.

        The residual of a segment that may choose its start is what a linear step of the
        start leaves (variable projection, Golub & Pereyra 1973, SIAM J. Numer. Anal.
        10(2), with the Jacobian of Kaufman 1975). `parameters`: coefficients by
        `term_sizes`, then offsets of the rudder, rad, of the first trials or of none,
        of which only the differences from their mean matter, shape (n_coefficients +
        n_offsets,); `scales`: residuals that count as 1, shape (n_channels,). Not
        finite where a ship ran away.
        """
        residuals, jacobians, moves, n_terms = [], [], [], len(self.sizes)
        offsets = about_mean(parameters[n_terms:])
        shares = about_mean(np.eye(len(offsets)))
        for segment in segments:
            offset = offsets[segment.trial] if segment.trial < len(offsets) else 0.0
            nominal, slopes = self._slopes(parameters[:n_terms], offset, segment)
            counts = np.diff(segment.blocks, append=len(segment.measured))
            factor = np.sqrt(segment.weight * counts)[:, None] / scales
            value = (
                averaged(nominal - segment.measured, segment.blocks, counts) * factor
            ).ravel()
            slope = averaged(slopes, segment.blocks, counts) * factor[:, :, None]
            slope = slope.reshape(len(value), -1)
            value, slope, move = _without_start(value, slope, len(self.free))
            jacobian = np.zeros((len(value), len(parameters)))
            jacobian[:, :n_terms] = slope[:, :n_terms]
            if segment.trial < len(offsets):
                jacobian[:, n_terms:] = np.outer(
                    slope[:, n_terms], shares[segment.trial]
                )
            residuals.append(value)
            jacobians.append(jacobian)
            moves.append(move)
        return Shooting(np.concatenate(residuals), np.concatenate(jacobians), moves)

    def moved(
        self, segments: Sequence[Segment], moves: Sequence[Floats]
    ) -> list[Segment]:
        """The segments with their starts moved."""
        found = []
        for segment, move in zip(segments, moves, strict=True):
            start = segment.start.copy()
            start[self.free] += move * self.units[: len(self.free)]
            found.append(replace(segment, start=start))
        return found

    def _slopes(
        self, parameters: Floats, offset: float, segment: Segment
    ) -> tuple[Floats, Floats]:
        """Simulated channels, and their derivatives by coefficients, rudder offset and start."""
        n = len(self.numbers)
        given = np.concatenate([self.numbers, [offset], segment.start])
        given[n - len(parameters) : n] = (
            parameters * self.sizes
        )  # the terms' numbers come last
        places = [
            *range(n - len(parameters), n + 1),
            *(n + 1 + column for column in self.free),
        ]
        steps = STEP * np.concatenate([self.sizes, [1.0], self.units[: len(self.free)]])
        slopes = np.empty((len(segment.measured), len(self.channels), len(places)))
        nominal = np.empty(slopes.shape[:2])
        for begin in range(0, len(places), LANES - 1):
            some = slice(begin, begin + LANES - 1)
            lanes = np.repeat(given, LANES).reshape(-1, LANES)
            at = 1 + np.arange(len(places[some]))
            lanes[places[some], at] += steps[some]
            found = sailed(self.model, segment, lanes[:n], lanes[n + 1 :], lanes[n])[
                :, self.columns
            ]
            nominal = found[:, :, 0]
            with np.errstate(invalid="ignore", over="ignore"):  # of ships that ran away
                slopes[:, :, some] = (found[:, :, at] - nominal[:, :, None]) / STEP
        return nominal, slopes


def channel_units(model: ShipModel, channels: Sequence[str]) -> Floats:
    """What channels are compared by: service speed, that by ship length, and 1 rad, shape (n_channels,)."""
    speed, rate = (
        model.particulars["speed"],
        model.particulars["speed"] / model.particulars["length"],
    )
    units = {"u": speed, "v": speed, "r": rate, "p": rate, "psi": 1.0}
    return np.array([units[name] for name in channels])


def sailed(
    model: ShipModel, segment: Segment, ships: Floats, starts: Floats, offsets: Floats
) -> Floats:
    """States of the ships of all lanes at the samples of a segment, shape (n_samples, n_state, LANES).

    Numbers of the ships and states at the start, a column for each lane, and offsets of
    their rudders, rad.
    """
    out = np.empty((len(segment.measured), starts.size))
    loop = ship_loop(
        model.compiled, "segments", bool(segment.inputs[:, 3:].any())
    )  # with or without wind
    loop(starts.ravel(), ships.ravel(), offsets, segment.inputs, segment.samples, out)
    return out.reshape(len(out), -1, LANES)


def about_mean(values: Floats) -> Floats:
    """Values less their mean along the first axis."""
    return values - values.mean(axis=0) if len(values) else values


def averaged(values: Floats, blocks: Integers, counts: Integers) -> Floats:
    """Means over the blocks of samples along the first axis."""
    return np.asarray(
        np.add.reduceat(values, blocks) / counts.reshape(-1, *(1,) * (values.ndim - 1))
    )


def _without_start(
    value: Floats, slope: Floats, n_free: int
) -> tuple[Floats, Floats, Floats]:
    """Residuals and slopes without what a move of the start accounts for, and that move."""
    if not n_free:
        return value, slope, np.zeros(0)
    rest, start = slope[:, :-n_free], slope[:, -n_free:]
    if not (np.all(np.isfinite(slope)) and np.all(np.isfinite(value))):
        return value, rest, np.zeros(n_free)
    q, r = np.linalg.qr(start)
    seen = q.T @ value
    move = np.linalg.lstsq(r, -seen, rcond=1e-10)[0]
    return value - q @ seen, rest - q @ (q.T @ rest), move
