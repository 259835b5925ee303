"""Vectors in MATLAB files of version 5 to 7, read here: SciPy crashes on damaged ones.

MathWorks, MAT-File Format, "Level 5 MAT-File Format".
"""

import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.trials.readers.frames import damage_reported
from shipgym.trials.readers.log_table import LogTable
from shipgym.trials.readers.text_files import LARGEST_UNPACKED, check_unpacked

_HEADER_BYTES = 128

#: Types of elements: matrices, compressed ones, and those of numbers as numpy names
#: them.
_MATRIX, _COMPRESSED = 14, 15
_NUMBER_TYPES = dict(
    zip(
        (1, 2, 3, 4, 5, 6, 7, 9, 12, 13),
        ["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8", "i8", "u8"],
        strict=True,
    )
)
#: In the flags of a matrix: the class, the first of the numeric ones, complex numbers.
_CLASS, _FIRST_NUMERIC, _COMPLEX = 0xFF, 6, 0x0800
_MOST_MATRICES = 10_000  # a file of zeros holds millions of empty ones


def read_matlab(path: Path, content: bytes) -> LogTable:
    """Read the numeric vectors of the commonest length, each as a column by its name.

    Those of a matrix are numbered: ``simdata(:,2)``. Raises InputError for a damaged or
    large file, one of version 7.3, and one without vectors of real numbers.
    """
    vectors = _all_vectors(path, content)
    lengths = [values.size for values in vectors.values()]
    length = max(lengths, key=lengths.count, default=0)
    if not length:
        raise InputError(
            f"{path}: expected a numeric vector for each channel, got none; a struct is"
            " not read: save('run.mat', '-struct', 'data', '-v7')"
        )
    return LogTable(
        path=path,
        cells={name: one for name, one in vectors.items() if one.size == length},
        rows=range(1, length + 1),
    )


def _all_vectors(path: Path, content: bytes) -> dict[str, Any]:
    """Numeric vectors of a file by their names."""
    header = content[:_HEADER_BYTES]
    if content.startswith(b"\x89HDF\r\n\x1a\n") or b"MATLAB 7.3" in header:
        raise InputError(
            f"{path}: expected a MATLAB file of version 5 to 7, got MATLAB 7.3 (HDF5);"
            " save(..., '-v7')"
        )
    vectors: dict[str, Any] = {}
    remedy = "save the vectors again with save(..., '-v7')"
    with damage_reported(path, "MATLAB (.mat)", remedy):
        matrices = _matrices(path, content[_HEADER_BYTES:])
        for matrix in islice(matrices, _MOST_MATRICES):
            vectors |= _vectors(matrix)
    return vectors


def _matrices(path: Path, content: bytes) -> Iterator[bytes]:
    """Contents of the matrices of a file, unpacked."""
    unpacked = 0
    for kind, element in _elements(content):
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            just_too_many = LARGEST_UNPACKED + 1 - unpacked
            inner = unpacker.decompress(element, just_too_many)
            unpacked += len(inner)
            check_unpacked(path, unpacked)
            kind, element = next(_elements(inner))
        if kind == _MATRIX:
            yield element


def _vectors(matrix: bytes) -> dict[str, Any]:
    """Numbers of a numeric matrix by its name, of one with columns by their numbers."""
    parts = list(islice(_elements(matrix), 4))
    if len(parts) < 4 or parts[3][0] not in _NUMBER_TYPES:
        return {}
    (_, flags), (_, shape), (_, name), (number_type, numbers) = parts
    values = np.frombuffer(numbers, _NUMBER_TYPES[number_type])
    sizes = np.frombuffer(shape, "<i4")
    is_table = sizes.size == 2 and np.prod(sizes) == values.size
    about, *_ = np.frombuffer(flags, "<u4")
    if not is_table or (about & _CLASS) < _FIRST_NUMERIC or about & _COMPLEX:
        return {}
    return _columns(name.decode("ascii"), values.reshape(sizes, order="F"))


def _columns(name: str, array: Any) -> dict[str, Any]:
    """Vectors by name: one of the array, or one each of its columns, ``x(:,1)``.

    A lying matrix, with fewer rows than columns, is turned. Empty for square ones,
    which are no tables.
    """
    array = np.squeeze(array).astype(np.float64)
    if array.ndim == 1 and array.size > 1:
        return {name: array}
    if array.ndim != 2:
        return {}
    if array.shape[0] < array.shape[1]:
        array = array.T
    n_rows, n_columns = array.shape
    most_columns = 100
    if n_columns in (n_rows, 0) or n_columns > most_columns:
        return {}
    return {
        f"{name}(:,{number})": np.ascontiguousarray(column)
        for number, column in enumerate(array.T, start=1)
    }


def _elements(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Elements one after another, by type, each with a tag of eight bytes."""
    tag_bytes = 8
    at = 0
    while at + tag_bytes <= len(content):
        kind, size = struct.unpack_from("<II", content, at)
        small_size = kind >> 16  # of an element within its own tag
        if small_size:
            begin = at + 4
            yield kind & 0xFFFF, content[begin : begin + min(small_size, 4)]
            at += tag_bytes
            continue
        begin = at + tag_bytes
        end = begin + size
        yield kind, content[begin:end]
        # compressed ones are not padded to eight bytes
        at = end if kind == _COMPRESSED else end + -size % 8
