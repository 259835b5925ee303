"""Files read within limits and with one clear error, and written atomically.

Whatever is read is a regular file of at most so many bytes, and what JSON and TOML hold
is checked in one place (`check_content`), before any reader looks at its fields.
"""

import json
import math
import os
import re
import stat
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from shipgym.checks import check_table, did_you_mean, unexpected
from shipgym.drafts import atomic_path
from shipgym.errors import InputError

MIB = 2**20
# most bytes of a file of each kind
LARGEST_TOML = MIB // 4
LARGEST_JSON = 32 * MIB
LARGEST_CSV = 64 * MIB
LARGEST_TENSORS = 256 * MIB

MOST_VALUES = 1_000_000  # in a JSON or TOML file
DEEPEST = 20  # levels of lists and tables within each other
LONGEST_KEY = 4096  # characters
LARGEST_NUMBER = 1e100  # magnitude: products of three such numbers are still finite

#: Kinds of files that users mistake for one another, and the commands that take them;
#: of a folder the first of them.
TAKEN_BY = {
    "ship file": "look, identify or autopilot",
    "model file": "trials, export or train --model",
    "controller file": "export or benchmark --controllers",
    "recorded episode": "replay",
    "Python file": "benchmark --controllers as FILE:FUNCTION",
    "file of weights": "export or benchmark --controllers by the .json beside it",
    "log": "new-ship or look",
}
KIND_OF_SUFFIX = {
    "": "",
    ".toml": "ship file",
    ".py": "Python file",
    ".safetensors": "file of weights",
}
#: Fields that only files of a kind have.
KIND_OF_FIELD = {
    "coefficients": "model file",
    "observation_scales": "controller file",
    "actions": "recorded episode",
}

#: Characters that UTF-8 cannot encode, or that end a text for the operating system.
_UNWRITABLE = re.compile("[\0\ud800-\udfff]")


# ---- writing


def make_folder(folder: Path) -> None:
    """Make a folder and those above it if absent; raises InputError if it cannot."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"{folder}: no folder can be made there ({reason})") from None


def write_bytes(content: bytes, path: Path) -> None:
    """Write a file atomically (`atomic_path`)."""
    with atomic_path(path) as draft:
        draft.write_bytes(content)


def write_text(text: str, path: Path) -> None:
    """Write a text in UTF-8 atomically (`atomic_path`)."""
    write_bytes(text.encode("utf-8"), path)


def write_json(fields: Mapping[str, Any], path: Path, indent: int | None = 1) -> None:
    """Write JSON atomically (`atomic_path`); ValueError for nan and infinities."""
    write_text(json_text(fields, indent) + "\n", path)


def json_text(fields: Mapping[str, Any], indent: int | None = 1) -> str:
    """Text of a JSON object; numbers, booleans and arrays of NumPy are as Python's.

    Raises ValueError for nan and infinities.
    """
    return json.dumps(fields, indent=indent, allow_nan=False, default=_plain)


def _plain(value: Any) -> Any:
    """Python's own value for one of NumPy."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"expected what JSON holds, got {type(value).__name__}: {value!r}")


# ---- reading


def check_readable(path: Path, what: str) -> None:
    """Refuse a missing, special or unreadable file; `what` it is: "CSV file"."""
    with _opened(path, what):
        pass


def read_bytes(path: Path, what: str, largest: int) -> bytes:
    """Content of a regular file of at most `largest` bytes.

    Raises InputError for a file that is missing, too large or cannot be read, and for a
    folder, a device or a pipe, which is not opened; `what` is expected there, as "CSV
    file".
    """
    with _opened(path, what) as file:
        size = os.fstat(file.fileno()).st_size
        if size > largest:
            raise InputError(
                f"{path}: expected a {what} of at most {largest} bytes, got {size}"
                " bytes; split it, or leave out what is not needed"
            )
        # one byte of a file that claims to be empty, as those in /proc do
        return file.read(max(size, 1))


@contextmanager
def _opened(path: Path, what: str) -> Iterator[BinaryIO]:
    """A regular file, opened; anything else is refused and not opened."""
    try:
        kind = path.stat().st_mode
        if not stat.S_ISREG(kind):
            is_folder = stat.S_ISDIR(kind)
            special = "no regular file (a device, a pipe or a socket)"
            found = "a folder" if is_folder else special
            raise InputError(f"{path}: expected a {what}, got {found}")
        with path.open("rb") as file:
            yield file
    except InputError:
        raise
    except FileNotFoundError:
        beside = [other.name for other in path.parent.glob("*")]
        near = did_you_mean(path.name, beside)
        raise InputError(f"{path}: there is no such {what}.{near}") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{path}: expected a {what}, got a file that cannot be read ({reason})"
        ) from None


def read_text(path: Path, what: str, largest: int) -> str:
    """Read UTF-8 text as `read_bytes` does; InputError names the line that is not."""
    data = read_bytes(path, what, largest)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{path}: line {line}: expected a {what} in UTF-8, got byte"
            f" 0x{data[error.start]:02x} (binary content); save it as text in UTF-8"
        ) from None


def read_json(path: Path, what: str, remedy: str) -> Mapping[str, Any]:
    """Read a JSON object; `what` is expected, `remedy` says how to repair one.

    Raises InputError as `read_text` does, and if the file is cut short, holds no
    object, or something that `check_content` refuses.
    """
    text = read_text(path, f"{what} (JSON)", LARGEST_JSON)
    return check_table(parse_json(text, f"{path}:", remedy), str(path))


def parse_json(text: str, where: str, remedy: str) -> Any:
    """Parse JSON within the limits of `check_content`; messages begin with `where`."""
    broken = "broken JSON ({}); the file may be cut short: " + remedy
    return _parsed(json.loads, text, where, broken)


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Tables of a TOML file; `what` is expected there, as "ship file".

    Raises InputError as `read_text` does, and if the file is not TOML or holds
    something that `check_content` refuses.
    """
    return parse_toml(read_text(path, f"{what} (TOML)", LARGEST_TOML), f"{path}:")


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Parse TOML within the limits of `check_content`; messages begin with `where`."""
    # on a dotted key that nests deeper `tomllib` spends time and memory by the square
    part = r"""\.[ \t]*(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*"""
    too_deep = rf"(?:{part}){{{DEEPEST}}}"
    if re.search(too_deep, text):
        raise InputError(
            f"{where} expected dotted keys of at most {DEEPEST} parts, got a longer one"
        )
    broken = "not valid TOML: {}; correct that line"
    return dict(_parsed(tomllib.loads, text, where, broken, infinite=True))


def shipped_toml(package: str, name: str) -> dict[str, Any]:
    """Tables of a TOML file that comes with a package."""
    return tomllib.loads(resources.files(package).joinpath(name).read_text("utf-8"))


def toml_value(text: str) -> Any:
    """Value as TOML has it, such as 3, true or [1, 2]; any other text is itself."""
    try:
        return parse_toml(f"value = {text}", "value:")["value"]
    except InputError:
        return text


def named_values(texts: Iterable[str], where: str, example: str) -> dict[str, Any]:
    """Parse texts `name=value`, with values as in TOML; returns them by name."""
    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        name = name.strip()
        if not sign or not name:
            raise unexpected(where, f"name=value, such as {where} {example}", text)
        found[name] = _named_value(name, value.strip(), where)
    return found


def _named_value(name: str, text: str, where: str) -> Any:
    value = toml_value(text)
    if value == text:  # not TOML, or more than a file may hold
        with suppress(ValueError):
            value = float(text)  # such as .5 or nan
        check_content({name: value}, where, infinite=True)
    return value


# ---- files of another kind


@contextmanager
def expecting(what: str, path: Path) -> Iterator[None]:
    """Where a file cannot be read, say if it is of another kind than `what`.

    In a folder the file that was meant is named.
    """
    try:
        yield
    except InputError:
        found = ""
        with suppress(OSError):
            found = _found_instead(what, path)
        if not found:
            raise
        raise InputError(f"{path}: expected a {what}, got {found}") from None


def _found_instead(what: str, path: Path) -> str:
    """Say what a path is instead of a file of a kind; empty if that is not known."""
    is_folder = path.is_dir()
    files = sorted(path.iterdir(), reverse=True) if is_folder else [path]
    kinds = {kind_of(file): file for file in files}
    kinds.pop("", None)
    if what in kinds:
        return f"a folder; give {kinds[what]}" if is_folder else ""
    for kind in [one for one in TAKEN_BY if one in kinds]:
        given = f"a folder; give {kinds[kind]}" if is_folder else f"a {kind}; give it"
        return f"{given} to shipgym {TAKEN_BY[kind]}"
    return ""


def kind_of(path: Path) -> str:
    """Kind of a file by its name's end or its fields; empty where it is not known."""
    suffix = path.suffix.lower()
    if suffix != ".json":
        return KIND_OF_SUFFIX.get(suffix, "log") if path.is_file() else ""
    with suppress(InputError):
        content = read_json(path, "file", "")
        return next((KIND_OF_FIELD[one] for one in KIND_OF_FIELD if one in content), "")
    return ""


# ---- limits of what JSON and TOML hold


def check_content(
    value: Any,
    where: str,
    infinite: bool = False,
    depth: int = 1,
) -> None:
    """Refuse content that no file of this project has, before its fields are read.

    In a list or table from JSON or TOML these are: lists and tables more than `DEEPEST`
    deep, integers of more than 64 bits (a `seed` may have 128), numbers that are nan or
    exceed `LARGEST_NUMBER` (unless `infinite` ones may stand there), dates, keys longer
    than `LONGEST_KEY`, and texts with null bytes or halves of characters. Raises
    InputError, which begins with `where`, "model.json:", and names the place.
    """
    if depth > DEEPEST:
        raise _too_deep(f"{where}:")
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(key, str) and (len(key) > LONGEST_KEY or _UNWRITABLE.search(key)):
            expected = f"keys of at most {LONGEST_KEY} characters"
            raise unexpected(where, expected, key)
        is_nested = isinstance(item, dict | list)
        expected = "" if is_nested else _expected(key, item, infinite)
        if not is_nested and not expected:
            continue
        sign = " " if depth == 1 else "."
        place = f"{where}[{key}]" if isinstance(key, int) else f"{where}{sign}{key}"
        if expected:
            raise unexpected(place, expected, item)
        check_content(item, place, infinite, depth + 1)


def _expected(key: str | int, value: Any, infinite: bool) -> str:
    """Expectation that a single value does not meet; empty if none."""
    bits = 128 if key == "seed" else 64  # NumPy draws seeds of 128 bits
    match value:
        case None | bool():
            return ""
        case float():
            fine = abs(value) <= LARGEST_NUMBER or (infinite and math.isinf(value))
            expected = f"a number of magnitude {LARGEST_NUMBER:g} at most"
        case int():
            fine = value.bit_length() <= bits
            expected = f"an integer of at most {bits} bits"
        case str():
            fine = not _UNWRITABLE.search(value)
            expected = "a string without null bytes and halves of characters"
        case _:
            return "a string, a number or a boolean"
    return "" if fine else expected


def _parsed(
    parse: Callable[[str], Any],
    text: str,
    where: str,
    broken: str,
    infinite: bool = False,
) -> Any:
    """Parse a text within the limits; `broken` says what is wrong with its syntax."""
    if sum(text.count(sign) for sign in "[{,") > MOST_VALUES:
        raise InputError(
            f"{where} expected at most {MOST_VALUES} values, got more; split the file"
        )
    try:
        content = parse(text)
    except RecursionError:
        raise _too_deep(where) from None
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{where} {broken.format(error)}") from None
    except ValueError:  # Python's limit to the digits of an integer
        raise InputError(
            f"{where} expected integers of at most 64 bits, got a longer one"
        ) from None
    entries = content if isinstance(content, dict | list) else [content]
    check_content(entries, where, infinite)
    return content


def _too_deep(where: str) -> InputError:
    return InputError(
        f"{where} expected at most {DEEPEST} levels of lists and tables, got more; take"
        " another copy"
    )
