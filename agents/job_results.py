"""Jobs and their results as JSON, in which form they are also kept in files."""

import hashlib
import json
from collections.abc import Callable
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
    return json.dumps(result, default=_encoded)


def _encoded(item: Any) -> Any:
    if isinstance(item, np.generic):
        return item.item()
    if isinstance(item, np.ndarray) and item.dtype.kind in "biufU":
        return {"__array__": item.tolist(), "dtype": item.dtype.str}
    raise TypeError(f"result: expected what JSON holds, got {type(item).__name__}")


def result_from_json(text: str) -> Any:
    """The result that `result_to_json` was given, the same bit for bit."""

    def decode(table: dict[str, Any]) -> Any:
        if table.keys() != {"__array__", "dtype"}:
            return table
        return np.array(table["__array__"], table["dtype"])

    return json.loads(text, object_hook=decode)


class KeptResults:
    """Folder with a file for each finished job, named by a hash of the job.

    Results of another function or another version of shipgym are not taken. The folder
    is made with the first result. Jobs and results are JSON text.
    """

    def __init__(self, folder: str | Path, function: JobFunction) -> None:
        self.folder = Path(folder)
        self.function = f"{function.__module__}.{function.__qualname__}"

    def load(self, job: str) -> str | None:
        """Result of a job, None if there is none or its file is broken."""
        try:
            kept = read_json(self.path(job), "result", "it is run again")
            if kept["job"] != job:
                return None
            result: str = kept["result"]
            result_from_json(result)
        except Exception:  # there are many ways to be broken
            return None
        return result

    def save(self, job: str, result: str) -> None:
        """Write the result of a job, whole or not at all."""
        make_folder(self.folder)
        write_json({"job": job, "result": result}, self.path(job))

    def path(self, job: str) -> Path:
        """Return the file of a job."""
        key = "\n".join([shipgym.__version__, self.function, job])
        digest = hashlib.sha256(key.encode()).hexdigest()
        return self.folder / f"{digest[:24]}.json"
