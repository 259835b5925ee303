"""The problem to be identified: trials, structure, ship, and their regression."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np

from identification.samples.samples import Samples, build_samples
from shipgym import InputError, ShipModel, Trial
from shipgym.arrays import Flags
from shipgym.checks import check_choice
from shipgym.ships import Structure

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


@dataclass(frozen=True, eq=False)
class Problem:
    """Data, structure and settings that a method fits."""

    trials: tuple[Trial, ...]  # all, those held out marked `validate`
    used: tuple[Trial, ...]  # those to fit, repaired where asked
    blank: ShipModel  # the model but for its coefficients
    table: Structure  # of the regression; of the MMG form, which has none, a stand-in
    samples: Samples  # the regression
    #: correlations of the candidates for the reference ship of a grey box, where it was
    #: chosen among several
    similarity: dict[str, float]
    sampling: dict[str, Any]  # keywords of `build_samples`

    def rows_of(self, table: Structure, ship: ShipModel) -> Samples:
        """The regression of the same trials with another structure, of a ship."""
        return build_samples(
            self.used,
            structure=table,
            particulars=ship.particulars,
            shaft_speed=ship.service_shaft_speed,
            **self.sampling,
        )

    def without(self, trials: Sequence[int]) -> Self:
        """The problem of the other trials, by their places."""
        others = np.setdiff1d(range(len(self.used)), trials)
        return replace(
            self,
            samples=self.samples.select(np.isin(self.samples.trial, others)),
            used=tuple(self.used[place] for place in others),
        )


def named_apart(trials: Any) -> list[Trial]:
    """The trials; InputError for what is no list of trials of different names."""
    is_single = isinstance(trials, Trial | str)
    found: list[Any] = [None] if is_single else list(trials)
    if not all(isinstance(one, Trial) for one in found):
        raise InputError(
            "trials: expected a list of Trials, such as ship.trials() of a ship file,"
            f" got {trials!r}"
        )
    known = [trial.name for trial in found]
    repeated = [name for name in known if known.count(name) > 1]
    if repeated:
        raise InputError(
            f"trials: expected different names, got two trials named {repeated[0]!r};"
            " rename one with trial.with_(name=...)"
        )
    return found
