"""Nested values with arrays in them as one safetensors file: numbers and names, no code; written whole."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.files import check_readable, write_bytes

Arrays = dict[str, Any]
#: Entries of the file's metadata: what is not an array, as JSON, and the SHA-256 of
#: all.
CONTENT, SHA256 = "content", "sha256"
DEEPEST = 20  # values within values
#: What reading anything else raises.
MALFORMED = (
    OSError,
    LookupError,
    TypeError,
    ValueError,
    AttributeError,
    RecursionError,
)
TYPES = ("BOOL", "U8", "U32", "U64", "I32", "I64", "F32", "F64")  # of arrays


def write_values(value: Any, path: Path) -> None:
    """Write a nested value to a temporary name beside the file, then rename it.

    `value`: dictionaries, lists and tuples of arrays, torch's tensors, numbers, texts
    and None. Raises InputError if the file cannot be written; TypeError for anything
    else in it.
    """
    from safetensors.numpy import save

    arrays: Arrays = {}
    content = json.dumps(_packed(value, "", arrays))
    write_bytes(save(arrays, {CONTENT: content, SHA256: _hash(content, arrays)}), path)


def read_values(path: Path, what: str) -> Any:
    """What `write_values` wrote, tensors as tensors.

    Raises InputError if the file is missing, cut short, changed since or another.
    """
    from safetensors import SafetensorError, safe_open

    check_readable(path, what)
    arrays: Arrays = {}
    try:
        with safe_open(path, "numpy") as file:
            for name in file.keys():  # noqa: SIM118 - it is no mapping
                if (kind := file.get_slice(name).get_dtype()) not in TYPES:
                    raise ValueError(
                        f"'{name}' of type {kind}, expected one of {', '.join(TYPES)}"
                    )
                arrays[name] = file.get_tensor(name)
            about = file.metadata()
        if about[SHA256] != _hash(about[CONTENT], arrays):
            raise ValueError("its SHA-256 is not that of its content")
        return _unpacked(json.loads(about[CONTENT]), arrays)
    except (SafetensorError, *MALFORMED) as error:
        raise InputError(
            f"{path}: not a {what}, or one that is cut short ({error})"
        ) from None


def _hash(content: str, arrays: Arrays) -> str:
    """SHA-256 of what is not an array, and of arrays with their names, types and shapes."""
    digest = hashlib.sha256(content.encode())
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


def check_like(found: Any, own: Any, where: str) -> None:
    """Raise ValueError, naming the first place, unless one value is like another.

    The same names and texts, lists of one length, arrays and tensors of the same type
    and shape, finite where `own` is finite, numbers of a kind: finite, whole ones not
    negative. A function in `own` is asked what is expected, of what is found.
    """
    own = own(found) if callable(own) else own
    told, expected = _kind(found), _kind(own)
    if told != expected:
        raise ValueError(f"{where}: {told} found, expected {expected}")
    if isinstance(own, dict):
        for name in own:
            place = where + (f".{name}" if isinstance(name, str) else f"[{name}]")
            if name not in found:
                raise ValueError(
                    f"{place}: nothing found, beside {', '.join(map(str, found))[:200]}"
                )
            check_like(found[name], own[name], place)
    elif isinstance(own, list | tuple):
        for number, one in enumerate(own):
            check_like(found[number], one, f"{where}[{number}]")
    elif _is_array(own):
        numbers = _as_array(found)
        if wrong := np.argwhere(
            np.isfinite(_as_array(own)) & ~np.isfinite(numbers)
        ).tolist():
            number = numbers[tuple(wrong[0])]
            raise ValueError(
                f"{where}: {number} found at {wrong[0]}, expected a finite number"
            )


def _is_array(value: Any) -> bool:
    """Whether it is an array with axes, or a tensor of torch."""
    return np.ndim(value) > 0 or hasattr(value, "detach")


def _as_array(value: Any) -> Any:
    """An array itself, a tensor's numbers."""
    return value.detach().cpu().numpy() if hasattr(value, "detach") else value


def _kind(value: Any) -> str:
    """What a value is, of a dictionary, list or tuple how long."""
    if isinstance(value, dict):
        return f"a table of {len(value)}"
    if isinstance(value, list | tuple):
        return f"{type(value).__name__} of {len(value)}"
    if _is_array(value):
        return f"{type(value).__name__} of {value.dtype}, shape {tuple(value.shape)}"
    number = value.item() if isinstance(value, np.ndarray | np.generic) else value
    whole = isinstance(number, int) and number >= 0
    known = whole or (isinstance(number, float) and math.isfinite(number))
    return type(number).__name__ if known else repr(number)[:80]


def _packed(value: Any, name: str, arrays: Arrays) -> Any:
    """A value in JSON, its arrays by name set aside."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        arrays[name] = np.array(value, order="C")
        return {"array": name}
    if isinstance(value, dict):
        inner = f"{name}." if name else ""
        return {
            "dict": [
                [key, _packed(one, f"{inner}{key}", arrays)]
                for key, one in value.items()
            ]
        }
    if isinstance(value, list | tuple):
        items = [_packed(one, f"{name}.{i}", arrays) for i, one in enumerate(value)]
        return {"tuple" if isinstance(value, tuple) else "list": items}
    if hasattr(value, "detach"):
        arrays[name] = np.array(_as_array(value), order="C")
        return {"tensor": name}
    raise TypeError(f"{name}: {type(value).__name__} cannot be written")


def _unpacked(content: Any, arrays: Arrays, deeper: int = DEEPEST) -> Any:
    """The value that `_packed` made this of; ValueError, TypeError or KeyError if it made it of none."""
    if not isinstance(content, dict):
        return content
    ((kind, inner),) = content.items()
    if not deeper or kind not in ("array", "tensor", "dict", "list", "tuple"):
        raise ValueError(f"{kind!r} found among its values, {DEEPEST - deeper} deep")
    if kind == "array":
        return arrays[inner]
    if kind == "tensor":
        import torch

        return torch.from_numpy(arrays[inner].copy())
    if kind == "dict":
        return {key: _unpacked(one, arrays, deeper - 1) for key, one in inner}
    items = [_unpacked(one, arrays, deeper - 1) for one in inner]
    return tuple(items) if kind == "tuple" else items
