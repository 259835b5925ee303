"""Which trials a choice is validated on: each held out in turn, or those of the largest rudder."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.trials.trial import Trial

TRIALS, LARGEST_RUDDER = "trials", "largest-rudder"
FOLDS = (TRIALS, LARGEST_RUDDER)
LEAST_RUDDER_SHARE = 0.9  # of the largest rudder; from there on a rudder counts as the largest


def of_largest_rudder(trials: Sequence[Trial], where: str) -> NDArray[np.bool_]:
    """The trials with the largest rudder: what is learnt from the others is extrapolated to them.

    The hard turn is in no zigzag. How well small rudders predict larger ones is the closest substitute in the
    data. `where` is the argument that asks for it, for messages. Raises InputError if all of them have the
    same rudder.
    """
    rudders = np.array([np.abs(trial["delta"]).max() for trial in trials], dtype=float)
    largest: NDArray[np.bool_] = rudders > LEAST_RUDDER_SHARE * rudders.max()
    if largest.all():
        raise InputError(
            f"{where}: {LARGEST_RUDDER!r} found, but all trials to fit ({len(trials)}) reach "
            f"{np.degrees(rudders.max()):.3g} deg, expected some with less rudder than others; take "
            f"{TRIALS!r}, or add trials of another rudder angle"
        )
    return largest
