"""Nested values with arrays in them as one safetensors file: numbers and names, no code; written whole."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from shipgym.errors import InputError
from shipgym.files import write_bytes

Arrays = dict[str, Any]
CONTENT = "content"  # entry of the file's metadata: what is not an array, as JSON


def write_values(value: Any, path: Path) -> None:
    """Write a nested value to a temporary name beside the file, then rename it.

    `value`: dictionaries, lists and tuples of arrays, torch's tensors, numbers, texts and None. Raises
    InputError if the file cannot be written; TypeError for anything else in it.
    """
    from safetensors.numpy import save

    arrays: Arrays = {}
    content = json.dumps(_packed(value, "", arrays))
    write_bytes(save(arrays, {CONTENT: content}), path)


def read_values(path: Path, what: str) -> Any:
    """What `write_values` wrote, tensors as tensors.

    Raises InputError if the file is missing, cut short or another.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, "numpy") as file:
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - it is no mapping
            return _unpacked(json.loads(file.metadata()[CONTENT]), arrays)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such {what}") from None
    except (SafetensorError, OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not a {what}, or one that is cut short ({error})") from None


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
        pairs = [
            [key, _packed(one, f"{name}.{key}" if name else str(key), arrays)] for key, one in value.items()
        ]
        return {"dict": pairs}
    if isinstance(value, list | tuple):
        items = [_packed(one, f"{name}.{i}", arrays) for i, one in enumerate(value)]
        return {"tuple" if isinstance(value, tuple) else "list": items}
    if hasattr(value, "detach"):
        arrays[name] = np.array(value.detach().cpu().numpy(), order="C")
        return {"tensor": name}
    raise TypeError(f"{name}: {type(value).__name__} cannot be written")


def _unpacked(content: Any, arrays: Arrays) -> Any:
    """The value that `_packed` made this of."""
    if not isinstance(content, dict):
        return content
    ((kind, inner),) = content.items()
    if kind == "array":
        return arrays[inner]
    if kind == "tensor":
        import torch

        return torch.from_numpy(arrays[inner].copy())
    if kind == "dict":
        return {key: _unpacked(one, arrays) for key, one in inner}
    items = [_unpacked(one, arrays) for one in inner]
    return tuple(items) if kind == "tuple" else items
