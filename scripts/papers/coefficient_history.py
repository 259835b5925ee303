"""The history of a model's coefficients over a trial, by a recursive method."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from identification.estimators.recursive import Recursion
from identification.samples.samples import build_samples
from shipgym import Particulars, Trial
from shipgym.ships import get_structure

Floats = NDArray[np.float64]


def coefficient_history(
    trial: Trial, structure: str, particulars: Particulars, method: Recursion
) -> tuple[Floats, dict[str, Floats]]:
    """Times of the ends of windows, s, and the estimate of each coefficient there."""
    table = get_structure(structure)
    samples = build_samples([trial], structure=table, particulars=particulars)
    histories = []
    for q in table.regressed:
        own = clone(method)
        histories.append(own.fit_history(samples.features[q], samples.targets[q]))
    matrix = table.acceleration_matrix(particulars)
    coefficients = np.linalg.solve(matrix, np.hstack(histories).T)
    names = table.coefficient_names
    return samples.start + samples.duration, dict(zip(names, coefficients, strict=True))
