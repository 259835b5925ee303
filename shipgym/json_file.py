"""JSON files that are read with one clear message when they are wrong, and written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shipgym.checks import check_table
from shipgym.errors import InputError
from shipgym.whole_file import write_text


def read_json(path: Path, what: str, remedy: str) -> Mapping[str, Any]:
    """The object in a JSON file.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it is to be, such as "model file".
    remedy : str
        What to do about a broken one.

    Raises
    ------
    InputError
        If the file is missing, cannot be read, is binary or cut short, or holds no object.
    """
    try:
        text = path.read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such {what}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: binary content found, expected a {what} (JSON)") from None
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: broken JSON ({error}); the file may be cut short: {remedy}") from None
    return check_table(content, f"{path}:")


def write_json(fields: Mapping[str, Any], path: Path) -> None:
    """Write JSON to a temporary name beside the file, then rename it.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be written.
    """
    write_text(json.dumps(fields, indent=1, allow_nan=False) + "\n", path)
