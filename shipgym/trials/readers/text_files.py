"""Contents of logs, unpacked where they are gzip."""

import zlib
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import LARGEST_CSV, read_bytes
from shipgym.trials.readers.damage import LARGEST_UNPACKED, check_unpacked


def read_log_bytes(path: Path, what: str, largest: int = LARGEST_CSV) -> bytes:
    """Content of a file as `read_bytes` gives it, unpacked where it is gzip.

    Raises InputError for a damaged or too large one.
    """
    content = read_bytes(path, what, largest)
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
