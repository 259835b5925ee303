"""What is kept with a suite: costs that scores refer to, and settings found for its classical controllers.

Files of `agents/suites`, which take hours to make (`scripts/tune_controllers.py`, `scripts/oracle.py`):

    SUITE-reference.json    by task: cost of the best constant-gain PID and of the oracle, `pid` and `oracle`
    SUITE-oracle.json       by task: the oracle's cost of each scored episode, in the order of the seeds
    SUITE-tuned.json        tasks: by task and controller `settings`, `cost`, `start_cost`, `evaluations`
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.suites.suite import N_EPISODES, BenchmarkTask, suite_file
from shipgym.checks import check_number, check_table
from shipgym.errors import InputError
from shipgym.files import read_json

REMEDY = "take another copy"


def reference_costs(suite: str) -> dict[str, tuple[float, float]]:
    """Costs that are scores of 0 and 1, by task: of the best constant-gain PID and of the oracle.

    Empty where the suite has no such file. Raises InputError naming the field of the file at fault.
    """
    path = suite_file(suite, "reference")
    if not path.exists():
        return {}
    found = {}
    for task, value in read_json(path, "file of reference costs", REMEDY).items():
        costs = check_table(value, f"{path}: {task}")
        pid, oracle = (check_number(costs.get(name), f"{path}: {task}.{name}") for name in ("pid", "oracle"))
        found[task] = (pid, oracle)
    return found


def oracle_costs(task: BenchmarkTask, suite: str) -> NDArray[np.float64]:
    """The oracle's cost of each scored episode, shape (100,).

    Raises InputError if there are none for this task, or the file is broken.
    """
    path = suite_file(suite, "oracle")
    costs = read_json(path, "file of the suite", REMEDY).get(task.name) if path.exists() else None
    if costs is None:
        raise InputError(f"no costs of the oracle are kept for task '{task.name}' of suite '{suite}'")
    if not isinstance(costs, list) or len(costs) != N_EPISODES:
        raise InputError(f"{path}: {task.name}: expected a list of {N_EPISODES} costs; {REMEDY}")
    return np.array([check_number(cost, f"{path}: {task.name}[{k}]") for k, cost in enumerate(costs)])


def load_tuned(suite: str) -> dict[str, dict[str, dict[str, Any]]]:
    """Settings of the classical controllers found for each task by direct search.

    Returns them by task and controller, as in the file (format in the module's docstring). Raises InputError
    if the suite has none, or the file is broken.
    """
    path = suite_file(suite, "tuned")
    content = read_json(path, "file of tuned settings", "make it again with scripts/tune_controllers.py")
    tasks = check_table(content.get("tasks"), f"{path}: tasks")
    return {name: dict(check_table(found, f"{path}: tasks.{name}")) for name, found in tasks.items()}
