"""Memory of an engine: all its arrays in one, which a loop takes as one argument.

Passing a dozen arrays takes the interpreter longer than a step of a ship. So tables of
an engine lie one after another in one array of float64, which begins with the record of
their locations, `Arguments`. Tables of other types share it as views.
"""

from collections.abc import Mapping
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from shipgym.arrays import Floats

WORD = 8  # bytes of a float64
# words of a cache line, at which tables begin: a vector across two takes twice as long
LINE = 8


class Block(NamedTuple):
    """Location of a table."""

    first: int  # entry of the float64 array at which it begins
    rows: int
    columns: int


class Arguments(NamedTuple):
    """The tables of an engine; the last three lie in the memory of its outputs."""

    states: Block  # float64 (n_tiles, n_rows * 64)
    random: Block  # uint64 (n_tiles, 3 * 64)
    # float64 (n_tiles, n_ship_rows * 64), or (1, n_ship_rows) where all share a ship
    ships: Block
    pool: Block  # float64 (1, n_pool * n_ship_rows), of which each episode draws one
    settings: Block  # float64 (1, n): of engine and sensor set
    task_settings: Block  # float64 (1, n)
    results: Block  # float64 (1, n_result_rows * 64): room for those of a tile
    actions: Block  # float32 (n_commands, n_ships)
    chosen: Block  # bool (1, n_ships): lanes in which an episode is to begin
    # int64 (1, n): entries of a tile's results at which the rows of outputs begin
    observed: Block
    informed: Block
    # int64 (1, n): entries of a tile's states at which further rows begin
    reported: Block
    flagged: Block  # int64 (1, n): rows of outcomes
    observations: Block  # float32 (n_ships, n_observations)
    # float64 (n_outcomes, n_ships): reward, terminated, truncated, info
    outcomes: Block
    flags: Block  # bool (n_flags, n_ships): terminated, truncated, those of info


def row_in(memory: Any, at: Block, row: int) -> Any:
    """Return one row of a table of float64."""
    first = at.first + row * at.columns
    return memory[first : first + at.columns]


def uint64_row_in(memory: Any, at: Block, row: int) -> Any:
    """Return one row of a table of uint64."""
    return np.frombuffer(row_in(memory, at, row), dtype=np.uint64)


def int64_row_in(memory: Any, at: Block, row: int) -> Any:
    """Return one row of a table of int64."""
    return np.frombuffer(row_in(memory, at, row), dtype=np.int64)


def float32_in(memory: Any, at: Block) -> Any:
    """Return a table of float32, row after row."""
    size = at.rows * at.columns
    words = memory[at.first : at.first + (size + 1) // 2]
    return np.frombuffer(words, dtype=np.float32)[:size]


def bool_in(memory: Any, at: Block) -> Any:
    """Return a table of bool, row after row."""
    size = at.rows * at.columns
    words = memory[at.first : at.first + (size + 7) // 8]
    return np.frombuffer(words, dtype=np.bool_)[:size]


def allocated(
    tables: Mapping[str, NDArray[Any]],
    first: int = 0,
) -> tuple[dict[str, Block], int]:
    """Blocks for tables by name, one after another, and the entry at which they end.

    The first begins at `first` or at the next cache line.
    """
    blocks = {}
    for name, table in tables.items():
        first = LINE * ceil(first / LINE)
        rows, columns = table.shape
        blocks[name] = Block(first, rows, columns)
        first += ceil(table.nbytes / WORD)
    return blocks, first


def zeros(size: int) -> Floats:
    """Make an array of zeros that begins with a cache line, shape (size,)."""
    memory = np.zeros(size + LINE)
    first = -(memory.ctypes.data // WORD) % LINE
    return memory[first : first + size]


def table_in(memory: Floats, at: Block, dtype: DTypeLike) -> NDArray[Any]:
    """Return the table at a block, a view."""
    shape = (at.rows, at.columns)
    return np.ndarray(shape, dtype, memory, WORD * at.first)
