"""Files that are read within stated limits and with one clear error, and written whole or not at all.

Whatever is read is a regular file of at most so many bytes, and what JSON and TOML hold
is checked in one place (`check_content`), before any reader looks at its fields.
"""

import json
import math
import os
import re
import shutil
import socket
import stat
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from errno import EBUSY, ENOENT, EXDEV
from functools import cache, partial
from importlib import resources
from pathlib import Path
from typing import Any
from zlib import crc32

from shipgym.checks import check_table, did_you_mean, shown
from shipgym.errors import InputError

MIB = 2**20
#: Most bytes of a file of each kind.
LARGEST_TOML, LARGEST_JSON, LARGEST_CSV, LARGEST_TENSORS = (
    MIB // 4,
    32 * MIB,
    64 * MIB,
    256 * MIB,
)
#: Most values in a JSON or TOML file, most levels of lists and tables within each
#: other, longest key.
MOST_VALUES, DEEPEST, LONGEST_KEY = 1_000_000, 20, 4096
#: Largest magnitude of a number: products of three such numbers are still finite.
LARGEST_NUMBER = 1e100

#: A dotted key that nests deeper than allowed, on which `tomllib` spends time and
#: memory by the square.
_LONG_KEY = re.compile(
    rf"""(?:\.[ \t]*(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*){{{DEEPEST}}}"""
)
_AT_ONCE = getattr(
    os, "O_NONBLOCK", 0
)  # without waiting, should a file have become a pipe
#: What cannot be written in UTF-8, or ends a text for the operating system.
_UNWRITABLE = re.compile("[\0\ud800-\udfff]")
_NOT_LATIN = re.compile(rb"[\x80-\x9f\xfe\xff\0]")
#: Names of `draft_name`.
DRAFT = re.compile(r"\..+\.([0-9a-f]{8})-(\d+)\.draft", re.DOTALL)
ABANDONED_S = 7 * 86400.0
MOUNTED = (EXDEV, EBUSY)  # what renaming onto a mount point fails with


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary name beside a file, renamed to it when the block ends without an error.

    InputError if the folder does not exist or cannot be written, or what is there is no
    file, as a device.
    """
    draft = draft_name(path)
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is not a file; choose another name")
        remove_drafts(path.parent)
        yield draft
        try:
            draft.replace(path)
        except OSError as error:
            if error.errno not in MOUNTED:
                raise
            shutil.copyfile(draft, path)
    except OSError as error:
        remedy = "; choose a folder that exists" if error.errno == ENOENT else ""
        raise InputError(
            f"{path}: cannot be written ({error.strerror or error}){remedy}"
        ) from error
    finally:
        with suppress(OSError):
            draft.unlink()


def draft_name(path: Path) -> Path:
    """The hidden name beside a file or folder under which this process writes it."""
    return path.parent / f".{path.name}.{_host()}-{os.getpid()}.draft"


@contextmanager
def draft_folder(path: Path) -> Iterator[Path]:
    """A folder beside a path that is removed when the block ends, unless it was renamed."""
    remove_drafts(path.parent)
    draft = draft_name(path)
    shutil.rmtree(draft, ignore_errors=True)  # of a killed process of the same number
    try:
        draft.mkdir()
        yield draft
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def abandoned_drafts(folder: Path) -> list[Path]:
    """Drafts in a folder whose process is dead.

    Those of other computers, and of a process whose number is in use again, count after
    a week.
    """
    found = []
    with suppress(OSError):
        for path in folder.iterdir():
            named = DRAFT.fullmatch(path.name)
            if named and (
                _is_dead(*named.groups())
                or time.time() - path.lstat().st_mtime > ABANDONED_S
            ):
                found.append(path)
    return found


@cache
def remove_drafts(folder: Path) -> None:
    """Remove what killed processes left half-written in a folder; a process looks once in each folder."""
    for path in abandoned_drafts(folder):
        with suppress(OSError):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _is_dead(host: str, process: str) -> bool:
    """Whether a process of this computer is no more."""
    if host != _host() or os.name != "posix":  # elsewhere the signal 0 would end it
        return False
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:
        pass
    return False


@cache
def _host() -> str:
    return f"{crc32(socket.gethostname().encode()):08x}"


def make_folder(folder: Path) -> None:
    """Make a folder and those above it where they do not exist; raises InputError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{folder}: no folder can be made there ({error.strerror or error})"
        ) from None


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
    """InputError for what is missing, no regular file, or cannot be read; `what` it is, as "CSV file"."""
    read_bytes(path, what, 0)


def read_bytes(path: Path, what: str, largest: int) -> bytes:
    """The content of a regular file of at most `largest` bytes, none of it where that is 0.

    Raises InputError for a file that is missing, too large or cannot be read, and for a
    folder, a device or a pipe, which is not opened; `what` is expected there, as "CSV
    file".
    """
    try:
        kind = path.stat().st_mode
        if not stat.S_ISREG(kind):
            found = (
                "a folder"
                if stat.S_ISDIR(kind)
                else "no regular file (a device, a pipe or a socket)"
            )
            raise InputError(f"{path}: this is {found}, expected a {what}")
        with open(
            path, "rb", opener=lambda name, flags: os.open(name, flags | _AT_ONCE)
        ) as file:
            size = os.fstat(file.fileno()).st_size
            if not largest:
                return b""
            if size > largest:
                raise InputError(
                    f"{path}: {size} bytes found, expected a {what} of at most"
                    f" {largest} bytes; split it, or leave out what is not needed"
                )
            return file.read(size)
    except InputError:
        raise
    except FileNotFoundError:
        near = did_you_mean(path.name, [other.name for other in path.parent.glob("*")])
        raise InputError(f"{path}: there is no such {what}.{near}") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{path}: cannot be read ({reason}), expected a {what}"
        ) from None


def read_text(path: Path, what: str, largest: int, latin: bool = False) -> str:
    """A text in UTF-8, as `read_bytes` reads; InputError, naming the line, for what is no such text.

    With `latin`, other bytes are read as Latin-1, as instruments write the sign of
    degrees, unless they are control characters there, or those of UTF-16 and of memory
    that was never written.
    """
    data = read_bytes(path, what, largest)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if latin and not _NOT_LATIN.search(data):
            return data.decode("latin-1")
        line = data[: error.start].count(b"\n") + 1
        found = (
            f"line {line} holds byte 0x{data[error.start]:02x}, which is not UTF-8 text"
            " (binary content)"
        )
        if data.startswith((b"\xff\xfe", b"\xfe\xff")):
            found = "the file is in UTF-16"
        raise InputError(
            f"{path}: {found}, expected a {what}; save it as text in UTF-8"
        ) from None


def read_json(path: Path, what: str, remedy: str) -> Mapping[str, Any]:
    """The object in a JSON file; `what` is expected there, and `remedy` says what to do about a broken one.

    Raises InputError as `read_text` does, and if the file is cut short, holds no
    object, or something that `check_content` refuses.
    """
    text = read_text(path, f"{what} (JSON)", LARGEST_JSON)
    return check_table(parse_json(text, f"{path}:", remedy), str(path))


def parse_json(text: str, where: str, remedy: str) -> Any:
    """The value of a JSON text within the limits of `check_content`; `where` begins messages: "a.json:"."""
    loads = partial(json.loads, object_pairs_hook=_unrepeated)
    return _parsed(
        loads,
        text,
        where,
        "broken JSON ({}); the file may be cut short: " + remedy,
        False,
    )


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The tables of a TOML file; `what` is expected there, as "ship file".

    Raises InputError as `read_text` does, and if the file is not TOML or holds
    something that `check_content` refuses.
    """
    return parse_toml(read_text(path, f"{what} (TOML)", LARGEST_TOML), f"{path}:")


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text within the limits of `check_content`; `where` begins messages: "a.toml:"."""
    if _LONG_KEY.search(text):
        raise InputError(
            f"{where} a dotted key of over {DEEPEST} parts found, expected shorter keys"
        )
    return dict(
        _parsed(
            tomllib.loads,
            text,
            where,
            "not valid TOML: {}; correct that line",
            infinite=True,
        )
    )


def shipped_toml(package: str, name: str) -> dict[str, Any]:
    """The tables of a TOML file that comes with a package."""
    return tomllib.loads(resources.files(package).joinpath(name).read_text("utf-8"))


def toml_value(text: str) -> Any:
    """A value as TOML has it, such as 3, true or [1, 2]; any other text is itself."""
    try:
        return parse_toml(f"value = {text}", "value:")["value"]
    except InputError:
        return text


def named_values(texts: Iterable[str], where: str, example: str) -> dict[str, Any]:
    """Values of texts `name=value`, as TOML has them, by name; InputError for one written otherwise."""
    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name:
            raise InputError(
                f"{where}: {text!r} found, expected name=value, such as {where}"
                f" {example}"
            )
        found[name] = toml_value(value)
        if found[name] == value:  # not TOML, or more than a file may hold
            with suppress(ValueError):
                found[name] = float(value)  # such as .5 or nan
            check_content({name: found[name]}, where, infinite=True)
    return found


def check_content(
    value: Any, where: str, infinite: bool = False, depth: int = 1
) -> None:
    """Refuse what no file of this project holds, before its fields are looked at.

    In a list or table from JSON or TOML these are: lists and tables more than `DEEPEST`
    deep, whole numbers of more than 64 bits (a `seed` may have 128), numbers that are
    nan or exceed `LARGEST_NUMBER` (unless `infinite` ones may stand there), dates, keys
    longer than `LONGEST_KEY`, and texts with null bytes or halves of characters. Raises
    InputError, which begins with `where`, "model.json:", and names the place.
    """
    if depth > DEEPEST:
        raise InputError(
            f"{where}: lists or tables nest deeper than {DEEPEST}; take another copy"
        )
    for key, item in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(key, str) and (len(key) > LONGEST_KEY or _UNWRITABLE.search(key)):
            raise InputError(
                f"{where}: key {shown(key)} found, expected a text of at most"
                f" {LONGEST_KEY} characters"
            )
        nested = isinstance(item, dict | list)
        fault = "" if nested else _fault(key, item, infinite)
        if not nested and not fault:
            continue
        place = (
            f"{where}[{key}]"
            if isinstance(key, int)
            else f"{where}{' ' if depth == 1 else '.'}{key}"
        )
        if not nested:
            raise InputError(f"{place}: {shown(item)} found, expected {fault}")
        check_content(item, place, infinite, depth + 1)


def _fault(key: str | int, value: Any, infinite: bool) -> str:
    """What is expected in the place of a single value; empty where nothing is wrong with it."""
    if isinstance(value, float):
        fine = abs(value) <= LARGEST_NUMBER or (infinite and math.isinf(value))
        return "" if fine else f"a number of magnitude {LARGEST_NUMBER:g} at most"
    if isinstance(value, int):
        bits = 128 if key == "seed" else 64  # NumPy draws seeds of 128 bits
        return (
            ""
            if value.bit_length() <= bits
            else f"a whole number of at most {bits} bits"
        )
    if isinstance(value, str):
        return (
            "a text without null bytes and halves of characters"
            if _UNWRITABLE.search(value)
            else ""
        )
    return "" if value is None else "a text, a number, true or false"


def _parsed(
    parse: Callable[[str], Any], text: str, where: str, broken: str, infinite: bool
) -> Any:
    """What a parser makes of a text, within the limits; `broken` says what is wrong with its syntax."""
    if sum(map(text.count, "[{,")) > MOST_VALUES:
        raise InputError(
            f"{where} more than {MOST_VALUES} values found, expected fewer; split the"
            " file"
        )
    try:
        content = parse(text)
    except RecursionError:
        raise InputError(
            f"{where} lists or tables nest deeper than {DEEPEST}; take another copy"
        ) from None
    except KeyError as error:
        raise InputError(
            f"{where} key {shown(error.args[0])} appears twice, expected each once"
        ) from None
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{where} {broken.format(error)}") from None
    except ValueError:  # Python's limit to the digits of a whole number
        raise InputError(f"{where} a whole number of more than 64 bits found") from None
    check_content(
        content if isinstance(content, dict | list) else [content], where, infinite
    )
    return content


def _unrepeated(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A table of pairs; KeyError for a key that appears twice."""
    table = dict(pairs)
    if len(table) < len(pairs):
        raise KeyError(Counter(key for key, _ in pairs).most_common(1)[0][0])
    return table
