"""Parts of every measurement: a table row, the least time, a fresh process."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

#: The identified model whose environments are timed.
MODEL = "mariner-tls-svm"

#: Ship steps of a few milliseconds, often repeated.
SHORT_STEPS, SHORT_REPEATS = 40_960, 200


@dataclass(frozen=True)
class Row:
    """One measurement: ours, the alternative, and how they compare."""

    what: str
    ours: str
    alternative: str
    ratio: float | None
    aim: str


def best_time(
    work: Callable[[], object],
    repeats: int = 5,
    clock: Callable[[], float] = time.process_time,
) -> float:
    """Least processor time of some repeats, s.

    Not the clock on the wall, which counts what else the machine does. The caches are
    shared all the same, so that many short repeats are needed to find a moment without
    other work.
    """
    times = []
    for _ in range(repeats):
        start = clock()
        work()
        times.append(clock() - start)
    return min(times)


def run_python(code: str, *arguments: str, **environment: str) -> list[float]:
    """Numbers that a fresh Python process prints."""
    result = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(word) for word in result.stdout.split()]
