"""Uncertainty of a controller's margins: its loop with ships drawn at random."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import UNKNOWN_MARGINS, Controller
from agents.controllers.margins import Margins
from shipgym import InputError, ShipModel
from shipgym.arrays import Floats
from shipgym.models.by_name import ship_of


@dataclass(frozen=True, eq=False)
class MarginUncertainty:
    """Margins and bandwidth of one controller on many ships.

    Attributes
    ----------
    nominal : Margins
        On the model it was designed on.
    by_name : dict of str to array of shape (n_models,)
        Each figure of `Margins` on each ship; nan where the loop is unstable or the
        ship has no straight course.
    stable : bool array of shape (n_models,)
        Where the loop is stable.
    """

    nominal: Margins
    by_name: dict[str, Floats]
    stable: NDArray[np.bool_]

    def quantiles(
        self, share: Sequence[float] = (0.05, 0.5, 0.95)
    ) -> dict[str, Floats]:
        """Quantiles over ships with a stable loop; InputError if none is stable."""
        if not self.stable.any():
            raise InputError(
                "margins: expected a stable loop on at least one ship, got none"
            )
        quantiles = {}
        for name, values in self.by_name.items():
            # the lower one: finite and infinite values are mixed
            stable = values[self.stable]
            quantiles[name] = np.quantile(stable, share, method="lower")
        return quantiles


def margin_uncertainty(
    controller: Controller, models: Sequence[ShipModel]
) -> MarginUncertainty:
    """Margins of a controller on each of many ships.

    Raises InputError if there are no models.

    Parameters
    ----------
    controller : Controller
        Its law is taken as linear about straight running.
    models : sequence of ShipModel
        For example `model.sample(100, seed)`, drawn from the estimated covariance.
    """
    if not models:
        raise InputError("models: expected at least one, got none")
    found = []
    stable = []
    for model in map(ship_of, models):
        try:
            found.append(controller.margins_on(model))
            stable.append(True)
        except InputError:
            found.append(UNKNOWN_MARGINS)
            stable.append(False)

    by_name = {}
    for figure in fields(Margins):
        values = [getattr(margins, figure.name) for margins in found]
        by_name[figure.name] = np.array(values)
    return MarginUncertainty(
        nominal=controller.margins,
        by_name=by_name,
        stable=np.array(stable),
    )
