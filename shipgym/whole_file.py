"""Files written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from shipgym.errors import InputError


def write_text(text: str, path: Path) -> None:
    """Write text to a temporary name beside the file, then rename it.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be written.
    """
    write_bytes(text.encode("utf-8"), path)


def write_bytes(content: bytes, path: Path) -> None:
    """Write bytes to a temporary name beside the file, then rename it.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be written.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        draft.write_bytes(content)
        draft.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    finally:
        draft.unlink(missing_ok=True)
