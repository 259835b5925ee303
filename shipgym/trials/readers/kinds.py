"""Kinds of logs, recognised by name and beginning of a file, and their readers."""

import re
from collections.abc import Callable
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, expecting, read_bytes, shipped_toml
from shipgym.trials.readers.csv_file import read_csv
from shipgym.trials.readers.frames import read_excel, read_parquet
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.matlab import read_matlab
from shipgym.trials.readers.messages import RAW_FRAME

Reader = Callable[[Path, bytes], LogTable]

_BY_ENDING: dict[str, Reader] = {
    ".xlsx": read_excel,
    ".mat": read_matlab,
    ".parquet": read_parquet,
}
_BY_MAGIC: dict[bytes, Reader] = {
    b"PAR1": read_parquet,
    b"MATLAB 5.0": read_matlab,
    b"MATLAB 7.3": read_matlab,
}
#: Sentences of NMEA 0183, deltas of Signal K and messages of NMEA 2000 at the beginning
#: of a file.
_MESSAGES = re.compile(
    r"""^(?:[^\n]{0,200}[$!][A-Za-z0-9]{2}[A-Z]{3},
    |[^\n]{0,80}\{[^\n]*"(?:updates|pgn)":)""",
    re.MULTILINE | re.VERBOSE,
)


def _reader(path: Path, content: bytes) -> Reader:
    """Reader of a log; a text is a table unless it begins with messages.

    Raises InputError for a known kind of file that is no log.
    """
    ending = path.suffix.lower()
    if ending in _BY_ENDING:
        return _BY_ENDING[ending]
    for magic, reader in _BY_MAGIC.items():
        if content.startswith(magic):
            return reader
    beginning = content[:4096].decode("latin-1").replace("\r", "\n")
    sentences = _MESSAGES.findall(beginning)
    frames = RAW_FRAME.findall(beginning)
    if len(sentences) + len(frames) >= 2:
        from shipgym.trials.readers.message_log import read_messages  # with its tables

        return read_messages
    _refuse_foreign(path, content)
    return read_csv


def _refuse_foreign(path: Path, content: bytes) -> None:
    """Refuse a file that is no log; name its kind, and the smallest step to a log."""
    beginning = content[:4096].decode("latin-1").lower()
    for kind in shipped_toml("shipgym.trials.readers", "foreign.toml")["kind"]:
        magics = tuple(bytes.fromhex(magic) for magic in kind.get("magic", []))
        if (
            content.startswith(magics)
            or re.match(kind.get("text", "(?!)"), beginning, re.DOTALL)
            or path.suffix.lower() == kind.get("ending")
        ):
            step = kind["step"].replace("FILE", path.name)
            raise InputError(f"{path}: expected a log, got {kind['what']}; {step}")


def read_log(path: str | Path | LogTable) -> LogTable:
    """Read the table in a file, whatever its kind; a table is itself.

    Raises InputError for a file that is missing, too large, damaged, of no such kind,
    or whose library is missing.
    """
    if isinstance(path, LogTable):
        return path
    path = Path(path)
    with expecting("log", path):
        content = read_bytes(path, "log", LARGEST_CSV)
        read = _reader(path, content)
    return read(path, content)
