"""Jobs and their results as JSON, in which form they are also kept in files."""

import hashlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

import shipgym
from shipgym.errors import InputError
from shipgym.files import make_folder, read_json, write_json

JobFunction = Callable[[dict[str, Any]], Any]


def job_to_json(job: Any, where: str) -> str:
    """A job as JSON text; InputError for anything but a dict of what JSON holds."""
    try:
        text = json.dumps(job, allow_nan=False)
    except (TypeError, ValueError) as error:
        text = str(error)
    if not text.startswith("{"):
        raise InputError(
            f"{where}: expected a dict of finite numbers, strings, lists and dicts, got"
            f" {job!r} ({text})"
        )
    return text


def result_to_json(result: Any) -> str:
    """A result as JSON text; TypeError if it is neither JSON nor an array of it."""

    def encode(item: Any) -> Any:
        if isinstance(item, np.generic):
            return item.item()
        if isinstance(item, np.ndarray) and item.dtype.kind in "biufU":
            is_text = item.dtype.kind == "U"
            dtype = "str" if is_text else item.dtype.name
            return {"__array__": item.tolist(), "dtype": dtype}
        raise TypeError(
            "result: expected numbers, strings, lists, dicts and arrays of numbers or"
            f" strings, got {type(item).__name__}"
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
        results = {}
        for job in jobs:
            result = self.load(job)
            if result is not None:
                results[job] = result
        return results

    def load(self, job: str) -> str | None:
        """Result of a job, None if there is none or its file is broken."""
        key, path = self._key(job)
        try:
            content = read_json(path, "result", "it is computed again")
            result = str(content["result"])
            result_from_json(result)
        except Exception:  # there are many ways to be broken
            return None
        return result if content.get("key") == key else None

    def save(self, job: str, result: str) -> None:
        """Write the result of a job, whole or not at all."""
        key, path = self._key(job)
        make_folder(self.folder)
        write_json({"key": key, "result": result}, path)

    def _key(self, job: str) -> tuple[dict[str, Any], Path]:
        """Key of a result, and its file."""
        key = {
            "shipgym": shipgym.__version__,
            "function": self.function,
            "job": json.loads(job),
        }
        text = json.dumps(key, sort_keys=True)
        digest = hashlib.sha256(text.encode())
        name = digest.hexdigest()[:24]
        return key, self.folder / f"{name}.json"
