"""Files and folders written under a draft's name and renamed when complete.

Where others may write, as in /tmp, a name that can be guessed would let a link of
theirs lead elsewhere: a draft has random letters in its name, and is always new.
"""

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import ENOENT
from pathlib import Path
from secrets import token_hex

from shipgym.errors import InputError

#: Names of drafts.
DRAFT = re.compile(r"\..+\.[0-9a-f]{16}\.draft", re.DOTALL)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Temporary name next to a file, renamed to it if the block ends without error.

    InputError if the folder does not exist or cannot be written, or what is there is no
    file, as a device.
    """
    draft = draft_name(path)
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is not a file; choose another name")
        draft.open("x").close()
        yield draft
        draft.replace(path)
    except OSError as error:
        remedy = "; choose a folder that exists" if error.errno == ENOENT else ""
        raise InputError(
            f"{path}: cannot be written ({error.strerror or error}){remedy}"
        ) from error
    finally:
        with suppress(OSError):
            draft.unlink()


@contextmanager
def draft_folder(path: Path) -> Iterator[Path]:
    """Temporary folder next to a path, removed when the block ends unless renamed."""
    draft = draft_name(path)
    draft.mkdir()
    try:
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def draft_name(path: Path) -> Path:
    """Hidden name next to a file or folder, another one in each call."""
    return path.parent / f".{path.name}.{token_hex(8)}.draft"


def remove_drafts(folder: Path) -> None:
    """Remove what killed processes left half-written in a folder of this process."""
    for path in folder.iterdir():
        if not DRAFT.fullmatch(path.name):
            continue
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
