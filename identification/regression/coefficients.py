"""From the coefficients of the accelerations to a model's hydrodynamic derivatives."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shipgym.arrays import Floats
from shipgym.ships import ShipModel


def with_accelerations(blank: ShipModel, accelerations: Mapping[str, Floats]) -> ShipModel:
    """The model with the hydrodynamic derivatives that follow from coefficients of accelerations.

    Coefficients of the terms of each equation, arrays of shape (n_terms,), SI units.
    """
    stacked = np.concatenate([accelerations[q] for q in blank.table.regressed])
    return blank.with_coefficients(np.linalg.solve(blank.acceleration_matrix, stacked))
