"""The two files of a policy, NAME.json and NAME.safetensors: written whole, and the weights read back.

The weights are written first, and the JSON holds their SHA-256, so that files that do
not belong together are refused. No pickle, no torch.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shipgym import InputError, ShipModel, Weather
from shipgym.files import LARGEST_TENSORS, read_bytes, write_bytes, write_json

Tensors = dict[str, NDArray[Any]]

REMEDY = "take another copy of both files"


def write_policy(content: Mapping[str, Any], tensors: Tensors, path: Path) -> None:
    """Write NAME.json and, first, NAME.safetensors.

    `content`: what stands in the JSON; `tensors`: the weights; none where a policy has
    none; `path`: NAME.json. Raises InputError if the name does not end in .json, the
    folder cannot be written, or JSON cannot hold the content.
    """
    if path.suffix != ".json":
        raise InputError(
            f"{path}: a policy's file ends in .json, with the weights beside it in"
            " .safetensors"
        )
    try:
        json.dumps(content, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path}: training and env_options: {error}; expected what JSON can hold"
        ) from None
    weights = None
    if tensors:
        from safetensors.numpy import save as as_bytes

        written: bytes = as_bytes(tensors)
        write_bytes(written, weights_path(path))
        weights = {"sha256": hashlib.sha256(written).hexdigest()}
    write_json({**content, "weights": weights}, path)


def weights_path(path: Path) -> Path:
    """Where the weights of NAME.json are."""
    return path.with_suffix(".safetensors")


def read_weights(path: Path, sha256: str, json_path: Path) -> Tensors:
    """Weights at `path`, of the hash in `json_path`; InputError if missing, broken or of another policy."""
    content = read_bytes(path, f"file with the weights of {json_path}", LARGEST_TENSORS)
    found = hashlib.sha256(content).hexdigest()
    if found != sha256:
        raise InputError(
            f"{path}: SHA-256 {found[:12]}... found in {len(content)} bytes, expected"
            f" {sha256[:12]}..., which is the field weights.sha256 of {json_path}: cut"
            f" short, or of another policy; {REMEDY}"
        )
    from safetensors.numpy import load

    try:
        tensors: Tensors = load(content)
    except (
        Exception
    ) as error:  # safetensors' own errors and those of the types it does not know
        raise InputError(
            f"{path}: not a safetensors file ({error}); {REMEDY}"
        ) from None
    return tensors


def as_json(value: Any) -> Any:
    """An option of an environment as JSON has it; models by their names."""
    if isinstance(value, ShipModel):
        return value.name
    if isinstance(value, Weather):
        return value.to_dict()
    if is_dataclass(value) and not isinstance(value, type):
        return as_json(asdict(value))
    if isinstance(value, Mapping):
        return {str(name): as_json(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return as_json(value.tolist())
    if isinstance(value, list | tuple):
        return [as_json(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None if np.isnan(value) else str(value)
    return str(value) if isinstance(value, Path) else value
