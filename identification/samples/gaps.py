"""Gaps in the time of a record, across which nothing is smoothed or integrated."""

from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter

from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Flags, Floats

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
