"""Ships that sail segments of trials, many side by side in lanes."""

from collections.abc import Sequence

import numpy as np

from identification.models.segments import Segment
from shipgym import ShipModel
from shipgym.arrays import Floats
from shipgym.engine.compiled_ship import STILL_WATER
from shipgym.engine.loops import ship_loop
from shipgym.engine.records import LANES
from shipgym.sea.open_sea import OPEN_SEA


def channel_units(model: ShipModel, channels: Sequence[str]) -> Floats:
    """Units in which channels are compared, shape (n_channels,).

    Service speed, that by ship length, and 1 rad.
    """
    speed = model.particulars["speed"]
    rate = speed / model.particulars["length"]
    units = {"u": speed, "v": speed, "r": rate, "p": rate, "psi": 1.0}
    return np.array([units[name] for name in channels])


def sail_lanes(
    model: ShipModel, segment: Segment, ships: Floats, starts: Floats
) -> Floats:
    """States of the ships of all lanes at the samples of a segment.

    Numbers of the ships and states at the start, a column for each lane. Shape
    (n_samples, n_state, LANES).
    """
    loop = ship_loop(
        model.compiled, "segments", OPEN_SEA if segment.has_wind else STILL_WATER
    )
    n_samples = len(segment.measured)
    states = np.empty((n_samples, starts.size))
    state = starts.copy()
    state[model.state_names.index("delta")] = segment.inputs[0, 1]
    loop(
        state.ravel(),
        ships.ravel(),
        segment.inputs,
        segment.samples,
        states,
    )
    return states.reshape(n_samples, -1, LANES)


def in_all_lanes(values: Floats) -> Floats:
    """The same values in a column for each lane, shape (n_values, LANES)."""
    return np.repeat(values, LANES).reshape(-1, LANES)
