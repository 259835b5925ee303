"""Tiles of 64 ships: how ships are laid out for the kernels, and how threads share them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.envs.task import Task
from shipgym.envs.variety import SmallFleet
from shipgym.kernels import layout
from shipgym.sea.weather_column import weather_column
from shipgym.ships import ShipModel

Floats = NDArray[np.float64]
REFUSED = -1  # the kernel's answer to commands that are no numbers


def lanes_of(tiles: NDArray[Any]) -> NDArray[Any]:
    """Tiles with an axis for their lanes, shape (n_tiles, n_rows, 64), a view."""
    return tiles.reshape(len(tiles), -1, layout.LANES)


class Team:
    """Threads that share the tiles of an engine; the first share is done by the thread that asks."""

    def __init__(self, tiles: int, threads: int) -> None:
        count = min(threads, tiles)
        bounds = np.linspace(0, tiles, count + 1).astype(int).tolist()
        self._own, *self._others = list(pairwise(bounds))
        self._pool = ThreadPoolExecutor(len(self._others), "shipgym") if self._others else None

    def shared(self, stepping: Callable[..., Callable[[bool], int]]) -> Callable[[bool], int]:
        """The step of all tiles, given that of the tiles from one up to another; its counts are summed."""
        own = stepping(*self._own)
        if self._pool is None:
            return own
        submit, others = self._pool.submit, [stepping(*bounds) for bounds in self._others]

        def run(next_ones: bool) -> int:
            waiting = [submit(share, next_ones) for share in others]
            counts = [own(next_ones), *(share.result() for share in waiting)]
            return REFUSED if REFUSED in counts else sum(counts)

        return run


def addresses(arrays: Sequence[NDArray[Any]]) -> list[int]:
    """Addresses and shapes of arrays, by turns; the caller keeps the arrays alive."""
    return [word for array in arrays for word in (array.ctypes.data, *array.shape[:2])]


def ship_columns(own: SmallFleet, windy: bool, task: Task, base: ShipModel, drawn: bool) -> Floats:
    """Ships and their weather as the kernels read them, a row each; the weather worked out once a kind.

    Ships that are drawn for an episode are seen in the scales of the environment's model.
    """
    known: dict[tuple[int, int], Floats] = {}
    columns = []
    for model, sea in own:
        kind = (id(model.particulars), id(sea))
        if windy and kind not in known:
            known[kind] = weather_column(model, sea, task.substep(base), task.water_depth)
        column = model.ship_column(task.water_depth, known.get(kind))
        if drawn and model.particulars["length"] == base.particulars["length"]:
            column[layout.row(layout.SCALE_SPEED)] = base.particulars["speed"]
        columns.append(column)
    return np.stack(columns)


def ship_tiles(columns: Floats, tiles: int, own: bool) -> Floats:
    """One tile for all lanes, or a column for each."""
    if len(columns) == 1:
        tile = np.repeat(columns[0], layout.LANES)[None]
        return np.tile(tile, (tiles, 1)) if own else tile
    rest = np.tile(columns[:1], (tiles * layout.LANES - len(columns), 1))
    lanes = np.concatenate([columns, rest])
    return np.ascontiguousarray(lanes.reshape(tiles, layout.LANES, -1).transpose(0, 2, 1)).reshape(tiles, -1)
