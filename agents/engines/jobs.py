"""Many independent jobs: in this process, in several of this machine, or on a ray cluster.

The results do not depend on where the jobs ran, nor on how many ran at once, bit for bit.
"""

from __future__ import annotations

import json
import os
import signal
import threading
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from agents.engines.job_text import KeptResults, job_text, pack, shortened, unpack
from shipgym.checks import check_choice, check_whole
from shipgym.errors import InputError

#: Does one job; of the top level of a module, so that workers find it.
Job = Mapping[str, Any]
JobFunction = Callable[[dict[str, Any]], Any]
#: Told the number of jobs done and their total.
JobProgress = Callable[[int, int], None]
#: Told a job and its packed result as soon as it is there.
Done = Callable[[str, dict[str, Any]], None]

ENGINES = ("local", "ray")
#: One thread a worker: workers share the cores among them, and sums do not depend on how many there are.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class JobError(RuntimeError):
    """A job that failed for another reason than wrong input."""


class WorkerDiedError(JobError):
    """A job whose worker died again and again."""


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
    """Do many independent jobs and return their results in the order of the jobs.

    Parameters
    ----------
    function : callable
        Given a job, returns its result: numbers, texts, arrays, and lists and dicts of them. It is to
        depend on nothing but the job, and to be of the top level of a module.
    jobs : sequence of dict
        What JSON can hold. Equal jobs are done once.
    engine : {"local", "ray"}
        Processes of this machine, or ray (`pip install 'shipgym[ray]'`).
    workers : int or None
        Jobs done at once; None for as many as there are cores. One local worker is this process itself.
    address : str, optional
        Of a ray cluster, such as ``"10.0.0.1:6379"``, ``"ray://10.0.0.1:10001"`` or ``"auto"``; by default
        ray is started on this machine. shipgym must be installed on the machines of the cluster.
    keep : str or Path, optional
        Folder in which each result is kept as soon as it is there; such jobs are not done again.
    retries : int
        How often a job is done again whose worker died, the last time alone, so that it is the one at fault.
    progress : callable, optional
        Told the number of jobs done and their total.

    Returns
    -------
    list
        One result each. Tuples have become lists.

    Raises
    ------
    InputError
        For wrong arguments; for a cluster that does not answer within 10 s; or, naming the job, if it
        says that its input is wrong.
    JobError
        Naming the job, if it raises anything else.
    WorkerDiedError
        Naming the job, if its worker dies more often than `retries`.
    """
    check_engine(engine, workers, address)
    check_whole(retries, "retries", at_least=0)
    _check_function(function)
    texts = [job_text(job, f"jobs[{k}]") for k, job in enumerate(jobs)]
    kept = None if keep is None else KeptResults(keep, function)
    copies = Counter(texts)
    found: dict[str, dict[str, Any]] = {}
    if kept is not None:
        found = {text: packed for text in copies if (packed := kept.load(text)) is not None}

    def tell() -> None:
        if progress is not None:
            progress(sum(copies[text] for text in found), len(texts))

    def done(text: str, outcome: dict[str, Any]) -> None:
        found[text] = _result(outcome, text, texts.index(text))
        if kept is not None:
            kept.save(text, found[text])
        tell()

    tell()
    pending = [text for text in copies if text not in found]
    if pending and engine == "ray":
        from agents.engines.ray_engine import on_ray

        on_ray(function, pending, workers, address, retries, done)
    elif pending and workers == 1:
        for text in pending:
            done(text, do_job(function, text))
    elif pending:
        _in_processes(function, pending, workers or available_cores(), retries, done)
    return [unpack(found[text]["value"]) for text in texts]


def available_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def do_job(function: JobFunction, text: str) -> dict[str, Any]:
    """Do one job on one thread, wherever this is called; what goes wrong comes back as text.

    Exceptions are not passed between processes as they are: some cannot be.
    """
    try:
        with environment(**ONE_THREAD), threadpool_limits(limits=1):
            return {"value": pack(function(json.loads(text)))}
    except InputError as error:
        return {"wrong": str(error)}
    except Exception as error:
        return {"failed": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}


def died_too_often(text: str, retries: int) -> WorkerDiedError:
    """The error of a job whose worker dies whenever it is done."""
    return WorkerDiedError(
        f"job {shortened(text)}: its worker died {retries + 1} times. It was killed, perhaps for want of "
        f"memory (try fewer workers), or the job crashes; a script that starts workers needs "
        f"`if __name__ == '__main__':`"
    )


def check_engine(engine: str, workers: int | None, address: str | None) -> None:
    """Refuse wrong arguments of `run_jobs`; whether a cluster answers is asked when it is needed.

    Raises
    ------
    InputError
        Naming the argument.
    """
    check_choice(engine, ENGINES, "engine")
    if workers is not None:
        check_whole(workers, "workers", at_least=1, hint="or none for as many as there are cores")
    if address is not None and engine != "ray":
        raise InputError(f"address: '{address}' found with engine '{engine}'; it is for engine 'ray'")


def _check_function(function: JobFunction) -> None:
    name = getattr(function, "__qualname__", None)
    if name is None or "<" in name:
        raise InputError(
            f"function: {function!r} found, expected a function of the top level of a module, so that "
            f"workers find it"
        )


def _result(outcome: dict[str, Any], text: str, number: int) -> dict[str, Any]:
    if "wrong" in outcome:
        raise InputError(f"job {number} {shortened(text)}: {outcome['wrong']}")
    if "failed" in outcome:
        error = JobError(f"job {number} {shortened(text)}: {outcome['failed']}")
        error.add_note(outcome["traceback"])
        raise error
    return outcome


def _in_processes(function: JobFunction, texts: list[str], workers: int, retries: int, done: Done) -> None:
    """Do jobs in processes of their own; when one dies, start anew with what is left."""
    waiting = deque(texts)
    died: Counter[str] = Counter()
    while waiting:
        with _pool(min(workers, len(waiting))) as pool:
            lost = _until_broken(
                pool, function, waiting, workers, lambda text: 0 < died[text] == retries, done
            )
        for text in lost:
            if died[text] == retries:
                raise died_too_often(text, retries)
            died[text] += 1
        waiting.extendleft(reversed(lost))


def _until_broken(
    pool: ProcessPoolExecutor,
    function: JobFunction,
    waiting: deque[str],
    workers: int,
    alone: Callable[[str], bool],
    done: Done,
) -> list[str]:
    """Do jobs until all are done or a worker died; return those that were being done then."""
    doing: dict[Future[dict[str, Any]], str] = {}

    def may_begin() -> bool:
        if not waiting or len(doing) == workers:
            return False
        return not doing or not any(alone(text) for text in (waiting[0], *doing.values()))

    while waiting or doing:
        while may_begin():
            try:
                with environment(
                    **ONE_THREAD, NUMBA_NUM_THREADS="1"
                ):  # a worker is started now, if none is idle
                    doing[pool.submit(do_job, function, waiting[0])] = waiting[0]
            except BrokenProcessPool:
                break
            waiting.popleft()
        finished = wait(doing, return_when=FIRST_COMPLETED).done
        if any(isinstance(future.exception(), BrokenProcessPool) for future in finished):
            finished = wait(doing).done
        lost = []
        for future in finished:
            text = doing.pop(future)
            try:
                done(text, future.result())
            except BrokenProcessPool:
                lost.append(text)
        if lost or not (doing or finished):
            return lost
    return []


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that end when they are no longer needed, at once where something went wrong."""
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _begin_worker)
    try:
        yield pool
    except BaseException:
        for process in list((pool._processes or {}).values()):
            process.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def environment(**values: str) -> Iterator[None]:
    """Environment variables for what is loaded or started now; afterwards they are as before."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin_worker() -> None:
    """A worker leaves interrupts to the process that started it, and ends with it, even if that is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
