"""The folder in which compiled loops are kept."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import ENOENT
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path

CACHE_VARIABLE = "SHIPGYM_CACHE"


def cache_folder() -> Path:
    """Where compiled loops are kept."""
    return Path(os.environ.get(CACHE_VARIABLE) or user_cache_path("shipgym"))


@cache
def usable_folder() -> Path | None:
    """The folder of the cache; None, with a warning, where there is none and none can be made."""
    home = cache_folder()
    try:
        if home.parts[:1] == ("~",):
            raise OSError(ENOENT, "the user has no home")
        home.mkdir(parents=True, exist_ok=True)
        next(home.iterdir(), None)
    except OSError as error:
        warn_of(home, error)
        return None
    return home


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """One process compiles, the others wait; the lock of a process that was killed is free.

    Where no lock can be had, in a folder that may only be read or on a disk without locks, each compiles.
    """
    from filelock import FileLock

    lock = FileLock(path)
    with suppress(OSError, NotImplementedError):
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def warn_of(folder: Path, error: OSError) -> None:
    """Say that nothing can be kept, and what to do."""
    warnings.warn(
        f"{folder}: cannot be written ({error.strerror}), so ships are compiled anew in each process. "
        f"Set {CACHE_VARIABLE} to a folder that can.",
        stacklevel=2,
    )
