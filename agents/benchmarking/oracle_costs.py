"""What the oracle's episodes cost: kept with the suite, because finding them takes hours.

`agents/suites/SUITE-oracle.json` holds, by task, the cost of each scored episode in the order of the seeds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.suite import N_EPISODES, BenchmarkTask, suite_file
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.files import read_json

REMEDY = "take another copy"


def oracle_costs(task: BenchmarkTask, suite: str) -> NDArray[np.float64]:
    """The oracle's cost of each scored episode, shape (100,).

    Raises
    ------
    InputError
        If they are not kept for this task, or the file is broken.
    """
    path = suite_file(suite, "oracle")
    costs = read_json(path, "file of the suite", REMEDY).get(task.name) if path.exists() else None
    if costs is None:
        raise InputError(f"no costs of the oracle are kept for task '{task.name}' of suite '{suite}'")
    if not isinstance(costs, list) or len(costs) != N_EPISODES:
        raise InputError(f"{path}: {task.name}: expected a list of {N_EPISODES} costs; {REMEDY}")
    return np.array([check_number(cost, f"{path}: {task.name}[{k}]") for k, cost in enumerate(costs)])
