"""Folders of results: one process at a time, written whole or not at all, never over other files."""

import os
import shlex
import shutil
import socket
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from glob import escape
from pathlib import Path

from filelock import FileLock, Timeout

from shipgym.drafts import (
    DRAFT,
    abandoned_drafts,
    atomic_path,
    draft_folder,
    remove_drafts,
)
from shipgym.errors import InputError
from shipgym.plots import graph_objects

ASIDE = ".old"
PROCESS = "process"
LONGEST_COMMAND = 200  # characters that are told of it


def check_folder(folder: Path, names: Collection[str]) -> None:
    """Refuse a folder that results cannot be written to, or that holds anything but the files `names`.

    A folder with only these is replaced as a whole; it need not exist. Raises
    InputError if it is a file, holds anything else, or cannot be written.
    """
    target = folder.absolute()
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise InputError(
            f"{folder}: is not a folder, expected one to write the results to; choose"
            " another"
        )
    if target.is_dir():
        for name in present(target):
            if (
                name not in names
                or (target / name).is_symlink()
                or not (target / name).is_file()
            ):
                raise InputError(
                    f"{folder}: holds '{name}', which is not a result of this command,"
                    " and would be replaced as a whole; choose another folder or a"
                    " new one"
                )
    check_writable(folder)


def check_writable(folder: Path) -> None:
    """Refuse a folder that can neither be made nor written; raises InputError naming what is in the way."""
    target = folder.absolute()
    there = [one for one in (target, *target.parents) if one.exists()]
    both = target.is_dir() and not _stands_alone(
        target
    )  # it is renamed within the folder above, and emptied
    for one in there[: 1 + both]:
        if not one.is_dir() or not os.access(one, os.W_OK | os.X_OK):
            raise InputError(
                f"{folder}: {one} cannot be written to; choose another folder"
            )


def present(folder: Path) -> list[str]:
    """Names in a folder in order, without locks and drafts."""
    lock = _lock_path(folder).name
    return sorted(
        one.name
        for one in folder.iterdir()
        if one.name != lock and not DRAFT.fullmatch(one.name)
    )


def check_page(path: Path, plots: bool = False) -> None:
    """Refuse a file for a page: one that does not end in .html, a folder, or one that cannot be written.

    Raises InputError naming the file; or if there shall be `plots` and plotly is
    missing.
    """
    if plots:
        graph_objects()
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(
            f"{path}: ending '{path.suffix}' found, expected a file that ends in .html"
        )
    check_file(path)


def check_file(path: Path) -> None:
    """Refuse a file that cannot be written, before the work for it; raises InputError naming it."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder, expected a file to write to")
    folder = path.absolute().parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(
            f"{path}: its folder does not exist or cannot be written; choose another"
        )


@contextmanager
def in_use(folder: Path) -> Iterator[Path]:
    """Keep other processes out of a folder of results while the block lasts.

    Yields where drafts and lock are: beside the folder, or in it if it is a mount point
    or its parent cannot be written. Folders above it are made, and removed again if
    they stay empty. The lock of a process that was killed is free; a disk that has no
    locks is used without. Raises InputError if another process uses the folder, saying
    which, or if it cannot be written.
    """
    lock_path = _lock_path(folder)
    missing = [
        one
        for one in (folder.absolute(), *folder.absolute().parents)
        if not one.exists()
    ]
    lock, user = FileLock(lock_path), holder(lock_path)
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
            raise InputError(
                f"{folder}: cannot be written ({error.strerror or error})"
            ) from None
    try:
        if lock.is_locked:
            lock_path.write_text(_this_process(), encoding="utf-8")
            _put_back(folder.absolute(), lock_path.parent)
        remove_drafts(lock_path.parent)
        yield lock_path.parent
    finally:
        if lock.is_locked:
            lock_path.unlink(
                missing_ok=True
            )  # before it is free: who waits for it notices
            lock.release()
        for made in missing:  # the innermost first
            with suppress(OSError):
                made.rmdir()


def _stands_alone(target: Path) -> bool:
    """Whether nothing of a folder can be beside it: a mount point, or below a folder that is read-only."""
    return target.is_dir() and (
        os.path.ismount(target) or not os.access(target.parent, os.W_OK | os.X_OK)
    )


def _lock_path(folder: Path) -> Path:
    target = folder.resolve()
    return (target if _stands_alone(target) else target.parent) / f".{target.name}.lock"


def _this_process() -> str:
    command = shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])[:LONGEST_COMMAND]
    since = datetime.now().astimezone().isoformat(" ", "seconds")
    return (
        f"{PROCESS} {os.getpid()} on {socket.gethostname()} since {since} ({command})"
    )


def holder(lock: Path) -> str:
    """Who took a lock, in words."""
    try:
        return lock.read_text(encoding="utf-8", errors="replace") or "another process"
    except OSError:
        return "another process"


def locks_and_drafts(folder: Path) -> Iterator[tuple[str, bool]]:
    """What processes have in a folder beside results, in words, and whether its process is dead."""
    for draft in abandoned_drafts(folder):
        yield (
            (
                f"{draft}: left by a process that was killed; the next run there"
                " removes it"
            ),
            True,
        )
    for path in sorted(folder.glob(".*.lock")):
        if (user := holder(path)).startswith(PROCESS):
            try:
                with FileLock(path, timeout=0):
                    yield (
                        (
                            f"{path}: left by {user}, which is dead; the next run there"
                            " removes it"
                        ),
                        True,
                    )
            except Timeout:
                yield f"{path}: {user}", False
            except OSError:  # another user's
                continue


@contextmanager
def whole_folder(folder: Path, names: Collection[str]) -> Iterator[Path]:
    """A temporary folder that takes the place of `folder` when the block ends without an error.

    `folder`: where the results shall go, which is locked in the meantime (`in_use`);
    `names`: as in `check_folder`. Yields the folder to write to. After an error or an
    interruption nothing of it is left. Raises InputError as `check_folder` and
    `in_use`, or if the folder cannot be written.
    """
    check_folder(folder, names)
    target = folder.absolute()
    with in_use(folder) as home:
        try:
            with draft_folder(home / target.name) as draft:
                yield draft
                _take_place(draft, target, names)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({error.strerror or error})"
            ) from error


def _take_place(draft: Path, target: Path, names: Collection[str]) -> None:
    """Rename the draft to the target; a folder in its place is set aside first and then removed.

    Onto a mount point no folder can be renamed: its files are replaced one by one.
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
        else:  # an earlier one would be of other results
            (target / name).unlink(missing_ok=True)


def _put_back(target: Path, home: Path) -> None:
    """Give a folder its name again that a process had set aside when it was killed."""
    for aside in home.glob(f".{escape(target.name)}.*{ASIDE}"):
        with suppress(OSError):
            shutil.rmtree(aside) if target.exists() else aside.replace(target)
