"""Texts of logs, decoded, and the most that a file may unpack to."""

import re
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import MIB

#: Most bytes that any file is unpacked to.
LARGEST_UNPACKED = 256 * MIB


def check_unpacked(path: Path, size: int) -> None:
    """Refuse a file that unpacks to more than `LARGEST_UNPACKED` bytes."""
    if size > LARGEST_UNPACKED:
        raise InputError(
            f"{path}: expected at most {LARGEST_UNPACKED} bytes unpacked, got more;"
            " split the file"
        )


def text_lines(path: Path, content: bytes) -> list[str]:
    """Lines of a text in UTF-8, UTF-16 or Latin-1, at most a million.

    Raises InputError for more, and with the line for bytes that are no text.
    """
    text = _decode(path, content)
    lines = re.split(r"\r\n|\r|\n", text)
    most = 1_000_000
    count = len(lines)
    if count > most:
        raise InputError(
            f"{path}: expected at most {most} lines, got {count}; split the file"
        )
    return lines


def _decode(path: Path, content: bytes) -> str:
    is_wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        return content.decode("utf-16" if is_wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        start = error.start
    # as instruments write the sign of degrees; no control characters
    if not is_wide and not re.search(rb"[\x80-\x9f\xfe\xff\0]", content):
        return content.decode("latin-1")
    line = content[:start].count(b"\n") + 1
    raise InputError(
        f"{path}: line {line}: expected a text in UTF-8, got byte"
        f" 0x{content[start]:02x} (binary content); save it as text in UTF-8"
    )
