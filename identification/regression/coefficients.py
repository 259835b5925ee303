"""From the coefficients of the accelerations to a model's hydrodynamic derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shipgym.arrays import Floats
from shipgym.ships import ShipModel


def with_accelerations(blank: ShipModel, accelerations: Mapping[str, Floats]) -> ShipModel:
    """The model with the hydrodynamic derivatives that follow from coefficients of accelerations.

    Coefficients of the terms of each equation, arrays of shape (n_terms,), SI units.
    """
    matrix = blank.table.acceleration_matrix(blank.particulars, blank.service_shaft_speed)
    values = np.linalg.solve(matrix, np.concatenate([accelerations[q] for q in blank.table.regressed]))
    return replace(blank, coefficients=dict(zip(blank.table.coefficient_names, values.tolist(), strict=True)))
