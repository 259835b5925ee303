"""Many independent jobs: in this process, in several of this computer, or on a ray cluster.

The results do not depend on where the jobs ran, nor on how many ran at once, bit for
bit.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from joblib import cpu_count

from agents.controllers.registry import registered_modules
from agents.engines.job import (
    Job,
    JobError,
    JobFunction,
    Outcome,
    WorkerDiedError,
    check_outcome,
    do_job,
    with_modules,
)
from agents.engines.local import in_processes
from agents.engines.ray_engine import on_ray
from agents.engines.serialisation import KeptResults, serialised, shortened, unpack
from shipgym.checks import check_choice, check_whole
from shipgym.errors import InputError

__all__ = [
    "HERE",
    "JobEngine",
    "JobError",
    "JobProgress",
    "WorkerDiedError",
    "check_engine",
    "run_jobs",
]

#: Called with the number of jobs done and their total.
JobProgress = Callable[[int, int], None]

ENGINES = ("local", "ray")


def run_jobs(
    function: JobFunction,
    jobs: Sequence[Job],
    *,
    engine: str = "local",
    workers: int | None = 1,
    address: str | None = None,
    keep: str | Path | None = None,
    retries: int = 2,
    progress: JobProgress | None = None,
) -> list[Any]:
    """Run many independent jobs and return their results in the order of the jobs.

    Returns a list of one result each. Tuples have become lists. Raises InputError for
    wrong arguments, a cluster that does not answer, or wrong input that a job reports.
    Raises JobError or WorkerDiedError naming the job, if it raises anything else, or
    its worker dies more often than `retries`.

    Parameters
    ----------
    function : callable
        Top-level function of a module: of a job and nothing else, numbers, texts,
        arrays, lists or dicts.
    jobs : sequence of dict
        What JSON can hold. Equal jobs are done once.
    engine : {"local", "ray"}
        Processes of this computer, or ray (`pip install 'shipgym[ray]'`).
    workers : int or None
        Jobs done at once; None for as many as there are cores. One local worker is this
        process itself.
    address : str, optional
        Of a ray cluster, such as ``"10.0.0.1:6379"``, ``"ray://10.0.0.1:10001"`` or
        ``"auto"``; by default ray is started on this computer. shipgym must be
        installed on the computers of the cluster.
    keep : str or Path, optional
        Folder in which each result is kept as soon as it is available; such jobs are
        not run again.
    retries : int
        How often a job is done again whose worker died, the last time alone, so that it
        is the one at fault.
    progress : callable, optional
        Called with the number of jobs done and their total.
    """
    check_engine(engine, workers, address)
    _check_work(function, retries)
    texts = [serialised(job, f"jobs[{k}]") for k, job in enumerate(jobs)]
    kept = None if keep is None else KeptResults(keep, function)
    copies = Counter(texts)
    found = {
        text: packed
        for text in copies
        if kept is not None and (packed := kept.load(text)) is not None
    }
    tell = progress or (lambda done, total: None)
    tell(sum(copies[text] for text in found), len(texts))
    pending = [text for text in copies if text not in found]
    for text, outcome in _outcomes(
        function, pending, engine, workers, address, retries
    ):
        found[text] = check_outcome(
            outcome, f"job {texts.index(text)} {shortened(text)}"
        )
        if kept is not None:
            kept.save(text, outcome)
        tell(sum(copies[text] for text in found), len(texts))
    return [unpack(found[text]["value"]) for text in texts]


def _outcomes(
    function: JobFunction,
    texts: list[str],
    engine: str,
    workers: int | None,
    address: str | None,
    retries: int,
) -> Iterator[Outcome]:
    """Outcomes of the jobs as they come."""
    if not texts:
        return iter(())
    if engine == "local" and workers == 1:
        return (do_job(function, text) for text in texts)
    if modules := registered_modules():
        function = partial(with_modules, function, modules)
    if engine == "ray":
        return on_ray(function, texts, workers, address, retries)
    return in_processes(function, texts, workers or cpu_count(), retries)


def check_engine(engine: str, workers: int | None, address: str | None) -> None:
    """Refuse wrong arguments of `run_jobs`; whether a cluster answers is asked when it is needed.

    Raises InputError naming the argument.
    """
    check_choice(engine, ENGINES, "engine")
    if workers is not None:
        check_whole(
            workers,
            "workers",
            at_least=1,
            hint="or None for as many as there are cores",
        )
    if address is not None and engine != "ray":
        raise InputError(
            f"address: '{address}' found with engine '{engine}'; it is for engine 'ray'"
        )


def _check_work(function: JobFunction, retries: int) -> None:
    check_whole(retries, "retries", at_least=0)
    name = getattr(function, "__qualname__", None)
    if name is None or "<" in name:
        raise InputError(
            f"function: {function!r} found, expected a function at the top level of a"
            " module, so that workers find it"
        )


@dataclass(frozen=True)
class JobEngine:
    """Where jobs are done: arguments of `run_jobs`."""

    engine: str = "local"
    workers: int | None = 1
    address: str | None = None
    keep: str | Path | None = None

    def check(self) -> None:
        """Refuse wrong arguments before the work begins, as `run_jobs` does."""
        check_engine(self.engine, self.workers, self.address)

    def run(
        self, function: JobFunction, jobs: Sequence[Job], progress: JobProgress
    ) -> list[Any]:
        """Do the jobs."""
        return run_jobs(function, jobs, **asdict(self), progress=progress)


#: One job after the other, in this process.
HERE = JobEngine()
