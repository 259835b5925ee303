"""Folder of compiled loops, and the checks that its files may be run.

A loop's file is code. It is run only if root and this user alone could have written it:
they own the files, the folder and all folders above it, and others may not write to
them. A folder above may be sticky, as ``/tmp`` is, where others cannot rename files
that they do not own.
"""

import os
import stat
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from errno import ENOENT
from functools import cache
from hashlib import sha256
from pathlib import Path

from platformdirs import user_cache_path

from shipgym.drafts import atomic_path

CACHE_VARIABLE = "SHIPGYM_CACHE"
LOOP = ".loop"
DIGEST = 32  # bytes of a SHA-256, at the beginning of a file


def cache_folder() -> Path:
    """Folder of compiled loops; below ``~`` if the user's home is not known."""
    folder = os.environ.get(CACHE_VARIABLE)
    try:
        return Path(folder or user_cache_path("shipgym")).expanduser()
    except RuntimeError:  # of a user who is not in the list of users, in a container
        return Path("~", ".cache", "shipgym")


@cache
def usable_folder() -> Path | None:
    """Return the folder of the cache; None, with a warning, if none can be used."""
    try:
        return open_folder()
    except OSError as error:
        warn_of(cache_folder(), error)
    except ValueError as error:
        tell(f"{error}. Until then ships are compiled again in each process.")
    return None


def open_folder() -> Path:
    """Return the folder of the cache, without links in its path; make it if needed.

    Raises OSError if it cannot be made or read, ValueError, with the remedy, if code in
    it might be another user's.
    """
    home = cache_folder()
    if home.parts[:1] == ("~",):
        raise OSError(ENOENT, "the user has no home")
    for folder in reversed((home, *home.parents)):
        if not folder.is_dir():
            folder.mkdir(mode=0o755, exist_ok=True)
    home = home.resolve(strict=True)
    next(home.iterdir(), None)  # whether it can be read
    for folder in (home, *home.parents):
        why = _others_of(folder.stat(), above=folder != home)
        if why:
            remedy = f"set {CACHE_VARIABLE} to a folder that is yours alone"
            if "belongs" not in why:
                remedy = f"chmod go-w {folder}, or {remedy}"
            raise ValueError(f"{home}: not used, because {folder} {why}; {remedy}")
    return home


def _others_of(found: os.stat_result, above: bool = False) -> str:
    """Say who, other than root and this user, could change a file or folder.

    Empty if no one else could. `above`: it is a folder above the cache.
    """
    if not hasattr(os, "geteuid"):  # Windows, where a user's folders are the user's
        return ""
    if found.st_uid not in (0, os.geteuid()):
        return f"belongs to another user ({found.st_uid})"
    written = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    sticky = above and found.st_mode & stat.S_ISVTX
    if written and not sticky:
        return "may be written by other users"
    return ""


def read_loop(path: Path) -> bytes:
    """Read the content of a loop's file that follows its hash.

    Raises OSError if it cannot be read, ValueError, with what is wrong, if it is
    damaged or might be another user's.
    """
    flags = os.O_RDONLY
    for name in ("O_NOFOLLOW", "O_BINARY"):  # not on every system
        flags |= getattr(os, name, 0)
    number = os.open(path, flags)
    with os.fdopen(number, "rb") as file:
        why = _others_of(os.fstat(number))
        if why:
            raise ValueError(why)
        digest = file.read(DIGEST)
        content = file.read()
    if sha256(content).digest() != digest:
        raise ValueError("is damaged")
    return content


def loop_fault(path: Path) -> str:
    """Say what is wrong with a loop's file; empty for a valid or another file."""
    try:
        if path.suffix == LOOP:
            read_loop(path)
    except (OSError, ValueError) as error:
        return str(error)
    return ""


def write_loop(content: bytes, path: Path) -> None:
    """Write a loop's file, whole or not at all; the caller holds its lock.

    Raises InputError if it cannot be written.
    """
    with atomic_path(path) as draft:
        draft.write_bytes(sha256(content).digest() + content)
        draft.chmod(0o644)  # others may use it


@contextmanager
def locked(path: Path, waiting: Callable[[], None]) -> Iterator[None]:
    """Let one process compile a loop's file while others wait.

    `waiting` is called if another process holds the lock; the lock of a killed process
    is free. Where there are no locks, in a read-only folder or on a disk without them,
    each process compiles.
    """
    from filelock import FileLock, Timeout

    tag = path.name.partition("-")[0]
    lock = FileLock(path.with_name(f"{tag}.lock"))
    with suppress(OSError, NotImplementedError):
        try:
            lock.acquire(blocking=False)
        except Timeout:
            waiting()
            lock.acquire()
    try:
        yield
    finally:
        lock.release()


def warn_of(folder: Path, error: BaseException) -> None:
    """Warn that nothing can be stored, because of an OSError, and name the remedy."""
    reason = getattr(error, "strerror", error)
    tell(
        f"{folder}: cannot be written ({reason}), so ships are compiled again in each"
        f" process. Set {CACHE_VARIABLE} to a folder that can."
    )


class CacheWarning(UserWarning):
    """Compiled code cannot be stored or read."""


@cache
def tell(message: str) -> None:
    """Warn, once in a process."""
    warnings.warn(message, CacheWarning, stacklevel=3)
