"""The reference ship of a grey box, and the regression of a model on itself."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from identification.estimators.estimator import Estimator
from identification.models.methods import fit_all, get_method
from identification.models.similarity import (
    AUTO,
    check_alike,
    select_reference,
)
from identification.samples.samples import Samples, build_samples
from shipgym import InputError, Particulars, ShipModel, Trial
from shipgym.arrays import Floats
from shipgym.models import grey_box
from shipgym.ships import GreyBox


class _OwnAccelerations:
    """A table whose one term an equation is the reference ship's acceleration."""

    def __init__(self, box: GreyBox) -> None:
        self._box = box

    def __getattr__(self, name: str) -> Any:
        return getattr(self._box, name)

    def features(
        self,
        equation: str,
        channels: Any,
        particulars: Particulars,
        shaft_speed: float,
    ) -> Floats:
        """Shape (n_samples, 1)."""
        accelerations = self._box.converted_accelerations(
            channels, particulars, shaft_speed
        )
        return accelerations[equation][:, None]


def chosen_box(
    reference: str | ShipModel | None,
    particulars: Particulars,
    trials: Sequence[Trial],
) -> tuple[GreyBox, dict[str, float]]:
    """The grey box of a reference ship.

    Also returns the correlations of the candidates where she was not named.

    Parameters
    ----------
    reference : str or ShipModel
        A model, its name or file; "auto" chooses the one most like the target by
        `select_reference`.
    particulars : Particulars
        Of the target.
    trials : sequence of Trial
        Of the target; they tell whether its shaft speed and roll are known.
    """
    if reference is None:
        raise InputError(
            "reference_model: expected the name of a reference ship, a model file, or"
            " 'auto': a grey box is a reference ship plus a table of terms; got None"
        )
    recorded: set[str] = set()
    if trials:
        recorded = set.intersection(*(set(trial.channels) for trial in trials))

    similarity: dict[str, float] = {}
    if reference == AUTO:
        with suppress(InputError):  # too little may be known to estimate the rest
            particulars = particulars.completed()
        reference, similarity = select_reference(particulars, recorded)
        otherwise = 'choose structure "abkowitz" or "cubic"'
        check_alike(reference, similarity[reference], otherwise)
    box = grey_box(reference)
    has_shaft = box.shaft and "n" in recorded
    return replace(box, shaft=has_shaft), similarity


def explained_samples(
    trials: Sequence[Trial],
    model: ShipModel,
    **sampling: Any,
) -> tuple[Samples, dict[str, Estimator]]:
    """The regression on a model's own accelerations, and estimators of coefficient 1.

    Each equation has one term. For models that were not fitted by regression;
    `sampling` as in `build_samples`.
    """
    table: Any = _OwnAccelerations(grey_box(model, shaft=True))
    samples = build_samples(
        trials,
        structure=table,
        particulars=model.particulars,
        shaft_speed=model.service_shaft_speed,
        **sampling,
    )
    estimators = fit_all(get_method("ls").make, samples)
    for estimator in estimators.values():
        estimator.coef_ = np.ones(1)
    return samples, estimators
