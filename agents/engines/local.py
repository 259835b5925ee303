"""Jobs in processes of this computer, by joblib's loky backend."""

import os
import threading
import time
import warnings
from collections import Counter, deque
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from functools import cache

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky import get_reusable_executor

from agents.engines.job import JobFunction, Outcome, died_too_often, do_job


def in_processes(
    function: JobFunction, texts: list[str], workers: int, retries: int
) -> Iterator[Outcome]:
    """Do jobs in processes, which end with the last of them.

    When a worker dies, the jobs that were being done are done again; the last time each
    alone, so that the error names the job at fault. Raises WorkerDiedError if a job's
    worker dies more often than `retries`.
    """
    waiting, alone, died = deque(texts), deque[str](), Counter[str]()
    try:
        while waiting or alone:
            doing: set[str] = set()
            try:
                yield from _until_broken(
                    function, waiting or deque([alone.popleft()]), doing, workers
                )
            except BrokenProcessPool:
                for text in doing:
                    if died[text] == retries:
                        raise died_too_often(text, retries) from None
                    died[text] += 1
                    (alone if died[text] == retries else waiting).append(text)
    finally:
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


def _until_broken(
    function: JobFunction, waiting: deque[str], doing: set[str], workers: int
) -> Iterator[Outcome]:
    """Outcomes as they come; `doing` has the jobs that are with the workers."""

    def handed_out() -> Iterator[object]:
        while waiting:
            text = waiting.popleft()
            doing.add(text)
            yield delayed(_do_in_worker)(function, text)

    at_once = max(
        workers, 2
    )  # one would be this process, which a job must not take with it
    with warnings.catch_warnings(), parallel_config("loky", inner_max_num_threads=1):
        warnings.filterwarnings("ignore", ".*tasks which were still being processed")
        run = Parallel(
            at_once, return_as="generator_unordered", batch_size=1, pre_dispatch=at_once
        )
        with closing(run(handed_out())) as outcomes:
            for text, outcome in outcomes:
                doing.remove(text)
                yield text, outcome


def _do_in_worker(function: JobFunction, text: str) -> Outcome:
    _end_with_parent()
    return do_job(function, text)


@cache
def _end_with_parent() -> None:
    """Let this process end when the one that started it does, even if that is killed during a long job."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
