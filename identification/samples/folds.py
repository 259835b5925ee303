"""Trials that validate a choice: each in turn, or those of the largest rudder."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from identification.samples.samples import Samples
from shipgym import InputError, Trial
from shipgym.arrays import Flags
from shipgym.checks import check_choice

TRIALS = "trials"
LARGEST_RUDDER = "largest-rudder"
FOLDS = (TRIALS, LARGEST_RUDDER)


def largest_rudders(trials: Sequence[Trial]) -> Flags:
    """Flags of the trials of the largest rudder, to a tenth.

    The hard turn is in no zigzag. How well small rudders predict larger ones is the
    closest substitute in the data.
    """
    reached = np.array([np.abs(trial["delta"]).max() for trial in trials])
    found: Flags = reached > 0.9 * reached.max()
    return found


def _some_largest(trials: Sequence[Trial]) -> Flags:
    """The same; InputError where all have one angle."""
    largest = largest_rudders(trials)
    if largest.all():
        raise InputError(
            "folds: expected some trials with less rudder than others for"
            f" {LARGEST_RUDDER!r}, got {len(trials)} of one angle; take {TRIALS!r}"
        )
    return largest


def held_out_rows(
    trials: Sequence[Trial], samples: Samples, folds: str = TRIALS
) -> Iterator[tuple[Flags, Trial]]:
    """Rows to fit, and the trial or the piece of the only trial that is held out.

    `folds`: one of `FOLDS`.
    """
    check_choice(folds, FOLDS, "folds")
    if folds == LARGEST_RUDDER:
        largest = _some_largest(trials)
        for is_largest, trial in zip(largest, trials, strict=True):
            if is_largest:
                yield ~largest[samples.trial], trial
    elif len(trials) > 1:
        for index, trial in enumerate(trials):
            yield samples.trial != index, trial
    else:
        end = samples.start + samples.duration
        for piece in pieces(trials[0]):
            first, *_, last = piece.t
            yield (end <= first) | (samples.start >= last), piece


def pieces(trial: Trial) -> list[Trial]:
    """Thirds of a trial, which are no manoeuvres."""
    edges = np.linspace(
        0,
        len(trial),
        4,
    ).astype(int)
    found = []
    for number, (begin, end) in enumerate(pairwise(edges.tolist()), start=1):
        piece = trial.part(
            slice(begin, end),
            f"{trial.name}, part {number}",
        )
        found.append(piece)
    return found
