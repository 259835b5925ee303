"""Yaw with a memory: the regression of rdot = (terms of `r`) + q, qdot = (terms of `q`), q not measured.

The memory at the start of a window is unknown. It is the same constant in the mean yaw acceleration of two
windows of one trial once the terms of `q`, integrated from the start of the trial, stand on the right; so
their difference is free of it. That is the regression of the second-order equation weighted by two boxes
convolved, a modulating function (Shinbrot 1957, On the analysis of linear and nonlinear systems,
Trans. ASME 79): no derivative of a measured channel is formed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError

if TYPE_CHECKING:
    from identification.regression.samples import Samples

Floats = NDArray[np.float64]


def twice_integrated(t: Floats, integrals: Floats, moments: Floats) -> Floats:
    """Integral over each step of the integral since the first sample.

    Parameters
    ----------
    t : array of shape (n_samples,)
        s.
    integrals : array of shape (n_samples - 1, n_terms)
        Of the terms over each step.
    moments : array of shape (n_samples - 1, n_terms)
        Integrals over each step of term times the time left to its end.

    Returns
    -------
    array of shape (n_samples - 1, n_terms)
    """
    before = np.cumsum(integrals, axis=0) - integrals
    return before * np.diff(t)[:, None] + moments


def eliminated(part: Samples) -> Samples:
    """Rows of one trial from which the unknown memory is eliminated: those of one window less the next.

    Parameters
    ----------
    part : Samples
        Of one trial, the memory's terms among those of yaw.

    Returns
    -------
    Samples
        Of the rows that have a window after theirs; yaw in units of a change of velocity as before.

    Raises
    ------
    InputError
        For a trial of fewer than two windows.
    """
    end = part.start + part.duration
    following = np.searchsorted(part.start, end - 1e-9 * part.duration)
    rows = np.flatnonzero(following < len(part))
    if not rows.size:
        raise InputError(
            f"window: a trial of {len(part)} windows found, expected at least two after each other for a "
            "structure with a memory of yaw; give a smaller window, or longer trials"
        )
    after = following[rows]
    mean = {
        name: (values / part.duration[:, None] if values.ndim == 2 else values / part.duration)
        for name, values in (("features", part.features["r"]), ("targets", part.targets["r"]))
    }
    scale = 0.5 * (part.duration[rows] + part.duration[after])
    features = {q: values[rows] for q, values in part.features.items()}
    targets = {q: values[rows] for q, values in part.targets.items()}
    features["r"] = (mean["features"][after] - mean["features"][rows]) * scale[:, None]
    targets["r"] = (mean["targets"][after] - mean["targets"][rows]) * scale
    return replace(
        part,
        features=features,
        targets=targets,
        start=part.start[rows],
        duration=part.duration[rows],
        trial=part.trial[rows],
    )
