"""Jobs and their results as JSON, in which form they are also kept in files."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import shipgym
from shipgym.files import make_folder, read_json, write_json

JobFunction = Callable[[dict[str, Any]], Any]


def result_to_json(result: Any) -> str:
    """A result as JSON text, arrays as lists."""
    return json.dumps(result, default=lambda item: item.tolist())


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
            json.loads(result)
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
