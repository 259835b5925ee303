"""Errors of libraries on damaged files as one message, and limits of size."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from shipgym.errors import InputError
from shipgym.files import MIB

#: Most bytes of an Excel or MATLAB file, and of what any file is unpacked to.
LARGEST_PACKED, LARGEST_UNPACKED = 32 * MIB, 256 * MIB


@contextmanager
def damage_reported(path: Path, kind: str, remedy: str) -> Iterator[None]:
    """Turn exceptions within the block into an InputError that ends with `remedy`."""
    try:
        yield
    except InputError:
        raise
    except ModuleNotFoundError as error:
        raise InputError(
            f"{path}: {error.name}, which reads {kind}, is not installed: pip install"
            " 'shipgym[logs]'"
        ) from None
    except Exception as error:
        kind_of_error = type(error).__name__
        words = f"{kind_of_error}: {error}".split()
        reason = " ".join(words)[:200]
        raise InputError(f"{path}: expected {kind}, got {reason}; {remedy}") from None


def check_unpacked(path: Path, size: int) -> None:
    """Refuse a file that unpacks to more than `LARGEST_UNPACKED` bytes."""
    if size > LARGEST_UNPACKED:
        raise InputError(
            f"{path}: expected at most {LARGEST_UNPACKED} bytes unpacked, got more;"
            " split the file"
        )
