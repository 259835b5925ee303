"""Texts of logs, unpacked and decoded, whatever the instrument's encoding."""

import re
import zlib
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, MIB, read_bytes, shipped_toml

#: Most bytes that any file is unpacked to.
LARGEST_UNPACKED = 256 * MIB
#: Encodings of several bytes a character, and Cyrillic: none is refused by its bytes
#: alone, so that the words decide.
_FOREIGN = ("cp932", "gb18030", "euc_jp", "big5", "euc_kr", "cp1251")


def read_log_bytes(path: Path, what: str) -> bytes:
    """Content of a file as `read_bytes` gives it, unpacked where it is gzip.

    Raises InputError for a damaged or too large one.
    """
    content = read_bytes(path, what, LARGEST_CSV)
    if not content.startswith(b"\x1f\x8b"):
        return content
    unpacker = zlib.decompressobj(wbits=31)
    try:
        unpacked = unpacker.decompress(content, LARGEST_UNPACKED + 1)
    except zlib.error as error:
        raise InputError(
            f"{path}: expected a {what} packed by gzip, got a damaged one ({error});"
            " pack it again"
        ) from None
    check_unpacked(path, len(unpacked))
    if not unpacker.eof:
        raise InputError(
            f"{path}: expected a {what} packed by gzip, got one that is cut short; copy"
            " it again"
        )
    return unpacked


def check_unpacked(path: Path, size: int) -> None:
    """Refuse a file that unpacks to more than `LARGEST_UNPACKED` bytes."""
    if size > LARGEST_UNPACKED:
        raise InputError(
            f"{path}: expected at most {LARGEST_UNPACKED} bytes unpacked, got more;"
            " split the file"
        )


def text_lines(path: Path, content: bytes) -> tuple[list[str], str]:
    """Lines of a text in UTF-8, UTF-16, Latin-1 or, by its words, another encoding.

    The encoding, empty for UTF-8 and Latin-1, comes with them.
    Raises InputError for more than a million, and with the line for bytes that are no
    text.
    """
    text, encoding = _decode(path, content)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    most = 1_000_000
    if len(lines) > most:
        raise InputError(
            f"{path}: expected at most {most} lines, got {len(lines)}; split the file"
        )
    return lines, encoding


def _decode(path: Path, content: bytes) -> tuple[str, str]:
    """A text and its encoding, empty for UTF-8 and Latin-1."""
    wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        if wide:
            return content.decode("utf-16"), ""
        return content.decode("utf-8-sig"), ""
    except UnicodeDecodeError as error:
        start = error.start
    foreign = None if wide else _by_words(content)
    if foreign is not None:
        return foreign
    # as instruments write the sign of degrees; no control characters
    if not wide and not re.search(rb"[\x80-\x9f\xfe\xff\0]", content):
        return content.decode("latin-1"), ""
    line = content[:start].count(b"\n") + 1
    raise InputError(
        f"{path}: line {line}: expected a text in UTF-8, got byte"
        f" 0x{content[start]:02x} (binary content); save it as text in UTF-8"
    )


def _by_words(content: bytes) -> tuple[str, str] | None:
    """Text in that encoding in which most names of channels stand; None without."""
    best = None
    most = 0
    words = _foreign_words()
    for encoding in _FOREIGN:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        beginning = text[:4000].lower()
        known = sum(len(word) for word in words if word in beginning)
        if known > most:
            most = known
            best = text, encoding
    return best


def _foreign_words() -> set[str]:
    """Names of columns without Latin letters."""
    languages = shipped_toml("shipgym.trials.guesses", "column_names.toml")
    words: set[str] = set()
    for names in languages.values():
        for patterns in names.values():
            words.update(pattern.strip("*") for pattern in patterns)
    return {word for word in words if not re.search("[a-z\xc0-\u024f]", word)}
