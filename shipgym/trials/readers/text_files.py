"""Texts of logs, unpacked and decoded, whatever the instrument's encoding."""

import re
import zlib
from pathlib import Path
from typing import NamedTuple

from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, read_bytes, shipped_toml
from shipgym.trials.readers.damage import LARGEST_UNPACKED, check_unpacked

#: Encodings of several bytes a character, and Cyrillic: none is refused by its bytes
#: alone, so that the words decide.
_FOREIGN = ("cp932", "gb18030", "euc_jp", "big5", "euc_kr", "cp1251")


class LogText(NamedTuple):
    """A text, and its encoding where it is not UTF-8."""

    text: str
    encoding: str


def read_log_bytes(path: Path, what: str, largest: int = LARGEST_CSV) -> bytes:
    """Content of a file as `read_bytes` gives it, unpacked where it is gzip.

    Raises InputError for a damaged or too large one.
    """
    content = read_bytes(path, what, largest)
    magic = b"\x1f\x8b"
    if not content.startswith(magic):
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


def decode(path: Path, what: str, content: bytes) -> LogText:
    """Decode the text of a log: UTF-8, UTF-16, Latin-1 or, by its words, another.

    Raises InputError with the line for bytes that are no text.
    """
    wide = _utf_16(content)
    if wide:
        try:
            text = content.decode(wide)
        except UnicodeDecodeError as error:
            raise _no_text(path, what, content, error.start) from None
        return LogText(text.removeprefix("\ufeff"), "UTF-16")
    try:
        return LogText(content.decode("utf-8-sig"), "")
    except UnicodeDecodeError as error:
        foreign = _by_words(content)
        if foreign is not None:
            return foreign
        # as instruments write the sign of degrees; no control characters
        if not re.search(rb"[\x80-\x9f\xfe\xff\0]", content):
            return LogText(content.decode("latin-1"), "")
        raise _no_text(path, what, content, error.start) from None


def _utf_16(content: bytes) -> str:
    """Encoding of a text in UTF-16, with or without its mark; empty for others."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    beginning = content[:400]
    pairs = len(beginning) // 2
    if pairs >= 4:
        if beginning[1::2].count(0) == pairs:
            return "utf-16-le"
        if beginning[::2][:pairs].count(0) == pairs:
            return "utf-16-be"
    return ""


def _by_words(content: bytes) -> LogText | None:
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
            best = LogText(text, encoding)
    return best


def _foreign_words() -> set[str]:
    """Names of columns without Latin letters."""
    languages = shipped_toml("shipgym.trials.guesses", "column_names.toml")
    words = set()
    for names in languages.values():
        for patterns in names.values():
            for pattern in patterns:
                word = pattern.strip("*")
                has_latin = re.search("[a-z\xc0-\u024f]", word)
                if not has_latin:
                    words.add(word)
    return words


def _no_text(path: Path, what: str, content: bytes, start: int) -> InputError:
    before = content[:start]
    line = before.count(b"\n") + 1
    byte = content[start]
    expected = f"expected a {what} in UTF-8"
    found = f"byte 0x{byte:02x} (binary content)"
    return InputError(
        f"{path}: line {line}: {expected}, got {found}; save it as text in UTF-8"
    )
