"""Logs with a line for each value or message: MOOS alog, ArduPilot's text log."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.text_files import text_lines

#: Messages of ArduPilot that hold what moves and steers a boat.
_MESSAGES = ("ATT", "AHR2", "GPS", "STER", "RCOU", "RPM", "XKF1", "NKF1")
_MOST_VALUES = 5_000_000

#: Time, name and value of one line.
_Value = tuple[float, str, float]


def read_moos(path: Path, content: bytes) -> LogTable:
    """Read an alog of MOOS-IvP: lines of time, name, source and value.

    Raises InputError for one without numbers.
    """
    values: list[_Value] = []
    rows = []
    lines, _ = text_lines(path, content)
    for line, text in enumerate(lines, start=1):
        words = text.split()
        if len(words) != 4 or text.startswith("%"):
            continue
        time, name, _, value = words
        numbers = _numbers([time, value])
        if numbers:
            values.append((numbers[0], name, numbers[1]))
            rows.append(line)
    return _table(path, values, rows, unit="s")


def read_dataflash(path: Path, content: bytes) -> LogTable:
    """Read a text log of ArduPilot: messages whose columns its FMT lines name.

    Raises InputError for one without messages that tell motion or steering.
    """
    names: dict[str, list[str]] = {}
    values: list[_Value] = []
    rows = []
    lines, _ = text_lines(path, content)
    for line, one in enumerate(lines, start=1):
        kind, *words = [word.strip() for word in one.split(",")]
        if kind == "FMT" and len(words) > 4:
            names[words[2]] = words[4:]
        columns = names.get(kind, [])
        if kind not in _MESSAGES or len(words) != len(columns):
            continue
        texts = dict(zip(columns, words, strict=True))
        time = _number(texts.pop("TimeUS", ""))
        for column, text in texts.items():
            number = _number(text)
            if np.isfinite([time, number]).all():
                values.append((time, f"{kind}.{column}", number))
                rows.append(line)
    return _table(path, values, rows, unit="us")


def _number(text: str) -> float:
    """A number; nan for other text."""
    try:
        return float(text)
    except ValueError:
        return np.nan


def _numbers(texts: Sequence[str]) -> list[float]:
    """Numbers of texts; none where one is no number."""
    numbers = [_number(text) for text in texts]
    return numbers if np.isfinite(numbers).all() else []


def _table(
    path: Path, values: Sequence[_Value], lines: Sequence[int], unit: str
) -> LogTable:
    """Table with a row for each time and a column for each name with several values."""
    counts = Counter(name for _, name, _ in values)
    times, row_of = np.unique([time for time, _, _ in values], return_inverse=True)
    most_columns = max(2, _MOST_VALUES // max(1, times.size))
    names = [name for name, n in counts.most_common(most_columns) if n >= 3]
    if not names:
        raise InputError(
            f"{path}: expected numbers of heading, rudder or position, got none; write"
            " a CSV file with a column for each"
        )
    time_name = f"time [{unit}]"
    cells: dict[str, Any] = {name: np.full(times.size, np.nan) for name in names}
    rows = np.zeros(times.size, dtype=int)
    for (_, name, value), row, line in zip(values, row_of, lines, strict=True):
        rows[row] = line
        if name in cells:
            cells[name][row] = value
    return LogTable(
        path=path,
        cells={time_name: times, **cells},
        rows=rows.tolist(),
        place_words="line {line}",
        own_clocks=True,
    )
