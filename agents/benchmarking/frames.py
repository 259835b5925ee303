"""Frames between a benchmark and its contestants: JSON, and an array of numbers."""

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

LENGTHS = struct.Struct("<II")  # of the header and of the numbers, bytes
NO_NUMBERS = np.zeros(0, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class Frame:
    """A message: what is said, and numbers of any shape."""

    header: Mapping[str, Any]
    numbers: NDArray[np.float32] = field(default_factory=lambda: NO_NUMBERS)


def write_frame(stream: BinaryIO | Any, frame: Frame) -> None:
    """Write a frame; OSError if nobody reads."""
    numbers = np.ascontiguousarray(frame.numbers, dtype=np.float32)
    header = {**frame.header, "shape": numbers.shape}
    text = json.dumps(header).encode()
    content = numbers.tobytes()
    stream.write(LENGTHS.pack(len(text), len(content)))
    stream.write(text)
    stream.write(content)
    stream.flush()


def read_frame(stream: BinaryIO | Any) -> Frame:
    """Read a frame; EOFError at the end, ValueError for anything else."""
    n_text, n_content = LENGTHS.unpack(_read(stream, LENGTHS.size))
    largest = 1 << 28  # bytes
    if max(n_text, n_content) > largest:
        raise ValueError("expected a frame, got something else")
    header = json.loads(_read(stream, n_text))
    content = np.frombuffer(_read(stream, n_content), dtype=np.float32)
    return Frame(header, content.reshape(header.pop("shape")))


def _read(stream: BinaryIO | Any, n_bytes: int) -> bytes:
    content: bytes = stream.read(n_bytes)
    if len(content) < n_bytes:
        raise EOFError
    return content
