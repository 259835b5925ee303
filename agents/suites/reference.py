"""What is kept with a suite: the best known costs, and settings found for its classical controllers.

Files of `agents/suites`:

    SUITE-best.json     by task: `zero`, mean cost of wheel-over designed on the model;
    of each scored
                        episode the lowest cost that anything reached, `costs`, and by
                        what, `by` (`scripts/best_known.py`)
    SUITE-tuned.json    tasks: by task and controller `settings`, `cost`, `start_cost`,
    `evaluations`
                        (`scripts/tune_controllers.py`)
"""

from typing import Any

import numpy as np

from agents.suites.suite import N_EPISODES, BenchmarkTask, suite_file
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import ANY_KEY, Shape, check_shape, check_table
from shipgym.files import read_json

BEST: Shape = {ANY_KEY: {"zero": (int, float), "costs": [(int, float)], "by": [(str,)]}}


def best_known(suite: str) -> dict[str, dict[str, Any]]:
    """The best known costs by task, as in the file; empty where the suite has no such file.

    Raises InputError naming the field of the file at fault.
    """
    path = suite_file(suite, "best")
    if not path.exists():
        return {}
    found = read_json(path, "file of best known costs", "take another copy")
    check_shape(found, BEST, str(path))
    for task, one in found.items():
        if not len(one["costs"]) == len(one["by"]) == N_EPISODES:
            raise InputError(
                f"{path}: {task}: expected costs of {N_EPISODES} episodes, and by what"
            )
    return dict(found)


def reference_costs(suite: str) -> dict[str, tuple[float, float]]:
    """Mean costs with scores 0 and 1, by task: wheel-over designed on the model, and the best known."""
    known = best_known(suite)
    return {
        task: (float(one["zero"]), float(np.mean(one["costs"])))
        for task, one in known.items()
    }


def best_costs(task: BenchmarkTask, suite: str) -> Floats:
    """The best known cost of each scored episode, shape (100,); an InputError if there is none."""
    known = best_known(suite)
    if task.name not in known:
        raise InputError(
            f"no best known costs are kept for task '{task.name}' of suite '{suite}'"
        )
    return np.array(known[task.name]["costs"], dtype=np.float64)


def load_tuned(suite: str) -> dict[str, dict[str, dict[str, Any]]]:
    """Settings of the classical controllers found for each task by direct search, by task and controller.

    Raises InputError if the suite has none, or the file is broken.
    """
    path = suite_file(suite, "tuned")
    content = read_json(
        path, "file of tuned settings", "make it again with scripts/tune_controllers.py"
    )
    tasks = check_table(content.get("tasks"), f"{path}: tasks")
    return {
        name: dict(check_table(found, f"{path}: tasks.{name}"))
        for name, found in tasks.items()
    }
