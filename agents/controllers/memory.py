"""Observations and memories of many ships: arrays of rows and records of columns."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shipgym import InputError
from shipgym.arrays import Flags, Floats
from shipgym.engine.records import (
    Record,
    is_array,
    is_record,
    is_table,
    members,
)
from shipgym.tasks.scales import OBSERVATION_NAMES


def from_columns(record: Record, columns: Iterator[Any]) -> Any:
    """Record of columns in the order of its fields; a table takes one for each row."""
    values = []
    for _, kind in members(record):
        if is_record(kind) or is_array(kind):
            value = from_columns(kind, columns)
        elif is_table(kind):
            rows = list(islice(columns, kind.rows))
            value = np.array(rows)
        else:
            value = next(columns)
        values.append(value)
    return record(*values) if is_record(record) else tuple(values)


def to_rows(record: Any, n_ships: int) -> Floats:
    """Array of shape (n_ships, size) from a record of columns.

    A number in place of a column is that of all ships.
    """
    columns = [np.broadcast_to(one, n_ships) for one in _columns(record)]
    array = np.array(columns, dtype=np.float64)
    return array.reshape(len(columns), n_ships).T


def next_rows(after: Any, before: Any, n_ships: int) -> Floats:
    """Rows of a memory as `to_rows`, with what it was before where it is not finite.

    So one observation that is not a number does not stay in filters for good.
    """
    rows = to_rows(after, n_ships)
    is_finite = np.isfinite(rows)
    if is_finite.all():
        return rows
    return np.where(is_finite, rows, to_rows(before, n_ships))


def selected(record: Any, index: Any) -> Any:
    """Record of some of the ships, by an index of its columns.

    A number in place of a column is that of all ships.
    """
    values = []
    for value in record:
        if isinstance(value, tuple):
            values.append(selected(value, index))
        elif np.ndim(value) == 0:
            values.append(value)
        else:
            values.append(value[..., index])
    return type(record)(*values)


def _columns(record: Any) -> Iterator[Any]:
    for value in record:
        if isinstance(value, tuple):
            yield from _columns(value)
        elif np.ndim(value) == 2:  # a table
            yield from value
        else:
            yield value


def checked_observation(observation: ArrayLike, names: Sequence[str]) -> Floats:
    """Observations of shape (n_ships, n) or (n,), with no fewer entries than names."""
    given = np.asarray(observation, dtype=np.float64)
    n = len(names)
    if given.ndim not in (1, 2) or given.shape[-1] < n:
        raise InputError(
            f"observation: expected shape ({n},) or (n, {n}) or more entries, of which"
            f" '{names[-1]}' is the last that is needed, got {given.shape}"
        )
    return given


def checked_starts(starts: Any, shape: tuple[int, ...]) -> Flags:
    """Flags of episodes that begin, in the shape of the ships.

    None means that none begins; one flag counts for all ships.
    """
    flags = np.asarray(starts, dtype=np.bool_)  # False of None
    n = int(np.prod(shape))
    if flags.size not in (1, n):
        raise InputError(
            f"episode_start: expected one for each of {n} ships, got {flags.size}"
        )
    return np.broadcast_to(flags.ravel(), n).reshape(shape)


def checked_memory(memory: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Memory of ships; InputError for another shape."""
    array = np.asarray(memory)
    if array.shape != shape:
        raise InputError(
            f"state: expected shape {shape}, what the last predict of as many ships"
            f" returned, or None where episodes begin, got {array.shape}"
        )
    return array


def recalled(memory: Any, starts: Any, shape: tuple[int, ...], size: int) -> Floats:
    """Memory of each ship, a copy with zeros where an episode begins.

    Parameters
    ----------
    memory : array of shape (*shape, size) or None
        What the last `predict` returned; None where all episodes begin.
    starts : bool or array of bool or None
        Where the memory is that of the episode before.
    shape : tuple of int
        (n_ships,), or () for a single ship.
    """
    if memory is None:
        return np.zeros((*shape, size))
    given = checked_memory(memory, (*shape, size))
    begins = checked_starts(starts, shape)
    kept = given.astype(np.float64)
    kept[begins] = 0.0
    return kept


def on_course(
    seen: NDArray[Any], error: Floats, integral: Floats, reach: float
) -> NDArray[np.float32]:
    """Observations of ships with another heading error and its integral.

    `error`: rad; `integral`: rad s, of at most `reach`.
    """
    shown = seen.astype(np.float32)
    replaced = {
        "heading_error_sin": np.sin(error),
        "heading_error_cos": np.cos(error),
        "heading_error_integral": integral / reach,
    }
    for name, value in replaced.items():
        shown[..., OBSERVATION_NAMES.index(name)] = value
    return shown
