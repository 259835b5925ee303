"""The table of episodes as columns, and its Parquet file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.checks import quoted
from shipgym.drafts import atomic_path
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import LARGEST_TENSORS, read_bytes

Columns = dict[str, NDArray[Any]]

KEYS = ("contestant", "task", "run", "seed")
#: Figures that are yes or no, and numbers of events: so they are in the file; missing
#: ones are null.
FLAGS = ("left_corridor", "grounded", "success", "terminated", "failed")
COUNTS = ("interventions",)
MOST_NUMBERS = 5_000_000  # of a table; characters of a column of texts


def joined(
    parts: Sequence[
        tuple[str, str, int, NDArray[np.int64], Mapping[str, NDArray[np.float64]]]
    ],
) -> Columns:
    """One table of the episodes of all contestants, tasks and runs; figures that one lacks are NaN."""
    counts = [len(seeds) for *_, seeds, _ in parts]
    columns: Columns = {
        "contestant": np.repeat(
            np.array([part[0] for part in parts], dtype=np.str_), counts
        ),
        "task": np.repeat(np.array([part[1] for part in parts], dtype=np.str_), counts),
        "run": np.repeat(np.array([part[2] for part in parts], dtype=np.int64), counts),
        "seed": np.concatenate(
            [np.zeros(0, dtype=np.int64), *(part[3] for part in parts)]
        ),
    }
    for name in dict.fromkeys(name for *_, figures in parts for name in figures):
        columns[name] = np.concatenate(
            [part[4].get(name, np.full(len(part[3]), np.nan)) for part in parts],
            dtype=np.float64,
        )
    return columns


def pyarrow() -> tuple[Any, Any]:
    """Pyarrow and its part for Parquet; an InputError saying how it is installed if it is not there."""
    extra = "benchmark", "the table of episodes needs it"
    return library("pyarrow", *extra), library("pyarrow.parquet", *extra)


def write_episodes(columns: Columns, path: Path) -> None:
    """Write a table as Parquet, whole or not at all; raises InputError if it cannot be written."""
    arrow, parquet = pyarrow()
    arrays = {name: _array(arrow, name, values) for name, values in columns.items()}
    with atomic_path(path) as draft:
        parquet.write_table(arrow.table(arrays), draft, compression="zstd")


def read_episodes(path: Path, rows: int) -> Columns:
    """Read what `write_episodes` wrote, so many rows; figures as float64, null as NaN.

    Raises InputError if it is missing or no such file.
    """
    arrow, parquet = pyarrow()
    content = read_bytes(path, "file of episodes", LARGEST_TENSORS)
    try:
        file = parquet.ParquetFile(arrow.BufferReader(content))
        found, names = file.metadata.num_rows, file.schema_arrow.names
        if found != rows or rows * len(names) > MOST_NUMBERS:
            raise InputError(
                f"{path}: {len(names)} columns of {found} rows found, expected {rows}"
                " rows"
            )
        if len(set(names)) < len(names) or not set(KEYS) <= set(names):
            raise InputError(
                f"{path}: columns {quoted(names)} found, expected {quoted(KEYS)} and"
                " figures"
            )
        return {
            name: _column(arrow, name, file.read([name]).column(0)) for name in names
        }
    except InputError:
        raise
    except (
        OSError,
        arrow.ArrowException,
        ValueError,
        TypeError,
        OverflowError,
    ) as error:
        raise InputError(
            f"{path}: cannot be read as Parquet ({error}); it may be cut short"
        ) from None


def _column(arrow: Any, name: str, values: Any) -> NDArray[Any]:
    """A column of the file as an array; ValueError or TypeError if it is of another type."""
    if name in KEYS[:2]:
        texts = values.cast(arrow.string()).to_pylist()
        if len(texts) * len(max(texts, key=len, default="")) > MOST_NUMBERS:
            raise ValueError(f"column '{name}' of long texts")
        return np.array(texts, dtype=np.str_)
    if not (
        arrow.types.is_integer(values.type)
        or arrow.types.is_floating(values.type)
        or name in FLAGS
    ):
        raise TypeError(f"column '{name}' of {values.type}")
    kind = arrow.int64() if name in KEYS else arrow.float64()
    numbers: NDArray[Any] = values.cast(kind).to_numpy(zero_copy_only=False)
    if name in KEYS and numbers.dtype != np.int64:
        raise ValueError(f"column '{name}' has rows without a value")
    return numbers


def _array(arrow: Any, name: str, values: NDArray[Any]) -> Any:
    if name in KEYS:
        return arrow.array(values.tolist() if values.dtype.kind == "U" else values)
    missing = np.isnan(values)
    kind = np.bool_ if name in FLAGS else np.int64 if name in COUNTS else np.float64
    return arrow.array(np.where(missing, 0.0, values).astype(kind), mask=missing)
