"""Files that are no log that can be read, by their beginning or name."""

import io
import re
import zipfile
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import shipped_toml

#: Kinds that are read, by the first bytes of their files.
_MAGIC = {
    b"\x93NUMPY": "numpy",
    b"PAR1": "parquet",
    b"MATLAB 5.0": "matlab",
    b"MATLAB 7.3": "matlab",
}


def kind_by_content(content: bytes) -> str | None:
    """Kind of a binary log that is read, whatever its name; None for others."""
    for magic, kind in _MAGIC.items():
        if content.startswith(magic):
            return kind
    if content.startswith(b"PK\x03\x04"):
        names = _names_in_zip(content)
        if "xl/workbook.xml" in names:
            return "excel"
        if names and all(name.endswith(".npy") for name in names):
            return "numpy"
    return None


def _names_in_zip(content: bytes) -> list[str]:
    try:
        return zipfile.ZipFile(io.BytesIO(content)).namelist()
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError):
        return []


def refuse_foreign(path: Path, content: bytes) -> None:
    """Raise InputError for a file of a known kind that is no log that can be read.

    It names the kind, and the smallest step to a log.
    """
    beginning = content[:4096].decode("latin-1").lower()
    for kind in shipped_toml("shipgym.trials.readers", "foreign.toml")["kind"]:
        magic = bytes.fromhex(kind.get("magic", ""))
        pattern = kind.get("text", "")
        ending = kind.get("ending", "")
        if (
            content.startswith(magic)
            and re.match(pattern, beginning, re.DOTALL)
            and path.name.lower().endswith(ending)
        ):
            what = kind["what"]
            step = kind["step"].replace("FILE", path.name)
            raise InputError(f"{path}: expected a log, got {what}; {step}")
