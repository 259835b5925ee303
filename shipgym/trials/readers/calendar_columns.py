"""One column of times for those of year, month, day, hour, minute and second."""

import re
from dataclasses import replace

import numpy as np

from shipgym.trials.readers.log_table import LogTable

#: Names in lower case, with nothing behind the first blank, bracket or underscore.
_NAMES = {
    "year": "year yyyy yr jahr année annee año ano anno år jaar 年 год",
    "month": "month mon mth monat mois mes mese mês måned maand månad 月 месяц",
    "day": "day dd tag jour día dia giorno dag 日 день",
    "hour": "hour hours hh hr hrs stunde std heure hora ora time timme uur 时 時 час",
    "minute": "minute minutes min mi minuto minutt minuut minut 分 минута",
    "second": "second seconds sec secs ss sekunde seconde segundo sekund 秒 секунда",
}


def with_one_time(table: LogTable) -> LogTable:
    """The table with one column of times where each part of them has a column.

    The date may be missing. A table without columns of hour, minute and second, or with
    other values than numbers in them, is returned as it is.
    """
    parts: dict[str, str] = {}
    for column in table.header:
        word = re.split(r"[ _\[(.]", column.strip().lower())[0]
        for part, words in _NAMES.items():
            if word in words.split():
                parts.setdefault(part, column)
    names = [parts[part] for part in _NAMES if part in parts]
    columns = [table.likely_numbers(name) for name in names]
    numbers = [column for column in columns if column is not None]
    is_clock = {"hour", "minute", "second"} <= parts.keys()
    if not is_clock or len(numbers) not in (3, 6) or len(columns) != len(numbers):
        return table
    times = [_written(row) for row in np.column_stack(numbers).tolist()]
    joined = " ".join(names)
    others = {name: one for name, one in table.cells.items() if name not in names}
    return replace(table, cells={f"Time ({joined})": np.array(times, object), **others})


def _written(parts: list[float]) -> str:
    """Date and clock time of their parts; empty where one is missing."""
    if np.isnan(parts).any():
        return ""
    *date, hour, minute, second = parts
    clock = f"{hour:02.0f}:{minute:02.0f}:{second:09.6f}"
    if not date:
        return clock
    year, month, day = date
    century = 2000 if year < 100 else 0
    return f"{year + century:04.0f}-{month:02.0f}-{day:02.0f} {clock}"
