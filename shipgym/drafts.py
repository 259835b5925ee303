"""Files and folders written under a draft's name and renamed when complete.

Where others may write, as in /tmp, a name that can be guessed would let a link of
theirs lead elsewhere: a draft has random letters in its name, and is always new.
"""

import os
import re
import secrets
import shutil
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EBUSY, ENOENT, EXDEV
from functools import cache
from pathlib import Path
from string import ascii_lowercase
from zlib import crc32

from shipgym.errors import InputError

#: Names of drafts: a checksum of the computer's name, and the number of the process.
DRAFT = re.compile(r"\..+\.([0-9a-f]{8})-(\d+)\.draft", re.DOTALL)


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
        remove_drafts(path.parent)
        _make_file(draft)
        yield draft
        try:
            draft.replace(path)
        except OSError as error:
            mount_point = error.errno in (EXDEV, EBUSY)
            if not mount_point:
                raise
            shutil.copyfile(draft, path)
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
    remove_drafts(path.parent)
    draft = draft_name(path)
    draft.mkdir()
    try:
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def draft_name(path: Path) -> Path:
    """Hidden name next to a file or folder that this process may write it under.

    Each call gives another one.
    """
    letters = "".join(secrets.choice(ascii_lowercase) for _ in range(16))
    return path.parent / f".{path.name}.{letters}.{_host()}-{os.getpid()}.draft"


def _make_file(path: Path) -> None:
    """Make an empty file; OSError if anything is there, be it a link to nowhere."""
    new = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0)
    os.close(os.open(path, new, 0o666))


def abandoned_drafts(folder: Path) -> list[Path]:
    """Drafts in a folder whose process is dead.

    Those of other computers, and of a process whose number is in use again, count after
    a week.
    """
    found = []
    abandoned_s = 7 * 86400.0  # age of a draft whose process may be alive
    with suppress(OSError):
        for path in folder.iterdir():
            name = DRAFT.fullmatch(path.name)
            if name is None:
                continue
            written = path.lstat().st_mtime
            age = time.time() - written
            is_dead = _is_dead(*name.groups())
            if is_dead or age > abandoned_s:
                found.append(path)
    return found


@cache
def remove_drafts(folder: Path) -> None:
    """Remove half-written files of killed processes; once per process and folder."""
    for path in abandoned_drafts(folder):
        with suppress(OSError):
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()


def _is_dead(host: str, process: str) -> bool:
    """True for a process of this computer that is no more."""
    if host != _host() or os.name != "posix":  # elsewhere the signal 0 would end it
        return False
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:  # another user's
        return False
    return False


@cache
def _host() -> str:
    return f"{crc32(socket.gethostname().encode()):08x}"
