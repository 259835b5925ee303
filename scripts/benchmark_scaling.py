"""Growth of work and its sharing out: draws, episodes and ships, one and two workers.

    python scripts/benchmark_scaling.py [monte-carlo] [environments] [benchmark] [tasks]

Times are of the processor, of this process and of its workers: what others do on the
machine lengthens the clock's time but not these. `idle` is what the clock would at best
show on a machine with a free core for each worker: the time of this process and that of
one worker.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

if __name__ == "__main__":
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")

import numpy as np

WORKERS = (1, 2)


def used() -> tuple[float, float, float]:
    """Processor time of this process and its ended workers, and the clock's, s."""
    own, others = (
        resource.getrusage(resource.RUSAGE_SELF),
        resource.getrusage(resource.RUSAGE_CHILDREN),
    )
    return (
        own.ru_utime + own.ru_stime,
        others.ru_utime + others.ru_stime,
        time.perf_counter(),
    )


def row(label: str, workers: int, work: Callable[[], Any]) -> float:
    """Print what some work took; return what the clock would at best show."""
    before = used()
    work()
    own, others, clock = (
        after - start for after, start in zip(used(), before, strict=True)
    )
    idle = own + others / workers
    print(
        f"| {label} | {workers} | {own:.2f} | {others:.2f} | {idle:.2f} |"
        f" {clock:.1f} |",
        flush=True,
    )
    return idle


def head(title: str) -> None:
    """Begin a table."""
    print(
        f"\n{title}\n\n| work | workers | this process, s | workers, s | idle, s |"
        " clock, s |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: |", flush=True)


def monte_carlo_table() -> None:
    """Work per model drawn: manoeuvres, course stability, an episode of PID and LQ."""
    from agents import LQ, PID
    from agents.jobs import JobEngine
    from agents.verification.monte_carlo import monte_carlo
    from shipgym import load_model

    ship = load_model("mariner-tls-svm")
    pilots = [PID.from_model(ship), LQ.from_model(ship)]
    monte_carlo(pilots, ship, 25)  # compiles
    head("Monte Carlo over the estimated covariance")
    for draws in (100, 400, 1600):
        for workers in WORKERS:
            where = JobEngine(workers=workers)
            row(
                f"{draws} draws",
                workers,
                lambda d=draws, w=where: monte_carlo(pilots, ship, d, where=w),
            )


def environments_table() -> None:
    """Steps of the vector environment, by ships and threads."""
    from agents.suites.suite import load_suite

    task = load_suite().tasks[0]
    print(f"\nSteps of the environment, task {task.name}\n")
    print(
        "| ships | threads | steps each | million steps/s of processor | million"
        " steps/s by the clock, best |"
    )
    print("| ---: | ---: | ---: | ---: | ---: |")
    for ships in (64, 256, 1024, 4096):
        steps = max(20, 200_000 // ships)
        engines = {threads: task.engine(ships, threads=threads) for threads in WORKERS}
        action = np.zeros((ships, 1), dtype=np.float32)
        best = {threads: [np.inf, np.inf] for threads in WORKERS}
        for _ in range(7):  # threads by turns: what others do on the machine meets both
            for threads, engine in engines.items():
                engine.reset(np.arange(ships))
                clock, cpu = time.perf_counter(), time.process_time()
                for _ in range(steps):
                    engine.step(action)
                found = time.process_time() - cpu, time.perf_counter() - clock
                best[threads] = [
                    min(pair) for pair in zip(best[threads], found, strict=True)
                ]
        for threads, (cpu, clock) in best.items():
            rates = [f"{ships * steps / seconds / 1e6:.1f}" for seconds in (cpu, clock)]
            print(
                f"| {ships} | {threads} | {steps} | {rates[0]} | {rates[1]} |",
                flush=True,
            )


def benchmark_table() -> None:
    """PID and LQ through some tasks of the suite, by episodes and workers."""
    from agents.benchmarking.run import benchmark
    from agents.suites.suite import load_suite

    tasks = [task.name for task in load_suite().tasks[:4]]

    def run(episodes: int, workers: int) -> None:
        with tempfile.TemporaryDirectory() as folder:
            benchmark(
                "pid,lq",
                "shipgym-v1",
                tasks,
                f"{folder}/results",
                workers,
                episodes=episodes,
            )

    run(1, 1)  # compiles
    head("shipgym benchmark --controllers pid,lq, four tasks")
    for episodes in (10, 100):
        for workers in WORKERS:
            row(
                f"{episodes} episodes", workers, lambda e=episodes, w=workers: run(e, w)
            )


def tasks_table() -> None:
    """What starting workers costs: jobs that do nothing."""
    from agents.jobs import JobEngine, run_jobs

    head("100 jobs that do nothing")
    for workers in WORKERS:
        row(
            "100 jobs",
            workers,
            lambda w=workers: run_jobs(
                nothing, [{"k": k} for k in range(100)], JobEngine(workers=w)
            ),
        )


def nothing(job: dict[str, Any]) -> int:
    """A job that does nothing."""
    return int(job["k"])


TABLES = {
    "monte-carlo": monte_carlo_table,
    "environments": environments_table,
    "benchmark": benchmark_table,
    "tasks": tasks_table,
}

if __name__ == "__main__":
    for wanted in sys.argv[1:] or TABLES:
        TABLES[wanted]()
