"""Zhu 2018: least-squares support vector regression of simplified ship models, with C by bee colony.

One file per case study: 7.2 Nomoto's forms (`response_models`), 7.3 recursive least squares from LS-SVR's
start (`recursive_start`), 7.4 the container ship (`container_ship`, `steering_forms`, `sample_counts`), 7.5 a
vessel of 4 m (`small_vessel`).
"""

from __future__ import annotations

from collections.abc import Iterator

from papers.row import Paper, Row
from papers.zhu2018 import (
    container_ship,
    recursive_start,
    response_models,
    sample_counts,
    small_vessel,
    steering_forms,
)

CASES = (response_models, recursive_start, container_ship, steering_forms, sample_counts, small_vessel)


def rows() -> Iterator[Row]:
    """All rows, in the order of the thesis."""
    for case in CASES:
        yield from case.rows()


PAPER = Paper(
    "zhu2018",
    "Zhu 2018, Optimized support vector regression algorithm-based modeling of ship dynamics",
    "Nomoto's forms, the Mariner's linear steering, the container ship of Son & Nomoto and a vessel of 4 m, "
    "by least squares, recursive least squares and LS-SVR with C by cross-validation, particle swarm and bee "
    "colony.",
    rows,
)
