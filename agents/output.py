"""Folders of results: written whole or not at all, and never over files that are not results."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from shipgym.errors import InputError


def check_folder(folder: Path, names: Collection[str]) -> None:
    """Refuse a folder that results cannot be written to, or that holds anything but the files `names`.

    A folder with only these is replaced as a whole; it need not exist. Raises InputError if it is a file,
    holds anything else, or cannot be written.
    """
    target = folder.absolute()
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise InputError(f"{folder}: is not a folder, expected one to write the results to; choose another")
    if target.is_dir():
        foreign = sorted(
            entry.name
            for entry in target.iterdir()
            if entry.name not in names or entry.is_symlink() or not entry.is_file()
        )
        if foreign:
            raise InputError(
                f"{folder}: holds '{foreign[0]}', which is not a result of this command, and would be "
                "replaced as a whole; choose another folder or a new one"
            )
    ancestor = target.parent
    while not ancestor.exists():
        ancestor = ancestor.parent
    if not ancestor.is_dir() or not os.access(ancestor, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: {ancestor} cannot be written to; choose another folder")


def check_page(path: Path) -> None:
    """Refuse a file for a page: one that does not end in .html, a folder, or one that cannot be written.

    Raises InputError naming the file.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path}: ending '{path.suffix}' found, expected a file that ends in .html")
    if path.is_dir():
        raise InputError(f"{path}: is a folder, expected a file to write the page to")
    folder = path.absolute().parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(f"{path}: its folder does not exist or cannot be written; choose another")


@contextmanager
def whole_folder(folder: Path, names: Collection[str]) -> Iterator[Path]:
    """A temporary folder beside `folder` that takes its place when the block ends without an error.

    `folder`: where the results shall go; `names`: as in `check_folder`. Yields the folder to write to. After
    an error or an interruption nothing of it is left. Raises InputError as `check_folder`, or if the folder
    cannot be written.
    """
    check_folder(folder, names)
    target = folder.absolute()
    made = [parent for parent in target.parents if not parent.exists()]
    draft: Path | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".draft", dir=target.parent))
        draft.chmod(0o755)
        yield draft
        _take_place(draft, target)
    except OSError as error:
        _clear(draft, made)
        raise InputError(f"{folder}: cannot be written ({error.strerror or error})") from error
    except BaseException:
        _clear(draft, made)
        raise


def _take_place(draft: Path, target: Path) -> None:
    """Rename the draft to the target; a folder in its place is set aside first and then removed."""
    if not target.exists():
        draft.replace(target)
        return
    aside = draft.with_suffix(".old")
    target.replace(aside)
    try:
        draft.replace(target)
    except BaseException:
        aside.replace(target)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _clear(draft: Path | None, made: Collection[Path]) -> None:
    """Remove the draft and the folders that were made for it."""
    if draft is not None:
        shutil.rmtree(draft, ignore_errors=True)
    for parent in made:  # the innermost first
        if parent.is_dir() and not any(parent.iterdir()):
            parent.rmdir()
