"""Vectors in MATLAB files of version 5 to 7, read here: SciPy crashes on damaged ones.

MathWorks, MAT-File Format, "Level 5 MAT-File Format".
"""

import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.files import read_bytes
from shipgym.trials.readers.array_columns import array_columns, table_of_vectors
from shipgym.trials.readers.damage import (
    LARGEST_PACKED,
    LARGEST_UNPACKED,
    check_unpacked,
    damage_reported,
)
from shipgym.trials.readers.log_table import LogTable

_HEADER_BYTES = 128

#: Types of elements: matrices, compressed ones, and those of numbers as numpy names
#: them.
_MATRIX, _COMPRESSED = 14, 15
_NUMBER_TYPES = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
#: In the flags of a matrix: the class, the first of the numeric ones, complex numbers.
_CLASS, _FIRST_NUMERIC, _COMPLEX = 0xFF, 6, 0x0800


class Element(NamedTuple):
    """One element of a MATLAB file."""

    type: int
    content: bytes


def read_matlab(path: Path) -> LogTable:
    """Read the numeric vectors of the commonest length, each as a column by its name.

    Those of a matrix are numbered: ``simdata(:,2)``.

    Raises InputError for a damaged or large file, one of version 7.3, one without
    vectors, and complex numbers.
    """
    content = read_bytes(path, "MATLAB file", LARGEST_PACKED)
    header = content[:_HEADER_BYTES]
    is_hdf5 = content.startswith(b"\x89HDF\r\n\x1a\n")
    if is_hdf5 or b"MATLAB 7.3" in header:
        raise InputError(
            f"{path}: expected a MATLAB file of version 5 to 7, got MATLAB 7.3 (HDF5);"
            " save(..., '-v7')"
        )
    remedy = "save the vectors again with save(..., '-v7')"
    with damage_reported(path, "MATLAB (.mat)", remedy):
        order = "<" if header.endswith(b"IM") else ">"
        vectors: dict[str, Floats] = {}
        for matrix in _matrices(path, content[_HEADER_BYTES:], order):
            vectors |= _vectors(path, matrix, order)
    return table_of_vectors(
        path,
        vectors,
        "a numeric vector for each channel, got none; a struct is not read:"
        " save('run.mat', '-struct', 'data', '-v7')",
    )


def _matrices(path: Path, content: bytes, order: str) -> Iterator[bytes]:
    """Contents of the matrices of a file, unpacked; `order` is "<" or ">"."""
    most = 10_000  # a file of zeros holds millions of empty ones
    unpacked = 0
    for number, element in enumerate(_elements(content, order)):
        if number == most:
            raise InputError(
                f"{path}: expected at most {most} variables, got more; save a"
                " few vectors: save('run.mat', 't', 'psi', '-v7')"
            )
        if element.type == _COMPRESSED:
            unpacker = zlib.decompressobj()
            just_too_many = LARGEST_UNPACKED + 1 - unpacked
            inner = unpacker.decompress(element.content, just_too_many)
            unpacked += len(inner)
            check_unpacked(path, unpacked)
            element = next(_elements(inner, order))
        if element.type == _MATRIX:
            yield element.content


def _vectors(path: Path, matrix: bytes, order: str) -> dict[str, Floats]:
    """Numbers of a numeric matrix by its name, of one with columns by their numbers."""
    parts = list(islice(_elements(matrix, order), 4))
    if len(parts) < 4:
        return {}
    flags, shape, name, numbers = parts
    if numbers.type not in _NUMBER_TYPES:
        return {}

    number_type = order + _NUMBER_TYPES[numbers.type]
    values = np.frombuffer(numbers.content, number_type)
    sizes = np.frombuffer(shape.content, f"{order}i4")
    is_table = sizes.size == 2 and np.prod(sizes) == values.size
    (about,) = struct.unpack(f"{order}I", flags.content[:4])
    is_numeric = (about & _CLASS) >= _FIRST_NUMERIC
    if not is_table or not is_numeric:
        return {}

    label = name.content.decode("ascii")
    columns = array_columns(label, values.reshape(sizes, order="F"))
    if not columns:
        return {}
    if about & _COMPLEX:
        raise InputError(
            f"{path}: variable {label!r}: expected real numbers, got complex ones; save"
            " real(...)"
        )
    return {key: vector.astype(np.float64) for key, vector in columns.items()}


def _elements(content: bytes, order: str) -> Iterator[Element]:
    """Elements one after another, each with a tag of eight bytes: type and size."""
    tag_bytes = 8
    at = 0
    while at + tag_bytes <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        small_size = kind >> 16  # of an element within its own tag
        if small_size:
            begin = at + 4
            end = begin + min(small_size, 4)
            yield Element(kind & 0xFFFF, content[begin:end])
            at += tag_bytes
            continue
        begin = at + tag_bytes
        end = begin + size
        yield Element(kind, content[begin:end])
        # compressed ones are not padded to eight bytes
        at = end if kind == _COMPRESSED else end + -size % 8
