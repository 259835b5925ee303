"""Folders of results: one process at a time, whole or not at all, no other files."""

import os
import shutil
import socket
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path

from filelock import FileLock, Timeout

from shipgym.drafts import DRAFT, atomic_path, draft_folder, remove_drafts
from shipgym.errors import InputError

ASIDE = ".old"  # ending of a folder that is about to be replaced


def check_folder(folder: Path, names: Collection[str]) -> None:
    """Refuse a folder that cannot take results, or holds other files than `names`.

    A folder with only these is replaced as a whole; it need not exist. Raises
    InputError if it is a file, holds anything else, or cannot be written.
    """
    target = folder.absolute()
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise InputError(
            f"{folder}: expected a folder to write the results to, got another kind of"
            " file; choose another name"
        )
    if target.is_dir():
        for name in present(target):
            path = target / name
            if name not in names or path.is_symlink() or not path.is_file():
                raise InputError(
                    f"{folder}: holds '{name}', which is not a result of this command,"
                    " and would be replaced as a whole; choose another folder or a"
                    " new one"
                )
    check_writable(folder)


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written; InputError names what is in the way."""
    target = folder.absolute()
    existing = [path for path in (target, *target.parents) if path.exists()]
    needed = existing[:1]
    if target.is_dir() and not _stands_alone(target):
        needed = existing[:2]  # it is emptied, and renamed within the folder above
    for path in needed:
        is_writable = os.access(path, os.W_OK | os.X_OK)
        if not path.is_dir() or not is_writable:
            raise InputError(
                f"{folder}: {path} cannot be written to; choose another folder"
            )


def present(folder: Path) -> list[str]:
    """Names in a folder in order, without locks and drafts."""
    lock = _lock_path(folder).name
    names = sorted(path.name for path in folder.iterdir())
    return [name for name in names if name != lock and not DRAFT.fullmatch(name)]


def check_page(path: Path, plots: bool = False) -> None:
    """Refuse a file for a page that does not end in .html, or cannot be written.

    Raises InputError naming the file; or if there shall be `plots` and plotly is
    missing.
    """
    if plots:
        from shipgym.plots import graph_objects

        graph_objects()
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path}: expected a file that ends in .html, got another")
    check_file(path)


def check_file(path: Path) -> None:
    """Refuse a file that cannot be written; InputError names it."""
    if path.is_dir():
        raise InputError(f"{path}: expected a file to write to, got a folder")
    folder = path.absolute().parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(
            f"{path}: its folder does not exist or cannot be written; choose another"
        )


@contextmanager
def in_use(folder: Path) -> Iterator[Path]:
    """Keep other processes out of a folder of results while the block lasts.

    Yields the place of drafts and lock: next to the folder, or in it if it is a mount
    or its parent cannot be written. Folders above it are made, and removed again if
    they stay empty. The lock of a process that was killed is free; a disk that has no
    locks is used without. Raises InputError if another process uses the folder, saying
    which, or if it cannot be written.
    """
    target = folder.absolute()
    missing = [path for path in (target, *target.parents) if not path.exists()]
    lock_path = _lock_path(folder)
    lock = _acquired(lock_path, folder)
    try:
        if lock.is_locked:
            user = f"process {os.getpid()} on {socket.gethostname()}"
            lock_path.write_text(user, encoding="utf-8")
            _put_back(target, lock_path.parent)
        remove_drafts(lock_path.parent)
        yield lock_path.parent
    finally:
        if lock.is_locked:
            # before it is free, so that a waiting process notices
            lock_path.unlink(missing_ok=True)
            lock.release()
        for path in missing:  # the innermost first
            with suppress(OSError):
                path.rmdir()


def _acquired(lock_path: Path, folder: Path) -> FileLock:
    """Take the lock of a folder; it stays open where the disk has no locks.

    Raises InputError if another process has it.
    """
    lock = FileLock(lock_path)
    user = "another process"
    with suppress(OSError):
        user = lock_path.read_text(encoding="utf-8", errors="replace") or user
    try:
        lock_path.parent.mkdir(parents=True, exist_ok=True)
        with suppress(NotImplementedError):
            lock.acquire(timeout=0)
    except Timeout:
        if not lock_path.exists():  # as in /proc, where no file can be made
            raise InputError(
                f"{folder}: cannot be written; choose another folder"
            ) from None
        raise InputError(
            f"{folder}: in use by {user}; wait until it has ended, or name another"
            " folder"
        ) from None
    except OSError as error:
        if not lock_path.parent.is_dir():
            reason = error.strerror or error
            raise InputError(f"{folder}: cannot be written ({reason})") from None
    return lock


def _stands_alone(target: Path) -> bool:
    """True if nothing can be put next to a folder: a mount, or a read-only parent."""
    if not target.is_dir():
        return False
    return os.path.ismount(target) or not os.access(target.parent, os.W_OK | os.X_OK)


def _lock_path(folder: Path) -> Path:
    target = folder.resolve()
    home = target if _stands_alone(target) else target.parent
    return home / f".{target.name}.lock"


@contextmanager
def whole_folder(folder: Path, names: Collection[str]) -> Iterator[Path]:
    """A draft that takes the place of `folder` when the block ends without an error.

    Yields the folder to write to. `folder` is locked meanwhile (`in_use`), `names` are
    those of `check_folder`. After an error or an interruption nothing of it is left.
    Raises InputError as `check_folder` and `in_use` do, or if the folder cannot be
    written.
    """
    check_folder(folder, names)
    target = folder.absolute()
    with in_use(folder) as home:
        try:
            with draft_folder(home / target.name) as draft:
                yield draft
                _take_place(draft, target, names)
        except OSError as error:
            reason = error.strerror or error
            raise InputError(f"{folder}: cannot be written ({reason})") from error


def _take_place(draft: Path, target: Path, names: Collection[str]) -> None:
    """Rename the draft to the target.

    A folder in its place is set aside first and then removed. Onto a mount point no
    folder can be renamed: its files are replaced one by one.
    """
    aside = draft.with_suffix(ASIDE)
    try:
        if target.exists():
            target.replace(aside)
        draft.replace(target)
    except BaseException as error:
        if aside.exists():
            aside.replace(target)
        if not target.is_dir() or not isinstance(error, OSError):
            raise
        _replace_files(draft, target, names)
    shutil.rmtree(aside, ignore_errors=True)


def _replace_files(draft: Path, target: Path, names: Collection[str]) -> None:
    for name in names:
        if (draft / name).exists():
            with atomic_path(target / name) as new:
                shutil.copyfile(draft / name, new)
        else:  # an earlier one would belong to other results
            (target / name).unlink(missing_ok=True)


def _put_back(target: Path, home: Path) -> None:
    """Give a folder its name again that a process had set aside when it was killed."""
    for aside in home.glob(f".{escape(target.name)}.*{ASIDE}"):
        with suppress(OSError):
            if target.exists():
                shutil.rmtree(aside)
            else:
                aside.replace(target)
