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


def of_largest_rudder(trials: Sequence[Trial], where: str) -> Flags:
    """The trials with the largest rudder, to which the others are extrapolated.

    The hard turn is in no zigzag. How well small rudders predict larger ones is the
    closest substitute in the data. `where`: the argument that asks for it. Raises
    InputError if all of them have the same rudder, to a tenth.
    """
    reached = [np.abs(trial["delta"]).max() for trial in trials]
    rudders = np.array(reached, dtype=float)
    hardest = rudders.max()
    largest: Flags = rudders > 0.9 * hardest
    if largest.all():
        angle = np.degrees(hardest)
        raise InputError(
            f"{where}: expected some trials with less rudder than others for"
            f" {LARGEST_RUDDER!r}, got {len(trials)} trials that all reach"
            f" {angle:.3g} deg; take {TRIALS!r}, or add trials of"
            " another rudder angle"
        )
    return largest


def held_out_rows(
    trials: Sequence[Trial], samples: Samples, folds: str
) -> Iterator[tuple[Flags, Trial]]:
    """Rows to fit, and the trial or the piece of the only trial that is held out.

    `folds`: one of `FOLDS`.
    """
    check_choice(folds, FOLDS, "folds")
    if folds == LARGEST_RUDDER:
        largest = of_largest_rudder(trials, "folds")
        rows = ~largest[samples.trial]
        for index in np.flatnonzero(largest).tolist():
            yield rows, trials[index]
    elif len(trials) > 1:
        for index, trial in enumerate(trials):
            yield samples.trial != index, trial
    else:
        end = samples.start + samples.duration
        for piece in pieces(trials[0]):
            before = end <= piece.t[0]
            after = samples.start >= piece.t[-1]
            yield before | after, piece


def pieces(trial: Trial) -> list[Trial]:
    """Thirds of a trial, which are no manoeuvres."""
    edges = np.linspace(0, len(trial), 4).astype(int)
    found = []
    for number, (begin, end) in enumerate(pairwise(edges.tolist()), start=1):
        piece = trial.part(
            slice(begin, end),
            f"{trial.name}, part {number}",
        )
        found.append(piece)
    return found
