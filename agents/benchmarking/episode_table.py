"""The table of episodes as columns, and its Parquet file."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from agents.benchmarking.cells import Cells
from shipgym.arrays import Integers
from shipgym.checks import quoted
from shipgym.drafts import atomic_path
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import LARGEST_TENSORS, read_bytes

Columns = dict[str, NDArray[Any]]

KEYS = ("controller", "task", "run", "seed")
TEXT_KEYS = ("controller", "task")
#: Figures that are booleans in the file; missing ones are null.
FLAGS = ("left_corridor", "grounded", "success", "terminated", "failed")
MOST_NUMBERS = 5_000_000  # in a table; characters in a column of texts


def episode_table(cells: Cells, seeds: Integers) -> Columns:
    """Return a row for each episode of cells, which are by controller and task.

    Figures that a cell lacks are NaN.
    """
    blocks = []
    for (name, task), cell in cells.items():
        for number, run in enumerate(cell.runs):
            content = {
                "controller": name,
                "task": task,
                "run": number,
                "seed": seeds,
                **run.figures,
            }
            blocks.append(pd.DataFrame(content))
    table = pd.concat(blocks, ignore_index=True)

    columns: Columns = {}
    for name in table:
        kind: Any = np.float64
        if name in TEXT_KEYS:
            kind = np.str_
        elif name in KEYS:
            kind = np.int64
        values = table[name].to_numpy()
        columns[name] = values.astype(kind)
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
    arrays = {}
    for name, values in columns.items():
        arrays[name] = _to_arrow(arrow, name, values)
    with atomic_path(path) as draft:
        parquet.write_table(arrow.table(arrays), draft, compression="zstd")


def _to_arrow(arrow: Any, name: str, values: NDArray[Any]) -> Any:
    if name in TEXT_KEYS:
        return arrow.array(values.tolist())
    if name in KEYS:
        return arrow.array(values)

    missing = np.isnan(values)
    known = np.where(missing, 0.0, values)
    if name in FLAGS:
        known = known.astype(np.bool_)
    return arrow.array(known, mask=missing)


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
        columns: Columns = {}
        for name in names:
            values = file.read([name]).column(0)
            columns[name] = _from_arrow(arrow, name, values)
        return columns
    except InputError:
        raise
    except malformed as error:
        raise InputError(
            f"{path}: expected a Parquet file, got one that cannot be read ({error});"
            " it may be cut short"
        ) from None


def _check_table(names: list[str], n_rows: int, expected: int, path: Path) -> None:
    """Refuse a table of another size, or without its keys, before it is read."""
    n_columns = len(names)
    n_numbers = expected * n_columns
    if n_rows != expected or n_numbers > MOST_NUMBERS:
        raise InputError(
            f"{path}: expected {expected} rows, got {n_rows} of {n_columns} columns"
        )
    different = set(names)
    has_keys = different.issuperset(KEYS)
    if len(different) < n_columns or not has_keys:
        raise InputError(
            f"{path}: expected columns {quoted(KEYS)} and figures, got {quoted(names)}"
        )


def _from_arrow(arrow: Any, name: str, values: Any) -> NDArray[Any]:
    """Convert a column; raises ValueError or TypeError if it is of another type."""
    if name in TEXT_KEYS:
        return _from_texts(name, values.cast(arrow.string()).to_pylist())

    kind = values.type
    is_integer = arrow.types.is_integer(kind)
    is_floating = arrow.types.is_floating(kind)
    if not is_integer and not is_floating and name not in FLAGS:
        raise TypeError(f"column '{name}' of {kind}")

    wanted = arrow.int64() if name in KEYS else arrow.float64()
    numbers: NDArray[Any] = values.cast(wanted).to_numpy(zero_copy_only=False)
    if name in KEYS and numbers.dtype != np.int64:
        raise ValueError(f"column '{name}' has rows without a value")
    return numbers


def _from_texts(name: str, texts: list[str]) -> NDArray[np.str_]:
    lengths = [len(text) for text in texts]
    n_characters = max(lengths, default=0) * len(texts)  # of the array
    if n_characters > MOST_NUMBERS:
        raise ValueError(f"column '{name}' of long texts")
    return np.array(texts, dtype=np.str_)
