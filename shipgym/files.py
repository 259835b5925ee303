"""Files that are read with one clear error, and written whole or not at all."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from shipgym.checks import check_table, did_you_mean
from shipgym.errors import InputError


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary name beside a file, renamed to it when the block ends without an error.

    Raises InputError if the folder does not exist or cannot be written.
    """
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        yield draft
        draft.replace(path)
    except OSError as error:
        remedy = "" if path.parent.is_dir() else "; choose a folder that exists"
        raise InputError(f"{path}: cannot be written ({error.strerror or error}){remedy}") from error
    finally:
        draft.unlink(missing_ok=True)


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
