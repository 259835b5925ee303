"""Rows of a study in a file of JSON lines, so that a second call does what is left."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

Row = dict[str, Any]


class KeptRows:
    """Rows of a study, read from a file and added to it as they are found.

    Parameters
    ----------
    path : Path
        The file; it need not exist.
    case : sequence of str
        Fields of a row that say which case it is of.
    """

    def __init__(self, path: Path, case: Sequence[str]) -> None:
        self.path = path
        self.case = tuple(case)
        self.rows: list[Row] = []
        if path.exists():
            lines = path.read_text("utf-8").splitlines()
            self.rows = [json.loads(line) for line in lines]

    def __contains__(self, case: tuple[Any, ...]) -> bool:
        """True if there is a row of a case."""
        return any(case == tuple(row[name] for name in self.case) for row in self.rows)

    def add(self, row: Row) -> None:
        """Add a row, also to the file."""
        self.rows.append(row)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, default=plain) + "\n")


def plain(value: Any) -> Any:
    """Array or number of NumPy as JSON has it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"expected numbers, got {type(value).__name__}")
