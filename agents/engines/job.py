"""One job: a function of a dict that JSON can hold, done on one thread wherever that is."""

import json
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from agents.engines.serialisation import pack, shortened
from shipgym.errors import InputError

Job = Mapping[str, Any]
#: Does one job; at the top level of a module, so that workers find it.
JobFunction = Callable[[dict[str, Any]], Any]
#: A job as text, and its packed result or what went wrong.
Outcome = tuple[str, dict[str, Any]]

#: Workers share the cores among them, and sums do not depend on how many there are.
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}


class JobError(RuntimeError):
    """A job that failed for another reason than wrong input."""


class WorkerDiedError(JobError):
    """A job whose worker died again and again."""


def do_job(function: JobFunction, text: str) -> Outcome:
    """Do one job on one thread; exceptions come back as text, since some cannot be pickled."""
    try:
        with environment(**ONE_THREAD), threadpool_limits(limits=1):
            return text, {"value": pack(function(json.loads(text)))}
    except InputError as error:
        return text, {"wrong": str(error)}
    except Exception as error:
        return text, {
            "failed": f"{type(error).__name__}: {error}",
            "traceback": traceback.format_exc(),
        }


def check_outcome(outcome: dict[str, Any], job: str) -> dict[str, Any]:
    """Return the outcome of a job that was done; InputError or JobError, naming the job, if it was not."""
    if "wrong" in outcome:
        raise InputError(f"{job}: {outcome['wrong']}")
    if "failed" in outcome:
        error = JobError(f"{job}: {outcome['failed']}")
        error.add_note(outcome["traceback"])
        raise error
    return outcome


def died_too_often(text: str, retries: int) -> WorkerDiedError:
    """The error of a job whose worker dies whenever it is done."""
    return WorkerDiedError(
        f"job {shortened(text)}: its worker died {retries + 1} times. It was killed,"
        " perhaps for want of memory (try fewer workers), or the job crashes"
    )


def with_modules(
    function: JobFunction, modules: Sequence[str], job: dict[str, Any]
) -> Any:
    """Do a job after importing modules, which another process has not imported."""
    with working_folder():
        for module in modules:
            import_module(module)
    return function(job)


@contextmanager
def working_folder() -> Iterator[None]:
    """Modules of the working folder can be imported, which a user has named; then the path is as before."""
    before = list(sys.path)
    sys.path.insert(0, str(Path.cwd()))
    try:
        yield
    finally:
        sys.path[:] = before


@contextmanager
def environment(**values: str) -> Iterator[None]:
    """Environment variables for what is loaded or started now; afterwards they are as before."""
    before = {name: os.environ[name] for name in values if name in os.environ}
    os.environ.update(values)
    try:
        yield
    finally:
        for name in values:
            os.environ.pop(name, None)
        os.environ.update(before)
