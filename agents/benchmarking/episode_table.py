"""The table of episodes as columns, and its Parquet file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.cells import Cell
from shipgym.arrays import Integers
from shipgym.checks import quoted
from shipgym.drafts import atomic_path
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import LARGEST_TENSORS, read_bytes

Columns = dict[str, NDArray[Any]]

KEYS = ("controller", "task", "run", "seed")
TEXT_KEYS = ("controller", "task")
#: Figures that are true or false in the file; missing ones are null.
FLAGS = ("left_corridor", "grounded", "success", "terminated", "failed")
MOST_NUMBERS = 5_000_000  # in a table; characters in a column of texts


def episode_table(cells: Mapping[tuple[str, str], Cell], seeds: Integers) -> Columns:
    """Return a row for each episode of cells, which are by controller and task.

    Figures that a cell lacks are NaN.
    """
    runs = [
        (name, task, number, run)
        for (name, task), cell in cells.items()
        for number, run in enumerate(cell.runs)
    ]
    n_episodes = len(seeds)
    columns: Columns = {
        "controller": np.repeat([name for name, *_ in runs], n_episodes),
        "task": np.repeat([task for _, task, *_ in runs], n_episodes),
        "run": np.repeat([number for *_, number, _ in runs], n_episodes),
        "seed": np.tile(seeds, len(runs)),
    }
    figures = dict.fromkeys(figure for *_, run in runs for figure in run.figures)
    missing = np.full(n_episodes, np.nan)
    for figure in figures:
        parts = [run.figures.get(figure, missing) for *_, run in runs]
        columns[figure] = np.concatenate(parts, dtype=np.float64)
    return columns


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and its module for Parquet.

    Raises InputError saying how it is installed if it is not there.
    """
    extra = "benchmark", "the table of episodes needs it"
    return library("pyarrow", *extra), library("pyarrow.parquet", *extra)


def write_episodes(columns: Columns, path: Path) -> None:
    """Write a table as Parquet, whole or not at all.

    Raises InputError if it cannot be written.
    """
    arrow, parquet = pyarrow()
    arrays = {name: _to_arrow(arrow, name, one) for name, one in columns.items()}
    with atomic_path(path) as draft:
        parquet.write_table(arrow.table(arrays), draft, compression="zstd")


def _to_arrow(arrow: Any, name: str, values: NDArray[Any]) -> Any:
    if name in TEXT_KEYS:
        return arrow.array(values.tolist())
    if name in KEYS:
        return arrow.array(values)
    missing = np.isnan(values)
    kind = np.bool_ if name in FLAGS else np.float64
    return arrow.array(np.where(missing, 0.0, values).astype(kind), mask=missing)


def read_episodes(path: Path, rows: int) -> Columns:
    """Read so many rows that `write_episodes` wrote; null is NaN.

    Raises InputError if the file is missing or another.
    """
    arrow, parquet = pyarrow()
    content = read_bytes(path, "file of episodes", LARGEST_TENSORS)
    malformed = (OSError, arrow.ArrowException, ValueError, TypeError, OverflowError)
    try:
        file = parquet.ParquetFile(arrow.BufferReader(content))
        names = file.schema_arrow.names
        _check_table(names, file.metadata.num_rows, rows, path)
        return {
            name: _from_arrow(arrow, name, file.read([name]).column(0))
            for name in names
        }
    except InputError:
        raise
    except malformed as error:
        raise InputError(
            f"{path}: expected a Parquet file, got one that cannot be read ({error}); it"
            " may be cut short"
        ) from None


def _check_table(names: list[str], n_rows: int, expected: int, path: Path) -> None:
    """Refuse a table of another size, or without its keys, before it is read."""
    if n_rows != expected or expected * len(names) > MOST_NUMBERS:
        raise InputError(
            f"{path}: expected {expected} rows, got {n_rows} of {len(names)} columns"
        )
    if len(set(names)) < len(names) or not set(KEYS) <= set(names):
        raise InputError(
            f"{path}: expected columns {quoted(KEYS)} and figures, got {quoted(names)}"
        )


def _from_arrow(arrow: Any, name: str, values: Any) -> NDArray[Any]:
    """Convert a column; raises ValueError or TypeError if it is of another type."""
    if name in TEXT_KEYS:
        texts = values.cast(arrow.string()).to_pylist()
        longest = max(map(len, texts), default=0)
        if len(texts) * longest > MOST_NUMBERS:
            raise ValueError(f"column '{name}' of long texts")
        return np.array(texts, dtype=np.str_)

    kind = values.type
    is_number = arrow.types.is_integer(kind) or arrow.types.is_floating(kind)
    if not is_number and name not in FLAGS:
        raise TypeError(f"column '{name}' of {kind}")
    wanted = arrow.int64() if name in KEYS else arrow.float64()
    numbers: NDArray[Any] = values.cast(wanted).to_numpy(zero_copy_only=False)
    if name in KEYS and numbers.dtype != np.int64:
        raise ValueError(f"column '{name}' has rows without a value")
    return numbers
