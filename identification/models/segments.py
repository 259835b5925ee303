"""Stretches of trials, each of which a model sails from a start of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identification.samples import preprocess
from identification.samples.gaps import between_gaps
from identification.samples.rudder import Rudder, rebuild, straight
from shipgym import ShipModel, Trial
from shipgym.arrays import Floats, Integers
from shipgym.models.simulate import LONGEST_STEP, wind_accelerations
from shipgym.ships import Structure
from shipgym.trials.resampling import usual_step

BLOCK = 0.05  # time over which residuals are averaged, of that to sail one ship length


@dataclass(frozen=True, eq=False)
class Segment:
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
