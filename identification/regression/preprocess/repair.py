"""Outliers and dropouts of a record: found, filled from their neighbours, and counted."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import median_filter

from identification.regression.preprocess.noise import noise_level
from shipgym import InputError, Trial
from shipgym.arrays import Flags, Floats
from shipgym.checks import check_number

WIDTH = 7  # samples of the running median
OUTLYING = 6.0  # times the noise
LONGEST_HOLE = 10.0  # usual time steps; longer ones stay gaps
MOST_OUTLIERS = 0.1  # of a channel
FEWEST_FOR_ENDS = (
    3 * WIDTH
)  # samples of a record whose ends are compared with what it moves inside
MEASURED = ("x", "y", "psi", "u", "v", "r", "p", "phi", "delta", "n")
STEPPING = ("delta", "n")  # without the inertia of a ship


def outliers(
    t: ArrayLike, values: ArrayLike, threshold: float = OUTLYING, may_step: bool = True
) -> Flags:
    """Samples away from the running median by several times the noise (Hampel 1974, JASA 69), as flags.

    What the signal itself moves from sample to sample is allowed for by the running
    median's own steps, so that corners of a clean signal are no outliers. The first and
    the last sample are compared with the next one, unless the signal `may_step`, as a
    rudder does, which may have just moved there. The threshold is in standard
    deviations of the noise.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if len(values) < WIDTH:
        return np.zeros(len(values), dtype=bool)
    middle = median_filter(values, WIDTH, mode="nearest")
    steps = np.abs(np.diff(middle, append=middle[-1]))
    moves = median_filter(np.maximum(steps, np.roll(steps, 1)), WIDTH, mode="nearest")
    least = threshold * noise_level(t, values) + 1e-9 * np.ptp(middle)
    found: Flags = np.abs(values - middle) > least + 0.5 * WIDTH * moves
    if not may_step and len(values) >= FEWEST_FOR_ENDS:
        ends, inside = (
            np.array([0, -1]),
            np.abs(np.diff(middle[WIDTH // 2 : -(WIDTH // 2)])),
        )
        longer = np.maximum(
            np.diff(t)[ends] / np.median(np.diff(t)), 1.0
        )  # beside a gap it moves further
        jumps = np.abs(np.diff(values))[ends] > (least + WIDTH * inside.max()) * longer
        found[ends] = (
            jumps & ~found[[1, -2]]
        )  # from an outlier it is not the end that jumps
    return found


def repaired(trial: Trial, threshold: float = OUTLYING) -> Trial:
    """Replace outliers and fill short dropouts of a trial from their neighbours, by PCHIP.

    A dropout is a step in time of more than 1.5 usual ones; those of up to 10 are
    filled, at the usual step; longer ones stay, and no method smooths or integrates
    across them. Returns the trial itself where nothing is wrong; else with `repaired`,
    the number of values that were filled by channel, and `raw`, the trial as it was.
    Raises InputError where more than a tenth of a channel would be outliers.
    """
    check_number(
        threshold, "threshold", above=0.0, hint="in standard deviations of the noise"
    )
    times = _filled_times(trial.t)
    kept = np.isin(times, trial.t)
    channels, counts = {}, {}
    for name, values in trial.channels.items():
        wrong = np.zeros(len(trial), dtype=bool)
        if name in MEASURED:
            wrong = outliers(trial.t, values, threshold, may_step=name in STEPPING)
        if wrong.mean() > MOST_OUTLIERS:
            raise InputError(
                f"trial {trial.name!r}: {wrong.sum()} of {len(trial)} samples of {name}"
                " would be outliers, expected at most a tenth; check the channel, or"
                f" give a threshold above {threshold:g}"
            )
        sound = kept.copy()
        sound[kept] = ~wrong
        channels[name] = values
        if not sound.all():
            known, good = trial.t[~wrong], values[~wrong]
            channels[name] = PchipInterpolator(known, good)(
                np.clip(times, known[0], known[-1])
            )
            channels[name][sound] = good  # to the bit as they were
            counts[name] = int((~sound).sum())
    return trial.with_channels(channels, t=times, repaired=counts) if counts else trial


def _filled_times(t: Floats) -> Floats:
    """The times with those that are missing in short dropouts."""
    steps = np.diff(t)
    usual = float(np.median(steps))
    extra = [
        np.linspace(t[k], t[k + 1], round(steps[k] / usual) + 1)[1:-1]
        for k in np.flatnonzero(
            (steps > 1.5 * usual) & (steps <= (LONGEST_HOLE + 0.5) * usual)
        )
    ]
    return np.union1d(t, np.concatenate(extra)) if extra else np.array(t)
