"""Many independent jobs: in this process, in several, or on a Ray cluster.

Results do not depend, bit for bit, on where jobs run or how many run at once: each job
has one thread, and jobs and results pass through JSON in every case.
"""

import json
import os
import signal
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import chdir, closing, contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from joblib import Parallel, cpu_count, delayed, parallel_config
from joblib.externals.loky import get_reusable_executor
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from agents.controllers.registry import registered_modules
from agents.job_results import JobFunction, KeptResults, result_to_json
from identification.progress import PROGRESS
from shipgym.checks import check_choice, check_whole
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.python_files import working_folder

#: A job and its result as JSON, in the order in which jobs finish.
Finished = Iterator[tuple[str, str]]


class JobError(RuntimeError):
    """A job failed, not by wrong input, or its worker was killed."""


@dataclass(frozen=True)
class JobEngine:
    """Settings of where jobs run and where results are kept.

    Raises InputError, naming the field, for a wrong one. A cluster is contacted only
    when it is needed.

    Attributes
    ----------
    engine : {"local", "ray"}
        Processes of this computer, or Ray (`pip install 'shipgym[ray]'`).
    workers : int or None
        Jobs at a time; None for as many as there are cores. One local worker is this
        process itself.
    address : str, optional
        Address of a Ray cluster, such as ``"10.0.0.1:6379"``,
        ``"ray://10.0.0.1:10001"`` or ``"auto"``; by default Ray is started on this
        computer. shipgym must be installed on the computers of the cluster.
    keep : str or Path, optional
        Folder in which each result is kept as soon as it is available. A job whose
        result is there already does not run again.
    """

    engine: str = "local"
    workers: int | None = 1
    address: str | None = None
    keep: str | Path | None = None

    def __post_init__(self) -> None:
        check_choice(self.engine, ("local", "ray"), "engine")
        if self.workers is not None:
            hint = "or None for as many as there are cores"
            check_whole(self.workers, "workers", at_least=1, hint=hint)
        if self.address is not None and self.engine != "ray":
            raise InputError(
                f"address: expected none with engine '{self.engine}', got"
                f" '{self.address}'; it is for engine 'ray'"
            )


#: One job after the other, in this process.
HERE = JobEngine()


def run_jobs(
    function: JobFunction,
    jobs: Sequence[Mapping[str, Any]],
    where: JobEngine = HERE,
) -> list[Any]:
    """Run independent jobs and return their results in the order of the jobs.

    Raises InputError for wrong arguments, a cluster that does not answer, or wrong
    input that a job reports. Raises JobError, with the beginning of the job, if a job
    raises anything else, or if a worker is killed.

    Parameters
    ----------
    function : callable
        Function at the top level of a module. It takes a job and returns what JSON
        holds. Tuples and arrays become lists.
    jobs : sequence of dict
        What JSON holds. Equal jobs run once.
    where : JobEngine
        Where the jobs run; by default one after the other, in this process.
    """
    texts = [json.dumps(job, allow_nan=False) for job in jobs]
    kept = None if where.keep is None else KeptResults(where.keep, function)
    results = {}
    for text in texts:
        result = None if kept is None else kept.load(text)
        if result is not None:
            results[text] = result
    pending = [text for text in dict.fromkeys(texts) if text not in results]

    def report() -> None:
        n_done = sum(text in results for text in texts)
        tell("jobs done", n_done, len(texts))

    tell = PROGRESS.get()
    report()
    for text, result in _finished(function, pending, where):
        results[text] = result
        if kept is not None:
            kept.save(text, result)
        report()
    return [json.loads(results[text]) for text in texts]


def _finished(function: JobFunction, texts: list[str], where: JobEngine) -> Finished:
    if not texts:
        return iter(())
    if where.engine == "ray":
        return _on_ray(function, texts, where)
    workers = where.workers or cpu_count()
    if workers == 1:
        return (_do_job(function, text) for text in texts)
    return _in_processes(function, texts, workers)


def _do_job(function: JobFunction, text: str) -> tuple[str, str]:
    """Do a job on one thread; errors become some that have the job in their message."""
    variables = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    one_thread = dict.fromkeys(variables, "1")  # for libraries loaded by the job
    name = f"job {text[:200]}"
    try:
        with _environment(one_thread), threadpool_limits(1):
            result = function(json.loads(text))
            return text, result_to_json(result)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    except Exception as error:
        raise JobError(f"{name}: {type(error).__name__}: {error}") from error


def _do_in_worker(
    function: JobFunction, modules: Sequence[str], folder: Path, text: str
) -> tuple[str, str]:
    """Do a job in another process, in a folder, after importing users' controllers."""
    if folder.is_dir():  # another computer may lack it
        os.chdir(folder)
    with working_folder():
        for module in modules:
            import_module(module)
    return _do_job(function, text)


def _calls(function: JobFunction, texts: Sequence[str]) -> Iterator[Any]:
    call = delayed(_do_in_worker)
    modules, folder = registered_modules(), Path.cwd()
    return (call(function, modules, folder, text) for text in texts)


def _killed_worker() -> JobError:
    return JobError(
        "a worker process was killed, perhaps because memory ran out; try fewer"
        " workers, and run again to resume if results are kept"
    )


def _in_processes(function: JobFunction, texts: list[str], workers: int) -> Finished:
    """Do jobs in processes of joblib's loky backend, which end with the last job."""
    run = Parallel(
        workers,
        backend="loky",
        return_as="generator_unordered",
        batch_size=1,
        pre_dispatch=workers,
    )
    try:
        with _environment({"PYTHONSAFEPATH": "1"}), _deaf():
            results = run(_calls(function, texts))
        with warnings.catch_warnings(), closing(results) as finished:
            warnings.filterwarnings("ignore", ".*tasks which were still being")
            # loky renews a worker whose memory has grown; raised in its thread, the
            # warning would stop that thread, and the results would never come
            warnings.filterwarnings("ignore", "A worker stopped while some jobs")
            yield from finished
    except BrokenProcessPool:
        raise _killed_worker() from None
    finally:
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


@contextmanager
def _deaf() -> Iterator[None]:
    """Start processes that do not hear of Ctrl-C: this one ends them."""
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _on_ray(function: JobFunction, texts: list[str], where: JobEngine) -> Finished:
    """Do jobs by joblib's Ray backend, in rounds, each of which returns as a whole."""
    with (
        _environment({"PYTHONSAFEPATH": "1"}),
        _connected_ray(where) as ray,
        parallel_config("ray"),
    ):
        cores = int(ray.cluster_resources().get("CPU", 1))
        workers = min(where.workers or cores, cores)
        jobs_a_round = 2 * workers
        with Parallel(workers, batch_size=1) as run:
            for first in range(0, len(texts), jobs_a_round):
                calls = _calls(function, texts[first : first + jobs_a_round])
                try:
                    yield from run(calls)
                except ray.exceptions.RayError:
                    raise _killed_worker() from None


@contextmanager
def _connected_ray(where: JobEngine) -> Iterator[Any]:
    """Ray, connected, as a backend of joblib; what is started here ends here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ray = library("ray", "ray", "engine 'ray' needs it")
        import_module("ray.util.joblib").register_ray()
    if ray.is_initialized():
        yield ray
        return

    options: dict[str, Any] = {"log_to_driver": False, "configure_logging": False}
    options["address"] = where.address or "local"
    if where.address is None:
        options |= {"num_cpus": where.workers, "include_dashboard": False}
    paths = os.pathsep.join(filter(None, sys.path))
    root = Path.cwd().anchor  # Ray lets its workers import from the working folder
    try:
        with _environment({"PYTHONPATH": paths}), chdir(root):
            ray.init(**options)
    except Exception as error:
        raise InputError(f"engine: 'ray' does not start: {error}") from None
    try:
        yield ray
    finally:
        ray.shutdown()


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables while the block lasts."""
    before = {name: os.environ[name] for name in values if name in os.environ}
    os.environ.update(values)
    try:
        yield
    finally:
        for name in values:
            os.environ.pop(name, None)
        os.environ.update(before)
