"""Preparation of a noisy record: channels that can be differentiated."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solveh_banded
from scipy.ndimage import median_filter
from scipy.sparse import diags_array

from identification.arrays import root_mean_square
from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_flag
from shipgym.trials.resampling import usual_step

FEWEST_SAMPLES = 10  # between gaps; fewer are left out


def between_gaps(
    trial: Trial,
    particulars: Particulars,
    fewest: int = FEWEST_SAMPLES,
) -> list[Trial]:
    """Cut a trial where samples are missing; the trial itself if it has no gap.

    A gap is a time step of more than 5 usual ones, the median of the trial or of those
    around, and more than 0.15 of the time to sail one ship length. Pieces shorter than
    `fewest`, or 10, samples are left out; InputError where no piece is left.
    """
    is_gap = _gaps(trial.t, particulars)
    if not is_gap.any():
        return [trial]

    fewest = max(fewest, FEWEST_SAMPLES)
    edges = [0, *(np.flatnonzero(is_gap) + 1).tolist(), len(trial)]
    pieces = [slice(*pair) for pair in pairwise(edges) if pair[1] - pair[0] >= fewest]
    if not pieces:
        longest = int(np.argmax(np.diff(trial.t)))
        begin, end = trial.t[longest : longest + 2]
        raise InputError(
            f"trial {trial.name!r}: expected {fewest} samples somewhere without a gap"
            f" in time, got {is_gap.sum()} gaps with fewer between them (the longest"
            f" from {begin:g} to {end:g} s); export it with every"
            ' sample, or leave it out (use = "skip")'
        )
    return [trial.part(piece) for piece in pieces]


def _gaps(t: Floats, particulars: Particulars) -> Flags:
    """Flags of steps between samples that are gaps, shape (n_samples - 1,)."""
    steps = np.diff(t)
    neighbours = 11  # steps whose median is the usual one
    around = median_filter(steps, neighbours, mode="mirror")
    usual = np.maximum(np.median(steps), around)

    one_length = particulars["length"] / particulars["speed"]
    largest_steps = 5.0  # of the usual time step; a longer one is a gap,
    # unless it is shorter than this part of the time to sail one ship length
    shortest_gap = 0.15
    longest = np.maximum(largest_steps * usual, shortest_gap * one_length)
    but_for_rounding = 1.0 + 1e-6
    is_gap: Flags = steps > but_for_rounding * longest
    return is_gap


#: Noise beyond this part of what a channel changes by from one sample to the next makes
#: it noisy.
NOISY = 0.02
NEIGHBOURS = (0, 1, 3, 4)  # of the middle one of five samples


def noise_level(t: ArrayLike, values: ArrayLike) -> float:
    """Standard deviation of the sample-to-sample noise of a channel, in its unit.

    Each sample is compared with the cubic through its two neighbours on either side;
    the median of the differences is not moved by corners of the signal. 0 with fewer
    than five samples.
    """
    t = np.asarray(t, dtype=float)
    values = np.asarray(values, dtype=float)
    n_compared = len(t) - 4
    if n_compared < 1:
        return 0.0

    expected = np.zeros(n_compared)
    gain = np.ones(n_compared)  # of the variance of a difference by that of a sample
    times = [t[j : j + n_compared] for j in range(5)]
    for i in NEIGHBOURS:
        # Lagrange's polynomial of the i-th of five samples in the middle one
        weight = np.ones(n_compared)
        for j in NEIGHBOURS:
            if j != i:
                weight *= (times[2] - times[j]) / (times[i] - times[j])
        expected += weight * values[i : i + n_compared]
        gain += weight**2

    scaled = np.abs(values[2:-2] - expected) / np.sqrt(gain)
    quartile_of_normal = 0.6745
    return float(np.median(scaled) / quartile_of_normal)


def noise_ratio(t: ArrayLike, values: ArrayLike, window: int = 1) -> float:
    """Noise of the change over a window of steps relative to the change itself.

    Both are root mean squares.
    """
    values = np.asarray(values, dtype=float)
    before = values[:-window]
    change = values[window:] - before
    if not np.any(change):
        return 0.0
    noise_of_change = np.sqrt(2.0) * noise_level(t, values)
    return float(noise_of_change / root_mean_square(change))


def is_noisy(t: ArrayLike, channels: Iterable[ArrayLike]) -> bool:
    """Return whether a channel, each (n_samples,), has noise beyond `NOISY`."""
    return any(noise_ratio(t, values) > NOISY for values in channels)


#: Decades of stiffness tried, of a spline on knots a unit apart.
STIFFNESSES = tuple(float(stiffness) for stiffness in np.arange(-2.0, 8.01, 0.25))


def smooth(t: ArrayLike, values: ArrayLike) -> Floats:
    """Smooth a channel by a cubic spline of a stiffness by cross-validation.

    The natural smoothing spline of Reinsch 1967 (Numerische Mathematik 10); the trace
    in the generalised criterion of Craven & Wahba 1979 (Numerische Mathematik 31) is
    estimated by random signs (Girard 1989), always the same ones. Times in s, of shape
    (n_samples,) as the values, which are returned as they are where they are free of
    noise (`NOISY`) or fewer than five.
    """
    times = np.ascontiguousarray(t, dtype=float)
    samples = np.ascontiguousarray(values, dtype=float)
    return _smoothed(times.tobytes(), samples.tobytes()).copy()


@lru_cache(maxsize=256)  # structures that are compared smooth the same channels
def _smoothed(times: bytes, samples: bytes) -> Floats:
    """Smooth a channel, both as the bytes of their samples."""
    t = np.frombuffer(times)
    values = np.frombuffer(samples)
    if len(t) < 5 or noise_ratio(t, values) < NOISY:
        return values

    spline = Reinsch(t / usual_step(t))
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], len(t))
    both = np.stack([values, signs])

    def criterion(stiffness: float) -> float:
        smoothed = spline.smoothed(both, 10.0**stiffness)
        left_out, rest = both - smoothed
        freedom = max(float(signs @ rest), 1.0)
        return float(left_out @ left_out) / freedom**2

    best = min(STIFFNESSES, key=criterion)
    return spline.smoothed(values, 10.0**best)


class Reinsch:
    """Natural cubic smoothing splines on given knots, by banded matrices.

    Source: Reinsch 1967. With Q' the second divided differences of the values y at the
    knots, T the Gram matrix of the spline's second derivative, and a stiffness s, the
    second derivatives at the inner knots are (T + s Q'Q)^-1 Q'y, and the smoothed
    values y - s Q of these.
    """

    def __init__(self, t: Floats) -> None:
        h = np.diff(t)
        left = 1.0 / h[:-1]
        right = 1.0 / h[1:]
        middle = -left - right
        diagonals: Any = [left, middle, right]
        self.second_differences = diags_array(  # Q
            diagonals,
            offsets=(0, -1, -2),
            shape=(len(t), len(t) - 2),
            format="csr",
        )
        beside = np.pad(h[1:-1] / 6.0, (1, 0))
        along = (h[:-1] + h[1:]) / 3.0
        # upper bands, as `scipy.linalg.solveh_banded` wants them
        self.gram = np.array([np.zeros_like(along), beside, along])
        square = self.second_differences.T @ self.second_differences
        bands = [np.pad(square.diagonal(k), (k, 0)) for k in (2, 1, 0)]
        self.square = np.array(bands)

    def smoothed(self, values: Floats, stiffness: float) -> Floats:
        """Values of the spline at the knots.

        Shape (n_knots,) or (n_splines, n_knots), as the values.
        """
        Q = self.second_differences
        bands = self.gram + stiffness * self.square
        curvature = solveh_banded(bands, Q.T @ values.T)
        return np.asarray(values - stiffness * (Q @ curvature).T)


WIDTH = 7  # samples of the running median
OUTLYING = 6.0  # times the noise


def outliers(t: ArrayLike, values: ArrayLike, may_step: bool = True) -> Flags:
    """Flags of samples away from the running median by several times the noise.

    Source: Hampel 1974, JASA 69. What the signal itself moves from sample to sample is
    allowed for by the running median's own steps, so that corners of a clean signal are
    no outliers.

    Parameters
    ----------
    t, values : array-like of shape (n_samples,)
        Times, s, and the channel.
    may_step : bool
        Whether the signal may have just moved at its ends, as a rudder does; if not,
        the first and the last sample are compared with the next one.
    """
    t = np.asarray(t, dtype=float)
    values = np.asarray(values, dtype=float)
    if len(values) < WIDTH:
        return np.zeros(len(values), dtype=bool)

    middle = median_filter(
        values,
        WIDTH,
        mode="nearest",
    )
    rounding = 1e-9 * np.ptp(middle)
    least = OUTLYING * noise_level(t, values) + rounding
    allowed = least + 0.5 * WIDTH * _usual_steps(middle)
    deviations = np.abs(values - middle)
    found: Flags = deviations > allowed

    if not may_step and len(values) >= 3 * WIDTH:
        first, last = _ends_that_jump(t, values, middle, least)
        # next to an outlier it is not the end that jumps
        found[0] = first and not found[1]
        found[-1] = last and not found[-2]
    return found


def _usual_steps(middle: Floats) -> Floats:
    """Larger of the running median's steps to either side, smoothed by a median."""
    forward = np.abs(np.diff(middle, append=middle[-1]))
    backward = np.roll(forward, 1)
    return median_filter(np.maximum(forward, backward), WIDTH, mode="nearest")


def _ends_that_jump(
    t: Floats,
    values: Floats,
    middle: Floats,
    least: float,
) -> tuple[bool, bool]:
    """Return whether the first and the last sample jump to the next one.

    A jump is further than the signal moves anywhere inside.
    """
    half = WIDTH // 2
    largest_move = np.abs(np.diff(middle[half:-half])).max()
    steps = np.diff(t)
    # next to a gap the signal moves further
    longer = np.maximum(steps[[0, -1]] / np.median(steps), 1.0)
    jumps = np.abs(np.diff(values))[[0, -1]]
    first, last = jumps > (least + WIDTH * largest_move) * longer
    return bool(first), bool(last)


def repaired(trial: Trial) -> Trial:
    """Replace outliers and fill short dropouts of a trial by PCHIP interpolation.

    A dropout is a step in time of more than 1.5 usual ones; those of up to 10 are
    filled, at the usual step; longer ones stay, and no method smooths or integrates
    across them. Returns the trial itself where nothing is wrong; else with `repaired`,
    the number of values that were filled by channel, and `raw`, the trial as it was.
    Raises InputError where more than a tenth of a channel would be outliers.
    """
    times = _filled_times(trial.t)
    is_recorded = np.isin(times, trial.t)
    channels, counts = {}, {}
    for name, values in trial.channels.items():
        wrong = _outliers_of(trial, name)
        sound = is_recorded.copy()
        sound[is_recorded] = ~wrong
        channels[name] = values
        if sound.all():
            continue

        # beyond the good values the first or the last
        known, good = trial.t[~wrong], values[~wrong]
        filled = PchipInterpolator(known, good)(np.clip(times, known[0], known[-1]))
        filled[sound] = good  # to the bit as they were
        channels[name] = filled
        counts[name] = int((~sound).sum())
    if not counts:
        return trial
    return trial.with_channels(
        channels,
        t=times,
        repaired=counts,
    )


def _outliers_of(trial: Trial, name: str) -> Flags:
    """Outliers of a channel; of one that is not measured none."""
    measured = ("x", "y", "psi", "u", "v", "r", "p", "phi", "delta", "n")
    if name not in measured:
        return np.zeros(len(trial), dtype=bool)
    stepping = ("delta", "n")  # without the inertia of a ship
    wrong = outliers(
        trial.t,
        trial[name],
        may_step=name in stepping,
    )
    if wrong.mean() > 0.1:
        raise InputError(
            f"trial {trial.name!r}: expected at most a tenth of {name} to be outliers,"
            f" got {wrong.sum()} of {len(trial)} samples; check the channel, or"
            " leave the trial as it is (repair = false)"
        )
    return wrong


def _filled_times(t: Floats) -> Floats:
    """The times with those that are missing in short dropouts."""
    usual = usual_step(t)
    times = [t]
    for start, end in pairwise(t):
        if 1.5 * usual < end - start <= 10.5 * usual:
            n_steps = round((end - start) / usual)
            times.append(
                np.linspace(
                    start,
                    end,
                    n_steps + 1,
                )[1:-1]
            )
    return np.unique(np.concatenate(times))


#: What `identify` may do with noisy channels.
PREPROCESSING = ("spline", "none")


@dataclass(frozen=True)
class Preprocessing:
    """Smoothing of noisy channels before the regression.

    Parameters
    ----------
    smoothing : {"spline", "none"}
        Smoothing splines fitted to the noise level, or channels as recorded.
    repair : bool
        Whether outliers are replaced and dropouts of up to 10 steps filled first; the
        provenance counts them.
    """

    smoothing: str = "spline"
    repair: bool = False

    def __post_init__(self) -> None:
        check_choice(self.smoothing, PREPROCESSING, "preprocessing")
        check_flag(self.repair, "repair")


def smoothed_channels(
    trial: Trial,
    names: Sequence[str],
    smoothing: str = "spline",
) -> dict[str, Floats]:
    """Some channels of a trial, smoothed (`Preprocessing`).

    The rudder, which has corners, is left as it is.
    """
    check_choice(smoothing, PREPROCESSING, "preprocessing")
    kept = {"delta"}
    if smoothing == "none":
        kept = set(names)

    channels = {}
    for name in names:
        channels[name] = trial[name]
        if name not in kept:
            channels[name] = smooth(trial.t, trial[name])
    return channels
