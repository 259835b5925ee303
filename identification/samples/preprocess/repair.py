"""Outliers and dropouts of a record: found, filled from neighbours, and counted."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import median_filter

from identification.samples.preprocess.noise import noise_level
from shipgym import InputError, Trial
from shipgym.arrays import Flags, Floats
from shipgym.trials.resampling import usual_step

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
