"""Jobs and their results as JSON text: what goes to workers, comes back, and is kept in files.

Every result passes through this text, wherever it was computed and whether it was kept
or not, so that it is the same bit for bit in every case. Arrays keep their type and
shape.
"""

import base64
import hashlib
import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import shipgym
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

ARRAY, FLOAT = "__array__", "__float__"
LONGEST_IN_MESSAGE = 200  # characters
_NUMBERS_OR_TEXTS = re.compile(r"[<>|=][biufcU]\d{1,6}")  # types of arrays


def serialised(job: Any, where: str) -> str:
    """A job as text, keys in the order in which they are; InputError if it is no dict that JSON can hold."""
    if not isinstance(job, Mapping):
        raise InputError(f"{where}: {job!r} found, expected a dict")
    try:
        return json.dumps(job, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{where}: {job!r} found, expected a dict of numbers, texts, lists and"
            f" dicts ({error})"
        ) from None


def shortened(text: str) -> str:
    """A job for a message."""
    return (
        text if len(text) <= LONGEST_IN_MESSAGE else f"{text[:LONGEST_IN_MESSAGE]} ..."
    )


def pack(value: Any) -> Any:
    """A result as JSON holds it: arrays become text, tuples lists, numbers of NumPy numbers.

    Raises TypeError for anything else than numbers, texts, arrays, and lists and dicts
    of them.
    """
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in "biufcU":
            raise TypeError(
                f"array of {value.dtype} found in a result, expected numbers or texts"
            )
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode("ascii")
        return {ARRAY: [value.dtype.str, list(value.shape), data]}
    if isinstance(value, np.generic):
        return pack(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return {FLOAT: repr(value)}
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(
                    f"key {key!r} found in a result, expected texts as keys"
                )
        return {key: pack(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [pack(item) for item in value]
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(
        f"{type(value).__name__} found in a result, expected what JSON holds, and"
        " arrays"
    )


def unpack(value: Any) -> Any:
    """The result that `pack` was given; Lookup-, Type-, Value- or OverflowError if it is broken."""
    if isinstance(value, list):
        return [unpack(item) for item in value]
    if not isinstance(value, dict):
        return value
    if list(value) == [ARRAY]:
        dtype, shape, data = value[ARRAY]
        if not _NUMBERS_OR_TEXTS.fullmatch(dtype):
            raise ValueError(f"array of {dtype}")
        return np.frombuffer(base64.b64decode(data), dtype).reshape(shape).copy()
    if list(value) == [FLOAT]:
        return float(value[FLOAT])
    return {key: unpack(item) for key, item in value.items()}


class KeptResults:
    """A folder with one file for each job that is done, named by a hash of the job.

    `folder`: made with the first result where it does not exist, so that nothing is
    left of a call that does none; `function`: does the jobs: results of another one, or
    of another version of shipgym, are not taken. Raises InputError if there is a file
    of that name.
    """

    def __init__(
        self, folder: str | Path, function: Callable[[dict[str, Any]], Any]
    ) -> None:
        self.folder = Path(folder)
        self.function = f"{function.__module__}.{function.__qualname__}"
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(
                f"{folder}: is not a folder, expected one for results; choose another"
            )

    def load(self, text: str) -> dict[str, Any] | None:
        """The packed result of a job, None where there is none yet or its file is broken."""
        try:
            content = read_json(self._path(text), "result", "it is computed again")
            unpack(content["result"]["value"])
        except (InputError, LookupError, TypeError, ValueError, OverflowError):
            return None
        return (
            dict(content["result"])
            if self._key(text).items() <= content.items()
            else None
        )

    def save(self, text: str, packed: dict[str, Any]) -> None:
        """Keep the packed result of a job, whole or not at all; InputError if it cannot be written."""
        make_folder(self.folder)
        write_json({**self._key(text), "result": packed}, self._path(text))

    def _key(self, text: str) -> dict[str, Any]:
        return {
            "shipgym": shipgym.__version__,
            "function": self.function,
            "job": json.loads(text),
        }

    def _path(self, text: str) -> Path:
        key = json.dumps(self._key(text), sort_keys=True)
        return self.folder / f"{hashlib.sha256(key.encode()).hexdigest()[:24]}.json"
