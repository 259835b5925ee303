"""Which trials a choice is validated on: each held out in turn, or those of the largest rudder."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from identification.regression.samples import Samples
from shipgym import InputError, Trial
from shipgym.arrays import Flags
from shipgym.checks import check_choice

TRIALS, LARGEST_RUDDER = "trials", "largest-rudder"
FOLDS = (TRIALS, LARGEST_RUDDER)
LEAST_RUDDER_SHARE = (
    0.9  # of the largest rudder; from there on a rudder counts as the largest
)
PIECES = 3  # into which a single trial is cut


def of_largest_rudder(trials: Sequence[Trial], where: str) -> Flags:
    """The trials with the largest rudder: what is learnt from the others is extrapolated to them.

    The hard turn is in no zigzag. How well small rudders predict larger ones is the
    closest substitute in the data. `where`: the argument that asks for it. Raises
    InputError if all of them have the same rudder.
    """
    rudders = np.array([np.abs(trial["delta"]).max() for trial in trials], dtype=float)
    largest: Flags = rudders > LEAST_RUDDER_SHARE * rudders.max()
    if largest.all():
        raise InputError(
            f"{where}: {LARGEST_RUDDER!r} found, but all trials to fit ({len(trials)})"
            f" reach {np.degrees(rudders.max()):.3g} deg, expected some with less"
            f" rudder than others; take {TRIALS!r}, or add trials of another rudder"
            " angle"
        )
    return largest


def held_out_rows(
    trials: Sequence[Trial], samples: Samples, folds: str
) -> Iterator[tuple[Flags, Trial]]:
    """Rows to fit, and the trial or the piece of the only trial that is held out, by a choice of `FOLDS`."""
    if check_choice(folds, FOLDS, "folds") == LARGEST_RUDDER:
        largest = of_largest_rudder(trials, "folds")
        rows = ~largest[samples.trial]
        yield from (
            (rows, trial) for trial, held in zip(trials, largest, strict=True) if held
        )
    elif len(trials) > 1:
        yield from (
            (samples.trial != index, trial) for index, trial in enumerate(trials)
        )
    else:
        start, end = samples.start, samples.start + samples.duration
        yield from (
            ((end <= one.t[0]) | (start >= one.t[-1]), one) for one in pieces(trials[0])
        )


def pieces(trial: Trial) -> list[Trial]:
    """A trial cut into parts, which are no manoeuvres."""
    edges = np.linspace(0, len(trial), PIECES + 1).astype(int).tolist()
    return [
        trial.part(slice(*ends), f"{trial.name}, part {n}")
        for n, ends in enumerate(pairwise(edges), 1)
    ]
