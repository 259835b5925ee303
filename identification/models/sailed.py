"""Fits by the errors of ships in parts of trials, many ships at once, and a prior."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from identification.least_squares import Linearised, fit_least_squares
from identification.samples import preprocess
from identification.samples.preprocess import between_gaps
from identification.samples.rudder import Rudder, rebuild, straight
from shipgym import ShipModel, Trial
from shipgym.arrays import Floats, Integers
from shipgym.engine.compiled_ship import STILL_WATER
from shipgym.engine.loops import ship_loop
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES
from shipgym.models.simulate import LONGEST_STEP, wind_accelerations
from shipgym.sea.open_sea import OPEN_SEA
from shipgym.ships import Structure
from shipgym.trials.resampling import usual_step

BLOCK = 0.05  # time over which residuals are averaged, of that to sail one ship length


class Segment(NamedTuple):
    """A stretch of a trial."""

    trial: int  # index of the trial
    #: time, s, rudder, rad, shaft speed, 1/s, and the accelerations in surge, sway and
    #: yaw by wind, on the grid of the integration, shape (n_points, 6)
    inputs: Floats
    #: sample at each point of the grid, -1 for none, shape (n_points,)
    samples: Integers
    measured: Floats  # what is compared with, shape (n_samples, n_channels)
    #: first sample of each block over which residuals are averaged, shape (n_blocks,)
    blocks: Integers
    times: Floats  # when the blocks begin, s, shape (n_blocks,)
    #: state at the first sample, in the order of the model's `state_names`, shape
    #: (n_state,)
    start: Floats

    @property
    def duration(self) -> float:
        """Time from its first sample to its last, s."""
        return float(self.inputs[-1, 0] - self.times[0])

    @property
    def has_wind(self) -> bool:
        """True where wind accelerates the ship in it."""
        return bool(self.inputs[:, 3:].any())

    @property
    def block_sizes(self) -> Integers:
        """Samples in each block, shape (n_blocks,)."""
        return np.diff(self.blocks, append=len(self.measured))


def compared_channels(model: ShipModel, trials: Sequence[Trial]) -> tuple[str, ...]:
    """Channels whose residuals count: velocities with equations, and heading.

    Of yaw alone only the heading, where the yaw rate was derived from it.
    """
    names = velocities(model)
    heading = "r" in names and all("psi" in trial for trial in trials)
    if not heading:
        return names
    is_derived = all("r" in trial.derived for trial in trials)
    if names == ("r",) and is_derived:
        return ("psi",)
    return (*names, "psi")


def velocities(model: ShipModel) -> tuple[str, ...]:
    """Velocities that the model has equations of."""
    table = model.dynamics
    if isinstance(table, Structure):
        return tuple(table.equations)
    return ("u", "v", "r")


def cut(
    trials: Sequence[Trial],
    model: ShipModel,
    channels: Sequence[str],
    lengths: float,
    staggered: bool,
    interval: float = 0.0,
    coarse: bool = False,
) -> list[Segment]:
    """Cut trials into segments; staggered, again from half a segment later on.

    A gap in time ends a segment. A segment is the time to sail so many ship `lengths`
    at service speed; it starts from the smoothed state. Compared are samples at least
    an `interval` apart, in ship lengths; where it is 0, all. Coarse ones are integrated
    in steps as long as that.
    """
    least_step = interval * model.travel_time
    segments = []
    for index, trial in enumerate(trials):
        for piece in between_gaps(trial, model.particulars):
            recorded = _recorded(index, piece, model)
            every = max(int(least_step / usual_step(piece.t) + 1e-9), 1)
            for shift in (0.0, 0.5) if staggered else (0.0,):
                edges = segment_edges(piece.t, lengths * model.travel_time, shift)
                for first, last in pairwise(edges):
                    rows = slice(first, last + 1, every)
                    segments.append(
                        _segment(
                            recorded, rows, channels, model, least_step * coarse or None
                        )
                    )
    return segments


def segment_edges(t: Floats, duration: float, shift: float) -> Integers:
    """First samples of the segments of a record, and its last sample.

    As many equal segments as come nearest to a duration, s, from a `shift` in durations
    on. Segments of fewer than five samples are joined. None where nothing is left.
    """
    fewest = 5
    span, skipped = t[-1] - t[0], shift * duration
    if skipped >= span:
        return np.zeros(
            0,
            dtype=int,
        )
    count = max(
        round(span / duration - shift),
        1,
    )
    begins = t[0] + skipped + np.arange(count) * (span - skipped) / count
    firsts, last = np.searchsorted(t, begins), len(t) - 1
    long_enough = (
        np.diff(
            firsts,
            append=last,
        )
        >= fewest
    )
    long_enough[0] = True  # what is too short joins the segment before it
    return np.append(firsts[long_enough], last)


@dataclass(frozen=True, eq=False)
class _Recorded:
    """A record without gaps, as segments are cut from it."""

    index: int  # of its trial
    trial: Trial
    states: Floats  # smoothed, shape (n_samples, n_state)
    rudder: Rudder  # between the samples too


def _recorded(index: int, trial: Trial, model: ShipModel) -> _Recorded:
    channels = (trial[name] for name in velocities(model))
    if preprocess.is_noisy(trial.t, channels):
        rudder = straight(trial.t, trial["delta"])
    else:
        rudder = rebuild(trial.t, trial["delta"], model.steering)
    return _Recorded(
        index=index,
        trial=trial,
        states=smoothed_states(trial, model),
        rudder=rudder,
    )


def smoothed_states(trial: Trial, model: ShipModel) -> Floats:
    """States along a trial, smoothed but for rudder and shaft.

    The position, and what was not recorded, is 0. Shape (n_samples, n_state).
    """
    states = np.zeros((len(trial), len(model.state_names)))
    for column, name in enumerate(model.state_names):
        if name not in trial or name in ("x", "y"):
            continue
        values = trial[name]
        if name not in ("delta", "n"):
            values = preprocess.smooth(trial.t, values)
        states[:, column] = values
    return states


def _segment(
    recorded: _Recorded,
    rows: slice,
    channels: Sequence[str],
    model: ShipModel,
    longest_step: float | None,
) -> Segment:
    trial = recorded.trial
    t = trial.t[rows]
    corners = recorded.rudder.corners
    if longest_step is None:
        longest_step = LONGEST_STEP * model.travel_time
    else:
        corners = corners[:0]
    grid = _grid(t, longest_step, corners)
    samples = np.full(len(grid), -1)
    sampled = np.searchsorted(grid, t)
    samples[sampled] = np.arange(len(t))

    per_block = max(int(BLOCK * model.travel_time / usual_step(t)), 1)
    blocks = np.arange(0, len(t), per_block)
    return Segment(
        trial=recorded.index,
        inputs=_inputs(recorded, grid, model),
        samples=samples,
        measured=np.column_stack([trial[name][rows] for name in channels]),
        blocks=blocks,
        times=t[blocks],
        start=recorded.states[rows.start],
    )


def _inputs(recorded: _Recorded, grid: Floats, model: ShipModel) -> Floats:
    """Rudder, shaft and wind at times of a grid, as in `Segment.inputs`."""
    trial = recorded.trial
    shaft = trial["n"] if "n" in trial else np.zeros(len(trial))
    sampled = [shaft, *wind_accelerations(trial, model.dynamics).T]
    between = [np.interp(grid, trial.t, values) for values in sampled]
    return np.column_stack([grid, recorded.rudder(grid), *between])


def _grid(t: Floats, longest_step: float, corners: Floats) -> Floats:
    """Times of integration, s: samples, points between, and corners of the rudder."""
    counts = np.maximum(np.ceil(np.diff(t) / longest_step - 1e-9), 1.0).astype(int)
    first = np.repeat(np.arange(len(t) - 1), counts)
    part = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    between = t[first] + np.diff(t)[first] * part / counts[first]
    inside = corners[(corners > t[0]) & (corners < t[-1])]
    return np.union1d(np.append(between, t[-1]), inside)


def channel_units(model: ShipModel, channels: Sequence[str]) -> Floats:
    """Units in which channels are compared, shape (n_channels,).

    Service speed, that by ship length, and 1 rad.
    """
    speed = model.particulars["speed"]
    rate = speed / model.particulars["length"]
    units = {"u": speed, "v": speed, "r": rate, "p": rate, "psi": 1.0}
    return np.array([units[name] for name in channels])


def sail(model: ShipModel, segment: Segment, ships: Floats, starts: Floats) -> Floats:
    """States of ships at the samples of a segment, shape (n_samples, n_state, n_ships).

    Numbers of the ships and states at the start, a column for each.
    """
    n_ships = ships.shape[1]
    tiles = []
    for first in range(0, n_ships, LANES):
        # the last ship fills the lanes that are left
        lanes = np.minimum(first + np.arange(LANES), n_ships - 1)
        tiles.append(_in_lanes(model, segment, ships[:, lanes], starts[:, lanes]))
    return np.concatenate(tiles, axis=2)[:, :, :n_ships]


def _in_lanes(
    model: ShipModel, segment: Segment, ships: Floats, starts: Floats
) -> Floats:
    """The same of as many ships as there are lanes."""
    sea = OPEN_SEA if segment.has_wind else STILL_WATER
    loop = ship_loop(model.compiled, "segments", sea)
    n_samples = len(segment.measured)
    states = np.empty((n_samples, starts.size))
    state = starts.copy()
    state[model.state_names.index("delta")] = segment.inputs[0, 1]
    loop(
        state.ravel(),
        ships.ravel(),
        segment.inputs,
        segment.samples,
        states,
    )
    return states.reshape(n_samples, -1, LANES)


def in_columns(values: Floats, number: int) -> Floats:
    """The same values in so many columns, shape (n_values, number)."""
    return np.repeat(values[:, None], number, axis=1)


LARGEST = 1e3  # error of a ship that runs away, in scales


class CoefficientPrior(NamedTuple):
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
        parts = self._parts(which)
        return np.concatenate([self._errors(part, ships) for part in parts])

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
