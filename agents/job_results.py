"""Jobs and their results as JSON, in which form they are also kept in files."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import shipgym
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

JobFunction = Callable[[dict[str, Any]], Any]


def job_to_json(job: Any, where: str) -> str:
    """A job as JSON text; InputError for anything but a dict of what JSON holds."""
    if not isinstance(job, Mapping):
        raise InputError(f"{where}: expected a dict, got {job!r}")
    try:
        return json.dumps(job, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{where}: expected a dict of finite numbers, texts, lists and dicts, got"
            f" {job!r} ({error})"
        ) from None


def job_from_json(text: str) -> dict[str, Any]:
    """The job that `job_to_json` was given."""
    return dict(json.loads(text))


def result_to_json(result: Any) -> str:
    """A result as JSON text; TypeError for what is neither JSON nor an array of it."""

    def encode(item: Any) -> Any:
        if isinstance(item, np.generic):
            return item.item()
        if isinstance(item, np.ndarray) and item.dtype.kind in "biufU":
            dtype = "str" if item.dtype.kind == "U" else item.dtype.name
            return {"__array__": item.tolist(), "dtype": dtype}
        raise TypeError(
            "result: expected numbers, texts, lists, dicts and arrays of numbers or"
            f" texts, got {type(item).__name__}"
        )

    return json.dumps(result, default=encode)


def result_from_json(text: str) -> Any:
    """The result that `result_to_json` was given, the same bit for bit.

    Raises TypeError, ValueError, OverflowError or RecursionError for broken text.
    """

    def decode(table: dict[str, Any]) -> Any:
        if table.keys() != {"__array__", "dtype"}:
            return table
        dtype = table["dtype"]
        if dtype != "str" and np.dtype(dtype).kind not in "biuf":
            raise ValueError(f"array of {dtype}")
        return np.array(table["__array__"], dtype)

    return json.loads(text, object_hook=decode)


class KeptResults:
    """Folder with a file for each finished job, named by a hash of the job.

    Results of another function or another version of shipgym are not taken. The folder
    is made with the first result. Jobs and results are JSON text. Raises InputError if
    `folder` is a file.
    """

    def __init__(self, folder: str | Path, function: JobFunction) -> None:
        self.folder = Path(folder)
        self.function = f"{function.__module__}.{function.__qualname__}"
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(
                f"{folder}: expected a folder for results, got a file; choose another"
            )

    def load_all(self, jobs: Iterable[str]) -> dict[str, str]:
        """Results by job, of those jobs that are finished."""
        results = {job: self.load(job) for job in jobs}
        return {job: result for job, result in results.items() if result is not None}

    def load(self, job: str) -> str | None:
        """Result of a job, None if there is none or its file is broken."""
        try:
            content = read_json(self._path(job), "result", "it is computed again")
            result = content["result"]
            result_from_json(result)
        except (
            InputError,
            LookupError,
            TypeError,
            ValueError,
            OverflowError,
            RecursionError,
        ):
            return None
        is_same = self._key(job).items() <= content.items()
        return str(result) if is_same else None

    def save(self, job: str, result: str) -> None:
        """Write the result of a job, whole or not at all."""
        make_folder(self.folder)
        write_json({**self._key(job), "result": result}, self._path(job))

    def _key(self, job: str) -> dict[str, Any]:
        return {
            "shipgym": shipgym.__version__,
            "function": self.function,
            "job": json.loads(job),
        }

    def _path(self, job: str) -> Path:
        key = json.dumps(self._key(job), sort_keys=True)
        name = hashlib.sha256(key.encode()).hexdigest()[:24]
        return self.folder / f"{name}.json"
