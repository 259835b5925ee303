"""Nested values with arrays as one safetensors file: numbers and names, no code."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym.errors import InputError
from shipgym.files import check_readable, write_bytes

Arrays = dict[str, NDArray[Any]]
#: Entries of the file's metadata: what is not an array, as JSON, and the SHA-256 of
#: all.
CONTENT = "content"
SHA256 = "sha256"
DEEPEST = 20  # values within values


def write_values(value: Any, path: Path) -> None:
    """Write a nested value to a temporary name next to the file, then rename it.

    `value`: dictionaries, lists and tuples of arrays, torch's tensors, numbers, strings
    and None. Raises InputError if the file cannot be written; TypeError for anything
    else in it.
    """
    from safetensors.numpy import save

    arrays: Arrays = {}
    packed = _packed(value, "", arrays)
    content = json.dumps(packed)
    metadata = {CONTENT: content, SHA256: _hash(content, arrays)}
    write_bytes(save(arrays, metadata), path)


def read_values(path: Path, what: str) -> Any:
    """Read the value that `write_values` wrote, with tensors as tensors.

    Raises InputError if the file is missing, cut short, changed since or another.
    """
    from safetensors import SafetensorError

    check_readable(path, what)
    malformed = (
        SafetensorError,
        OSError,
        LookupError,
        TypeError,
        ValueError,
        AttributeError,
        RecursionError,
    )
    try:
        metadata, arrays = _read_arrays(path)
        content = metadata[CONTENT]
        if metadata[SHA256] != _hash(content, arrays):
            raise ValueError("its SHA-256 is not that of its content")
        return _unpacked(json.loads(content), arrays, DEEPEST)
    except malformed as error:
        raise InputError(
            f"{path}: not a {what}, or one that is cut short ({error})"
        ) from None


def _read_arrays(path: Path) -> tuple[Mapping[str, str], Arrays]:
    from safetensors import safe_open

    known = ("BOOL", "U8", "U32", "U64", "I32", "I64", "F32", "F64")
    arrays: Arrays = {}
    with safe_open(path, "numpy") as file:
        names = list(file.keys())
        for name in names:
            tensor = file.get_slice(name)
            kind = tensor.get_dtype()
            if kind not in known:
                raise ValueError(
                    f"'{name}': expected a type of {', '.join(known)}, got {kind}"
                )
            arrays[name] = file.get_tensor(name)
        return file.metadata(), arrays


def _hash(content: str, arrays: Arrays) -> str:
    """SHA-256 of the content and of arrays with their names, types and shapes."""
    digest = hashlib.sha256(content.encode())
    for name, array in sorted(arrays.items()):
        about = f"{name} {array.dtype} {array.shape}"
        digest.update(about.encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def is_tensor(value: Any) -> bool:
    """Return whether a value is a tensor of torch, which need not be installed."""
    return hasattr(value, "detach")


def numbers_of(value: Any) -> NDArray[Any]:
    """Return an array itself, or the numbers of a tensor."""
    numbers: NDArray[Any] = value.detach().cpu().numpy() if is_tensor(value) else value
    return numbers


def _packed(value: Any, name: str, arrays: Arrays) -> Any:
    """Return a value as JSON has it, and put its arrays aside by name."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray) or is_tensor(value):
        arrays[name] = np.array(numbers_of(value), order="C")
        return {"tensor" if is_tensor(value) else "array": name}
    if isinstance(value, dict):
        entries = []
        for key, entry in value.items():
            inner = f"{name}.{key}" if name else str(key)
            entries.append([key, _packed(entry, inner, arrays)])
        return {"dict": entries}
    if isinstance(value, list | tuple):
        items = []
        for number, item in enumerate(value):
            items.append(_packed(item, f"{name}.{number}", arrays))
        return {"tuple" if isinstance(value, tuple) else "list": items}
    raise TypeError(f"{name}: {type(value).__name__} cannot be written")


def _unpacked(content: Any, arrays: Arrays, deeper: int) -> Any:
    """Return the value that `_packed` made this of.

    Raises ValueError, TypeError or KeyError for anything else.
    """
    if not isinstance(content, dict):
        return content
    ((kind, inner),) = content.items()
    if not deeper or kind not in ("array", "tensor", "dict", "list", "tuple"):
        depth = DEEPEST - deeper
        raise ValueError(f"{kind!r} found among its values, {depth} deep")

    if kind == "array":
        return arrays[inner]
    if kind == "tensor":
        import torch

        return torch.from_numpy(arrays[inner].copy())
    if kind == "dict":
        return {key: _unpacked(entry, arrays, deeper - 1) for key, entry in inner}
    items = [_unpacked(item, arrays, deeper - 1) for item in inner]
    return tuple(items) if kind == "tuple" else items
