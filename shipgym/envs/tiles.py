"""Tiles of 64 ships: how ships are laid out for the loops, and how threads share them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.arrays import Floats
from shipgym.engine.envelope import Envelope
from shipgym.engine.motion import Ship
from shipgym.engine.records import LANES, leaves
from shipgym.envs.randomisation import Pool
from shipgym.sea.weather_column import weather_column
from shipgym.ships import ShipModel
from shipgym.tasks.task import Task


def lanes_of(tiles: NDArray[Any]) -> NDArray[Any]:
    """Tiles with an axis for their lanes, shape (n_tiles, n_rows, 64), a view."""
    return tiles.reshape(len(tiles), -1, LANES)


class Threads:
    """Threads that share the tiles of an engine; the first share is done by the thread that asks."""

    def __init__(self, tiles: int, threads: int) -> None:
        count = min(threads, tiles)
        bounds = np.linspace(0, tiles, count + 1).astype(int).tolist()
        self.shares: list[tuple[int, int]] = list(pairwise(bounds))
        self._pool = ThreadPoolExecutor(count - 1, "shipgym") if count > 1 else None

    def run(self, loop: Any, worlds: Sequence[NDArray[np.int64]], asked: int) -> list[int]:
        """What the loop returns for each share."""
        if self._pool is None:
            return [loop(worlds[0], asked)]
        waiting = [self._pool.submit(loop, world, asked) for world in worlds[1:]]
        return [loop(worlds[0], asked), *(share.result() for share in waiting)]


def ship_columns(pool: Pool, windy: bool, task: Task, base: ShipModel, drawn: bool) -> Floats:
    """Numbers of ships and of the seas they meet, a row each; the sea worked out once for each kind of ship.

    Ships that are drawn for an episode are seen in the scales of the environment's model.
    """
    known: dict[tuple[int, int], Floats] = {}
    columns = []
    for model, sea in pool:
        kind = (id(model.particulars), id(sea))
        if windy and kind not in known:
            known[kind] = weather_column(model, sea, task.substep(base), task.water_depth)
        numbers = model.ship_numbers(task.water_depth)
        if drawn and model.particulars["length"] == base.particulars["length"]:
            numbers[Ship._fields.index("scale_speed")] = base.particulars["speed"]
        ship = Ship(*numbers[: len(Ship._fields)].tolist())
        scales = [task.scale(path, ship) for path in task.definition.seen]
        per_scale = [1.0 / scale if scale else 0.0 for scale in scales]
        columns.append([*numbers, *envelope_numbers(model), *known.get(kind, ()), *per_scale])
    return np.stack(columns)


def envelope_numbers(model: ShipModel) -> Floats:
    """The envelope of a model's data in the order of its record; without one everything is inside."""
    if model.envelope is None:
        numbers = np.zeros(len(leaves(Envelope)))
        numbers[:4], numbers[4:8] = -np.inf, np.inf
        return numbers
    data = model.envelope
    return np.concatenate([data.low, data.high, data.centre, data.shape[np.triu_indices(4)]])


def ship_tiles(columns: Floats, tiles: int, own: bool) -> Floats:
    """One vector for all lanes, or a tile for each tile of states."""
    if len(columns) == 1 and not own:
        return columns.copy()
    rest = np.tile(columns[:1], (max(tiles * LANES - len(columns), 0), 1))
    lanes = np.concatenate([columns[: tiles * LANES], rest])
    return np.ascontiguousarray(lanes.reshape(tiles, LANES, -1).transpose(0, 2, 1)).reshape(tiles, -1)
