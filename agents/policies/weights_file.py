"""The two files of a policy, NAME.json and NAME.safetensors.

The weights are written first, and the JSON holds their SHA-256, so that files that do
not belong together are refused. No pickle, no torch.
"""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from shipgym import InputError
from shipgym.files import LARGEST_TENSORS, read_bytes, write_bytes, write_json

Tensors = dict[str, NDArray[Any]]

REMEDY = "take another copy of both files"


def write_policy(content: Mapping[str, Any], tensors: Tensors, path: Path) -> None:
    """Write NAME.json and, first, NAME.safetensors.

    `content`: of the JSON; `tensors`: the weights; `path`: NAME.json. Raises InputError
    if the name does not end in .json, or the folder cannot be written.
    """
    from safetensors.numpy import save

    if path.suffix != ".json":
        raise InputError(
            f"{path}: expected a name that ends in .json; the weights are written"
            " next to it, in .safetensors"
        )
    weights = save(tensors)
    sha256 = hashlib.sha256(weights).hexdigest()
    write_bytes(weights, weights_path(path))
    write_json({**content, "weights": {"sha256": sha256}}, path)


def weights_path(path: Path) -> Path:
    """File with the weights of NAME.json."""
    return path.with_suffix(".safetensors")


def read_weights(path: Path, sha256: str) -> Tensors:
    """Weights by name, of the policy at `path` (NAME.json), whose JSON has their hash.

    Raises InputError if they are missing, broken or those of another policy.
    """
    from safetensors.numpy import load

    file = weights_path(path)
    content = read_bytes(file, f"file with the weights of {path}", LARGEST_TENSORS)
    found = hashlib.sha256(content).hexdigest()
    if found != sha256:
        raise InputError(
            f"{file}: expected SHA-256 {sha256[:12]}..., the field weights.sha256 of"
            f" {path}, got {found[:12]}... of {len(content)} bytes: cut short, or of"
            f" another policy; {REMEDY}"
        )
    try:
        tensors: Tensors = load(content)
    except Exception as error:  # of safetensors, and of types that NumPy does not know
        raise InputError(
            f"{file}: expected a safetensors file, got a broken one ({error}); {REMEDY}"
        ) from None
    return tensors
