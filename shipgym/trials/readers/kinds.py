"""Kinds of logs, recognised by name and beginning of a file, and their readers."""

import re
from collections.abc import Callable
from pathlib import Path

from shipgym.trials.readers.calendar_columns import with_one_time
from shipgym.trials.readers.csv_file import read_csv
from shipgym.trials.readers.excel import read_excel
from shipgym.trials.readers.foreign import kind_by_content, refuse_foreign
from shipgym.trials.readers.gpx import read_gpx
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.matlab import read_matlab
from shipgym.trials.readers.numpy_file import read_numpy
from shipgym.trials.readers.parquet import read_parquet
from shipgym.trials.readers.text_files import read_log_bytes


def _read_messages(path: Path, checksums: str = "optional") -> LogTable:
    from shipgym.trials.readers.message_log import read_messages  # with its tables

    return read_messages(path, strict=checksums == "required")


READERS: dict[str, Callable[[Path], LogTable]] = {
    "csv": read_csv,
    "excel": read_excel,
    "gpx": read_gpx,
    "matlab": read_matlab,
    "messages": _read_messages,
    "numpy": read_numpy,
    "parquet": read_parquet,
}
_ENDINGS = {".xlsx": "excel", ".mat": "matlab", ".parquet": "parquet"}
#: Sentences of NMEA 0183, deltas of Signal K and messages of NMEA 2000 at the beginning
#: of a file.
_MESSAGES = re.compile(
    r"""^(?:[^\n]{0,200}[$!][A-Z][A-Z0-9]{3,4},
    |[^\n]{0,80}\{[^\n]*"updates""?:
    |[^\n]{0,80}\{[^\n]*"pgn":
    |[^\n]{0,30}\d{4}-\d\d-\d\d\S+(?:,\d,\d{5,6},|\s+\d\s+\d+\s+\d+\s+\d{5,6}\s)
    |[^\n]{0,40}can\d+\s+[0-9A-F]{8}(?:\#|\s+\[)
    |\d\d:\d\d:\d\d\.\d+\ [RT]\ [0-9A-F]{8}\s
    |A\d+\.\d+\ [0-9A-F]{5}\ [0-9A-F]{5}\s)""",
    re.MULTILINE | re.VERBOSE,
)


def recognise_kind(path: Path) -> str:
    """Kind of a log, a key of `READERS`; a text is CSV unless it begins otherwise.

    Raises InputError for a text file that is missing or too large.
    """
    ending = path.suffix.lower()
    if ending in _ENDINGS:
        return _ENDINGS[ending]
    content = read_log_bytes(path, "CSV file")
    binary = kind_by_content(content)
    if binary is not None:
        return binary
    beginning = content[:4096].decode("latin-1")
    beginning = beginning.replace("\r", "\n")
    if len(_MESSAGES.findall(beginning)) >= 2:
        return "messages"
    if "<gpx" in beginning:
        return "gpx"
    refuse_foreign(path, content)
    return "csv"


def read_log(path: str | Path | LogTable, *, checksums: str = "optional") -> LogTable:
    """Read the table in a file, whatever its kind; a table is itself.

    With `checksums` "required" sentences of NMEA 0183 without one count as damaged.
    Raises InputError for a file that is missing, too large, damaged, of no such kind,
    or whose library is missing.
    """
    if isinstance(path, LogTable):
        return path
    path = Path(path)
    kind = recognise_kind(path)
    if kind == "messages":
        return _read_messages(path, checksums)
    read = READERS[kind]
    table = read(path)
    return with_one_time(table)
