"""Kinds of logs, recognised by name and beginning of a file, and their readers."""

import re
from collections.abc import Callable
from pathlib import Path

from shipgym.trials.readers.csv_file import read_csv
from shipgym.trials.readers.excel import read_excel
from shipgym.trials.readers.foreign import kind_by_content, refuse_foreign
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.matlab import read_matlab
from shipgym.trials.readers.numpy_file import read_numpy
from shipgym.trials.readers.parquet import read_parquet
from shipgym.trials.readers.text_files import read_log_bytes


def _read_nmea(path: Path) -> LogTable:
    from shipgym.trials.readers.nmea_log import read_nmea  # with its table of sentences

    return read_nmea(path)


READERS: dict[str, Callable[[Path], LogTable]] = {
    "csv": read_csv,
    "excel": read_excel,
    "matlab": read_matlab,
    "nmea": _read_nmea,
    "numpy": read_numpy,
    "parquet": read_parquet,
}
_ENDINGS = {".xlsx": "excel", ".mat": "matlab", ".parquet": "parquet"}
_NMEA_LINE = re.compile(r"^[^\n]{0,60}[$!][A-Z]{4,5},", re.MULTILINE)


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
    sentences = _NMEA_LINE.findall(beginning)
    if len(sentences) >= 2:
        return "nmea"
    refuse_foreign(path, content)
    return "csv"


def read_log(path: str | Path | LogTable) -> LogTable:
    """Read the table in a file, whatever its kind; a table is itself.

    Raises InputError for a file that is missing, too large, damaged, of no such kind,
    or whose library is missing.
    """
    if isinstance(path, LogTable):
        return path
    path = Path(path)
    return READERS[recognise_kind(path)](path)
