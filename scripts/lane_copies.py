"""Lanes of an engine copied into those of another, to try what would come of each order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym.engine.records import LANES
from shipgym.envs.engine import Engine
from shipgym.envs.lanes import lanes_of
from shipgym.errors import InputError


def copy_lanes(engine: Engine, source: Engine, lanes: ArrayLike) -> None:
    """Make each lane of an engine the copy of one of another: same ship, same episode, same future.

    Gusts, noise and what will be asked are functions of the episode's seed and of the
    step, so copies that are steered alike go on bit for bit like the original.

    Parameters
    ----------
    engine, source : Engine
        Of the same task and ships.
    lanes : array-like of int, shape (engine.num_envs,)
        Which lane of `source` each lane becomes.

    Raises
    ------
    InputError
        If the engines differ in more than the number of lanes, or there is no such
        lane.
    """
    which = np.asarray(lanes)
    if which.shape != (engine.num_envs,) or which.dtype.kind not in "iu":
        raise InputError(
            f"lanes: {which.dtype} of shape {which.shape} found, expected"
            f" {engine.num_envs} whole numbers"
        )
    if which.min() < 0 or which.max() >= source.num_envs:
        raise InputError(
            f"lanes: {which.min()} to {which.max()} found, expected 0 to"
            f" {source.num_envs - 1}"
        )
    _check_alike(engine, source)
    there, here = divmod(which, LANES), divmod(np.arange(engine.num_envs), LANES)
    pairs: list[tuple[NDArray[Any], NDArray[Any]]] = [
        (engine._states, source._states),
        (engine._random, source._random),
    ]
    if not engine.program.shared:
        pairs.append((engine._ships, source._ships))
    for own, other in pairs:
        lanes_of(own)[here[0], :, here[1]] = lanes_of(other)[
            there[0] % len(other), :, there[1]
        ]
    engine.outputs.observations[:] = source.outputs.observations[which]
    engine.outputs.outcomes[:] = source.outputs.outcomes[:, which]
    engine.outputs.flags[:] = source.outputs.flags[:, which]


def _check_alike(engine: Engine, source: Engine) -> None:
    """Refuse an engine whose lanes cannot be taken over."""
    same_task = (
        engine.program is source.program
        and engine._states.shape[1] == source._states.shape[1]
        and engine.task == source.task
    )
    if not same_task:
        raise InputError(
            "source: an engine of another task found, expected one of the same"
        )
    if engine.program.shared and not np.array_equal(
        source._ships, engine._ships, equal_nan=True
    ):
        raise InputError(
            "source: an engine with other ships found, expected one with the same"
        )
