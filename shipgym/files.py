"""Files that are read with one clear error, and written whole or not at all."""

import json
import os
import re
import shutil
import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from errno import EBUSY, ENOENT, EXDEV
from functools import cache
from pathlib import Path
from typing import Any
from zlib import crc32

from shipgym.checks import check_table, did_you_mean
from shipgym.errors import InputError

#: Names of `draft_name`.
DRAFT = re.compile(r"\..+\.([0-9a-f]{8})-(\d+)\.draft", re.DOTALL)
ABANDONED_S = 7 * 86400.0
MOUNTED = (EXDEV, EBUSY)  # what renaming onto a mount point fails with


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary name beside a file, renamed to it when the block ends without an error.

    Raises InputError if the folder does not exist or cannot be written, or there is something else than a
    file, such as a device.
    """
    draft = draft_name(path)
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is not a file; choose another name")
        remove_drafts(path.parent)
        yield draft
        _take_place(draft, path)
    except OSError as error:
        remedy = "; choose a folder that exists" if error.errno == ENOENT else ""
        raise InputError(f"{path}: cannot be written ({error.strerror or error}){remedy}") from error
    finally:
        with suppress(OSError):
            draft.unlink()


def _take_place(draft: Path, path: Path) -> None:
    try:
        draft.replace(path)
    except OSError as error:
        if error.errno not in MOUNTED:
            raise
        shutil.copyfile(draft, path)


def draft_name(path: Path) -> Path:
    """The hidden name beside a file or folder under which this process writes it."""
    return path.parent / f".{path.name}.{_host()}-{os.getpid()}.draft"


@contextmanager
def draft_folder(path: Path) -> Iterator[Path]:
    """A folder beside a path that is removed when the block ends, unless it was renamed."""
    remove_drafts(path.parent)
    draft = draft_name(path)
    shutil.rmtree(draft, ignore_errors=True)  # of a killed process of the same number
    try:
        draft.mkdir()
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def abandoned_drafts(folder: Path) -> list[Path]:
    """Drafts in a folder whose process is dead.

    Those of other computers, and of a process whose number is in use again, count after a week.
    """
    found = []
    with suppress(OSError):
        for path in folder.iterdir():
            named = DRAFT.fullmatch(path.name)
            if named and (_is_dead(*named.groups()) or time.time() - path.lstat().st_mtime > ABANDONED_S):
                found.append(path)
    return found


@cache
def remove_drafts(folder: Path) -> None:
    """Remove what killed processes left half-written in a folder; a process looks once in each folder."""
    for path in abandoned_drafts(folder):
        with suppress(OSError):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _is_dead(host: str, process: str) -> bool:
    """Whether a process of this computer is no more."""
    if host != _host() or os.name != "posix":  # elsewhere the signal 0 would end it
        return False
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:
        pass
    return False


@cache
def _host() -> str:
    return f"{crc32(socket.gethostname().encode()):08x}"


def make_folder(folder: Path) -> None:
    """Make a folder and those above it where they do not exist; raises InputError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: no folder can be made there ({error.strerror or error})") from None


def write_bytes(content: bytes, path: Path) -> None:
    """Write a file atomically (`atomic_path`)."""
    with atomic_path(path) as draft:
        draft.write_bytes(content)


def write_text(text: str, path: Path) -> None:
    """Write a text in UTF-8 atomically (`atomic_path`)."""
    write_bytes(text.encode("utf-8"), path)


def write_json(fields: Mapping[str, Any], path: Path, indent: int | None = 1) -> None:
    """Write JSON atomically (`atomic_path`); numbers that are not finite are refused with a ValueError."""
    write_text(json.dumps(fields, indent=indent, allow_nan=False) + "\n", path)


def check_readable(path: Path, what: str) -> None:
    """InputError for a file that is missing, a folder, or cannot be opened; `what` it is, as "CSV file"."""
    try:
        with path.open("rb"):
            return
    except FileNotFoundError:
        near = did_you_mean(path.name, _names_beside(path))
        raise InputError(f"{path}: there is no such {what}.{near}") from None
    except IsADirectoryError:
        raise InputError(f"{path}: this is a folder, expected a {what}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({error}), expected a {what}") from None


def read_bytes(path: Path, what: str) -> bytes:
    """The content of a file; refused as by `check_readable`."""
    check_readable(path, what)
    return path.read_bytes()


def read_json(path: Path, what: str, remedy: str) -> Mapping[str, Any]:
    """The object in a JSON file; `what` is expected there, and `remedy` says what to do about a broken one.

    Raises InputError if the file is missing, cannot be read, is binary or cut short, or holds no object.
    """
    data = read_bytes(path, what)
    try:
        content = json.loads(data.decode("utf-8"))
    except UnicodeDecodeError:
        raise InputError(f"{path}: binary content found, expected a {what} (JSON)") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: broken JSON ({error}); the file may be cut short: {remedy}") from None
    return check_table(content, f"{path}:")


def _names_beside(path: Path) -> list[str]:
    try:
        return [other.name for other in path.parent.iterdir()]
    except OSError:
        return []
