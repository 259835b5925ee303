"""Machine code of loops in the user's cache folder.

A file is named by all that its loop depends on, so that an existing one is always valid
(`shipgym.engine.fingerprint`). Its content is a pickle, as Numba's own cache has them:
the folder has to be the user's.
"""

import hashlib
import os
import pickle
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from shipgym.drafts import atomic_path
from shipgym.engine.numba_import import load_numba
from shipgym.errors import InputError

CACHE_VARIABLE = "SHIPGYM_CACHE"


class CacheWarning(UserWarning):
    """Compiled code cannot be stored."""


def cache_folder() -> Path:
    """Folder of compiled loops."""
    return Path(os.environ.get(CACHE_VARIABLE) or user_cache_path("shipgym"))


def cached_path(tag: str, signature: str) -> Path | None:
    """File of a loop with a hash, for arguments of a signature.

    None, with a warning, if there is no folder for it and none can be made.
    """
    try:
        folder = cache_folder().expanduser()
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError) as error:  # the latter of a user without a home
        warn_of(cache_folder(), error)
        return None
    short = hashlib.sha256(signature.encode()).hexdigest()[:8]
    return folder / f"{tag}-{short}.loop"


def load(loop: Any, path: Path) -> Any:
    """Return the compiled loop of a file; None if it is absent or cannot be used."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    from numba.core.compiler import CompileResult

    dispatcher = load_numba().njit(loop)
    dispatcher.targetctx.refresh()
    try:
        parts = pickle.loads(content)
        result = CompileResult._rebuild(dispatcher.targetctx, *parts)
    except Exception:  # damaged, or of the internals of another Numba
        return None
    dispatcher.add_overload(result)
    dispatcher.disable_compile()
    return dispatcher


def save(dispatcher: Any, path: Path) -> None:
    """Store a compiled loop, or warn that the folder cannot be written."""
    (result,) = dispatcher.overloads.values()
    if result.library.has_dynamic_globals:  # addresses of this process
        return
    from numba.core.serialize import dumps

    try:
        with atomic_path(path) as draft:
            draft.write_bytes(dumps(result._reduce()))
            draft.chmod(0o644)  # others may use it
    except InputError as error:
        warn_of(path.parent, error.__cause__ or error)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Let one process compile a loop's file while others wait.

    The lock of a killed process is free. Where there are no locks, in a read-only
    folder or on a disk without them, each process compiles.
    """
    from filelock import FileLock

    lock = FileLock(path.with_suffix(".lock"))
    with suppress(OSError, NotImplementedError):
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def warn_of(folder: Path, error: BaseException) -> None:
    """Warn that nothing can be stored, and name the remedy, once in a process."""
    reason = getattr(error, "strerror", error)
    message = (
        f"{folder}: cannot be written ({reason}), so ships are compiled again in each"
        f" process. Set {CACHE_VARIABLE} to a folder that can."
    )
    warnings.warn(message, CacheWarning, stacklevel=1)
