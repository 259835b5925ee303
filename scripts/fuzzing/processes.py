"""Chunks of inputs in several processes; a dead one is replaced and reported."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from fuzzing.reading import SCRATCH, Finding, Kind, Reader, Report, _status

CHUNK = 500  # inputs
STUCK_S = 30.0  # of processor time without a new input: code that no signal reaches
LOST_S = 900.0  # by the clock, on whatever busy machine
LARGEST_MIB = 1500  # resident; a process that has grown so far is replaced
PROCESSES = multiprocessing.get_context("fork")


@dataclass(frozen=True)
class Chunk:
    """Inputs `first` to `last` of a kind, but those at which a process died."""

    kind: str
    first: int
    last: int
    skip: frozenset[int] = frozenset()


@dataclass
class Worker:
    """A process and what it is at."""

    process: Any
    pipe: Connection
    at: Any  # shared: number of the input
    chunk: Chunk | None = None
    #: that number, and since when: by the clock, and by the process's own time
    seen: tuple[int, float, float] = field(default=(-1, 0.0, 0.0))

    def spent(self) -> float:
        """Processor time of the process, s."""
        try:
            numbers = (
                Path(f"/proc/{self.process.pid}/stat")
                .read_text()
                .rpartition(")")[2]
                .split()
            )
        except OSError:
            return 0.0
        return (int(numbers[11]) + int(numbers[12])) / os.sysconf("SC_CLK_TCK")


def chunks(kinds: Iterable[Kind], inputs: int) -> deque[Chunk]:
    """So many inputs of each kind, by turns; of slow ones fewer."""
    found = []
    for kind in kinds:
        count = max(1, inputs // kind.slow)
        size = max(10, CHUNK // kind.slow)
        found += [
            Chunk(kind.name, k, min(k + size, count)) for k in range(0, count, size)
        ]
    return deque(sorted(found, key=lambda chunk: chunk.first))


def run(
    kinds: dict[str, Kind],
    work: deque[Chunk],
    seed: int,
    workers: int,
    until: float,
    tell: Callable[[Report], None],
) -> dict[str, Report]:
    """Read all chunks, or those that there is time for, and report by kind."""
    reports = {name: Report(name) for name in kinds}
    scratch = Path(tempfile.mkdtemp(prefix="fuzz-", dir=SCRATCH))
    running: list[Worker] = []
    try:
        while True:
            while work and time.monotonic() < until and len(running) < workers:
                worker = _start(kinds, scratch, seed)
                running.append(worker)
            _hand_out(work, running, until)
            busy = [worker for worker in running if worker.chunk is not None]
            if not busy:
                return reports

            ready = wait([worker.pipe for worker in busy], timeout=1.0)
            for worker in busy:
                report = _answer(worker, worker.pipe in ready)
                if report is None:
                    continue
                reports[report.kind].add(report)
                tell(report)
                has_failed = worker.chunk is not None
                if has_failed or not worker.process.is_alive():
                    _stop(worker)
                    running.remove(worker)
                if worker.chunk is not None:
                    work.appendleft(worker.chunk)
    finally:
        for worker in running:
            _stop(worker)
        shutil.rmtree(scratch, ignore_errors=True)


def _hand_out(work: deque[Chunk], running: Iterable[Worker], until: float) -> None:
    """Give each idle process a chunk while there are any, and time."""
    for worker in running:
        if not work or time.monotonic() >= until:
            return
        if worker.chunk is None:
            worker.chunk = work.popleft()
            worker.seen = (-1, time.monotonic(), worker.spent())
            with suppress(OSError):  # one that has ended is noticed by its answer
                worker.pipe.send(worker.chunk)


def _start(kinds: dict[str, Kind], scratch: Path, seed: int) -> Worker:
    ours, theirs = PROCESSES.Pipe()
    at = PROCESSES.Value("q", -1, lock=False)
    folder = Path(tempfile.mkdtemp(dir=scratch))
    process = PROCESSES.Process(
        target=_work, args=(kinds, folder, seed, theirs, at), daemon=True
    )
    process.start()
    theirs.close()
    return Worker(process, ours, at)


def _stop(worker: Worker) -> None:
    worker.pipe.close()
    worker.process.kill()
    worker.process.join()


def _answer(worker: Worker, ready: bool) -> Report | None:
    """Report of a worker; a dead or stuck one's chunk stays without that input."""
    chunk = worker.chunk
    assert chunk is not None
    if ready:
        try:
            report: Report = worker.pipe.recv()
        except (EOFError, ConnectionResetError):
            worker.process.join()
            if (
                worker.process.exitcode == 0
            ):  # it had grown too large, and never saw this chunk
                return Report(chunk.kind)
            return _lost(worker, f"process died with {worker.process.exitcode}")
        worker.chunk = None
        return report
    at = worker.at.value
    if at != worker.seen[0]:
        worker.seen = (at, time.monotonic(), worker.spent())
    elif (
        worker.spent() - worker.seen[2] > STUCK_S
        or time.monotonic() - worker.seen[1] > LOST_S
    ):
        return _lost(worker, "stuck where no signal is heard")
    return None


def _lost(worker: Worker, what: str) -> Report:
    chunk, at = worker.chunk, int(worker.at.value)
    assert chunk is not None
    report = Report(chunk.kind, inputs=1)
    report.findings[what] = Finding(chunk.kind, what, "", at, (), {}, "")
    if at < 0:  # a seed of the corpus did it: there is no more to be had of this kind
        worker.chunk = None
        worker.process.kill()
        worker.process.join()
    else:
        worker.chunk = Chunk(chunk.kind, chunk.first, chunk.last, chunk.skip | {at})
    return report


def _work(
    kinds: dict[str, Kind], folder: Path, seed: int, pipe: Connection, at: Any
) -> None:
    """Read chunks until there are no more."""
    readers: dict[str, Reader] = {}

    def tell(index: int) -> None:
        at.value = index

    while True:
        try:
            chunk: Chunk = pipe.recv()
        except EOFError:
            return
        at.value = -1
        if chunk.kind not in readers:
            readers[chunk.kind] = Reader(kinds[chunk.kind], folder, seed)
        pipe.send(readers[chunk.kind].run(chunk.first, chunk.last, chunk.skip, tell))
        if _status("VmRSS") > LARGEST_MIB * 2**20:
            return
