"""Tables in pandas frames."""

from pathlib import Path
from typing import Any

from shipgym.errors import InputError
from shipgym.trials.readers.log_table import LogTable

#: Most values of a table.
MOST_CELLS = 5_000_000


def read_frame(frame: Any, name: str | Path = "frame", first: int = 0) -> LogTable:
    """Table in a pandas frame; an index other than a count of rows is a column.

    Messages call it `name`, and its rows by numbers from `first` on. Raises InputError
    for what is no frame, and for one without values or with too many.
    """
    if not hasattr(frame, "columns") or not hasattr(frame, "index"):
        kind = type(frame).__name__
        raise InputError(f"{name}: expected a pandas DataFrame, got a {kind}")
    index_kind = type(frame.index).__name__
    if index_kind != "RangeIndex":
        frame = frame.reset_index()
    n_rows, n_columns = frame.shape
    if not 0 < frame.size <= MOST_CELLS:
        raise InputError(
            f"{name}: expected a table of at most {MOST_CELLS} values, got {n_columns}"
            f" columns of {n_rows} rows; split the file, or leave out columns"
        )

    cells = {}
    for label, column in frame.items():
        column_name = str(label).strip()
        is_numeric = column.dtype.kind in "fiub"
        dtype = column.dtype if is_numeric else object
        cells[column_name] = column.to_numpy(dtype)
    return LogTable(
        path=Path(name),
        cells=cells,
        rows=range(first, first + n_rows),
    )
