"""Prior knowledge of the coefficients, before the trials."""

from dataclasses import dataclass

import numpy as np

from identification.samples.folds import FOLDS, TRIALS
from shipgym import InputError, ShipModel
from shipgym.checks import check_choice, check_number


@dataclass(frozen=True, eq=False)
class PriorKnowledge:
    """Prior toward which the coefficients are pulled.

    Parameters
    ----------
    source : str, ShipModel or None
        A reference ship at this ship's scale: a model, its name or file, or "auto", the
        one most like this ship; or regression formulas: "clarke" or "kijima", with
        structure `mmg` "yoshimura" or "kijima". None is for `mmg` alone: its
        `reference_model`, else Yoshimura's formulas.
    strength : float or None, at least 0
        Strength of that pull: 0 for none, infinity for the prior itself; with `mmg`,
        the number by which its standard deviations are divided. None chooses it by
        cross-validation.
    folds : {"trials", "largest-rudder"}
        What the cross-validation holds out: each trial in turn, or the trials with the
        largest rudder angle.
    """

    source: str | ShipModel | None = None
    strength: float | None = None
    folds: str = TRIALS

    def __post_init__(self) -> None:
        if not isinstance(self.source, str | ShipModel | None):
            raise InputError(
                "prior: expected a reference ship or the name of formulas, got"
                f" {self.source!r}"
            )
        if self.strength is not None and self.strength != np.inf:
            hint = "0 for no prior, inf for the prior itself"
            check_number(self.strength, "prior_strength", at_least=0.0, hint=hint)
        check_choice(self.folds, FOLDS, "prior_folds")
