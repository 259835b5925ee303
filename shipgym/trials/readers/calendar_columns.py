"""One column of times for those of year, month, day, hour, minute and second."""

import re
from dataclasses import replace

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
_DATE = ("year", "month", "day")
_CLOCK = ("hour", "minute", "second")


def with_one_time(table: LogTable) -> LogTable:
    """The table with one column of times where each part of them has a column.

    The date may be missing. A table without columns of hour, minute and second, or with
    other values than numbers in them, is returned as it is.
    """
    parts = _parts(table)
    if not set(_CLOCK) <= parts.keys():
        return table
    has_date = set(_DATE) <= parts.keys()
    wanted = (*_DATE, *_CLOCK) if has_date else _CLOCK
    texts = [table.texts(parts[part]) for part in wanted]
    try:
        times = [_written(cells) for cells in zip(*texts, strict=True)]
    except ValueError:
        return table

    names = [parts[part] for part in wanted]
    joined = " ".join(names)
    cells = {f"Time ({joined})": times}
    for name, column in table.cells.items():
        if name not in names:
            cells[name] = column
    return replace(table, cells=cells)


def _parts(table: LogTable) -> dict[str, str]:
    """Columns by the part of a time that they are."""
    parts: dict[str, str] = {}
    for column in table.header:
        word = re.split(r"[ _\[(.]", column.strip().lower())[0]
        for part, names in _NAMES.items():
            if word in names.split() and part not in parts:
                parts[part] = column
    return parts


def _written(cells: tuple[str, ...]) -> str:
    """Date and clock time of their parts; ValueError for what are no numbers."""
    if not all(cells):
        return ""
    *date, hour, minute, second = (float(cell.replace(",", ".")) for cell in cells)
    clock = f"{hour:02.0f}:{minute:02.0f}:{second:09.6f}"
    if not date:
        return clock
    year, month, day = date
    century = 2000 if year < 100 else 0
    return f"{year + century:04.0f}-{month:02.0f}-{day:02.0f} {clock}"
