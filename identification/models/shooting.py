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


def sail(model: ShipModel, segment: Segment, ships: Floats, starts: Floats) -> Floats:
    """States of ships at the samples of a segment, shape (n_samples, n_state, n_ships).

    Numbers of the ships and states at the start, a column for each.
    """
    n_ships = ships.shape[1]
    tiles = []
    for first in range(0, n_ships, LANES):
        # the last ship fills the lanes that are left
        lanes = np.minimum(first + np.arange(LANES), n_ships - 1)
        tiles.append(_in_lanes(model, segment, ships[:, lanes], starts[:, lanes]))
    return np.concatenate(tiles, axis=2)[:, :, :n_ships]


def _in_lanes(
    model: ShipModel, segment: Segment, ships: Floats, starts: Floats
) -> Floats:
    """The same of as many ships as there are lanes."""
    sea = OPEN_SEA if segment.has_wind else STILL_WATER
    loop = ship_loop(model.compiled, "segments", sea)
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


def in_columns(values: Floats, number: int) -> Floats:
    """The same values in so many columns, shape (n_values, number)."""
    return np.repeat(values[:, None], number, axis=1)
