"""How well a method predicts trials that it has not seen: each held out in turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identification.pipeline import identify
from identification.validation.ranking import in_turn
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.trials.trial import Trial


def cross_validate(trials: Sequence[Trial], folds: int | None = None, **arguments: Any) -> dict[str, Any]:
    """Predict each trial by a model identified from others.

    Parameters
    ----------
    trials : sequence of Trial
        Those with `use` "fit" take part.
    folds : int, optional
        Groups of trials that are held out together, in their order; by default each by itself.
    **arguments
        Of `identify`.

    Returns
    -------
    dict
        For each trial by its name the metrics (`IdentificationResult.metrics`) of its prediction.

    Raises
    ------
    InputError
        For fewer than 2 trials or more folds than trials.
    """
    used = [trial for trial in trials if trial.use == "fit"]
    if len(used) < 2:
        raise InputError(f"trials: {len(used)} to fit found, expected at least 2 to hold one out")
    n = len(used)
    if folds is not None:
        n = int(check_number(folds, "folds", at_least=2, at_most=len(used), hint="at most one per trial"))
    own = {"model_error": False, **arguments}
    return in_turn(lambda held: identify(used, hold_out=held, **own), used, n)[0]
