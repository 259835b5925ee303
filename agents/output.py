"""Folders of results: one process at a time, whole or not at all, no other files."""

import os
import platform
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path

from filelock import FileLock, Timeout

from shipgym.drafts import DRAFT, draft_folder, remove_drafts
from shipgym.errors import InputError

LOCK = ".lock"  # file in a folder while a process uses it


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


def check_results(folder: Path, own: Collection[str], resume: bool) -> None:
    """Refuse a folder that cannot take results which a later call may go on with.

    `own`: names of files, of which one shows that it holds some; they are for `resume`.
    Raises InputError saying what to do.
    """
    check_writable(folder)
    names = present(folder) if folder.exists() else []
    has_results = any(name in own for name in names)
    if names and not has_results:
        raise InputError(
            f"{folder}: expected results of this command or nothing, got '{names[0]}';"
            " choose another folder"
        )
    if has_results and not resume:
        raise InputError(
            f"{folder}: already contains results; continue with --resume (resume=True),"
            " or choose another folder"
        )


def versions(*packages: str) -> dict[str, str]:
    """Return the versions of Python and of the packages that results depend on."""
    found = {package: version(package) for package in ("shipgym", *packages)}
    return {"python": platform.python_version(), **found}


def check_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written; InputError names what is in the way."""
    target = folder.absolute()
    nearest = next(path for path in (target, *target.parents) if path.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder}: {nearest} cannot be written to; choose another folder"
        )


def present(folder: Path) -> list[str]:
    """Names in a folder in order, without locks and drafts."""
    names = sorted(path.name for path in folder.iterdir())
    return [name for name in names if name != LOCK and not DRAFT.fullmatch(name)]


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
def in_use(folder: Path) -> Iterator[None]:
    """Keep other processes out of a folder of results while the block lasts.

    The folder and those above it are made, and removed again if they stay empty. The
    lock of a process that was killed is free; a disk that has no locks is used without.
    Raises InputError if another process uses the folder, or if it cannot be written.
    """
    target = folder.absolute()
    missing = [path for path in (target, *target.parents) if not path.exists()]
    try:
        with _writing(folder):
            target.mkdir(parents=True, exist_ok=True)
        with _locked(folder):
            remove_drafts(target)
            yield
    finally:
        for path in missing:  # the innermost first
            with suppress(OSError):
                path.rmdir()


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Say that a folder cannot be written where the system refuses it."""
    try:
        yield
    except (OSError, InputError) as error:
        cause = error if isinstance(error, OSError) else error.__cause__
        if not isinstance(cause, OSError):
            raise
        reason = cause.strerror or cause
        raise InputError(f"{folder}: cannot be written ({reason})") from error


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder."""
    path = folder / LOCK
    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise InputError(
            f"{folder}: in use by another process; wait until it has ended, or name"
            " another folder"
        ) from None
    except (NotImplementedError, OSError):
        pass  # a disk without locks
    try:
        yield
    finally:
        if lock.is_locked:
            path.unlink(missing_ok=True)  # before others may take it
            lock.release()


@contextmanager
def whole_folder(folder: Path, names: Collection[str]) -> Iterator[Path]:
    """A draft whose files take the place of those in `folder` when the block has ended.

    Yields the folder to write to, which lies in `folder`: so a mounted one takes
    results too. `folder` is locked meanwhile (`in_use`), `names` are those of
    `check_folder`. After an error or an interruption nothing of the draft is left.
    Raises InputError as `check_folder` and `in_use` do, or if the folder cannot be
    written.
    """
    check_folder(folder, names)
    with (
        in_use(folder),
        _writing(folder),
        draft_folder(folder / "results") as draft,
    ):
        yield draft
        for name in present(folder):  # first, so that no results are ever mixed
            (folder / name).unlink()
        for path in draft.iterdir():
            path.replace(folder / path.name)
