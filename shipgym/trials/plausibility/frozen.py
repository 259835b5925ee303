"""A heading that stands still while the rudder is over, as of a stuck instrument."""

import numpy as np

from shipgym.trials.resampling import Log
from shipgym.trials.units import DEGREE


def frozen_heading(log: Log) -> list[str]:
    """Remark on the longest stretch in which the heading does not change at all.

    Of stretches of at least 10 s and 10 samples with the rudder over by more than 5
    deg.
    """
    if not log.has("psi", "delta"):
        return []
    shortest = 10.0  # s
    psi = log.channels["psi"]
    delta = log.channels["delta"]
    is_over = np.abs(delta) > 5.0 * DEGREE
    is_frozen = (np.abs(np.diff(psi)) < 1e-9) & is_over[1:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_frozen, [False]])))
    begins = log.t[edges[::2]]
    ends = log.t[edges[1::2]]
    is_long = (ends - begins >= shortest) & (np.diff(edges)[::2] >= 10)
    if not is_long.any():
        return []
    k = int(np.argmax(np.where(is_long, ends - begins, 0.0)))
    return [
        f"the heading stands still from {begins[k]:g} to {ends[k]:g} s while the rudder"
        " is over: the instrument was stuck; leave that part out with cut"
    ]
