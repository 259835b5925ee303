"""Files kept beside a suite: its best known costs, and settings of its controllers.

    SUITE-best.json     by task: `zero`, mean cost of wheel-over designed on the model;
                        of each scored episode the lowest known cost, `costs`, and what
                        reached it, `by` (scripts/best_known.py)
    SUITE-tuned.json    `tasks`: by task and controller `settings`, `cost`,
                        `start_cost`, `evaluations` (scripts/tune_controllers.py)

`suite` is a `Suite.source` in all of these functions.
"""

from typing import Any

import numpy as np

from agents.suites.benchmark_task import N_EPISODES, BenchmarkTask
from agents.suites.suite import suite_file
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import ANY_KEY, Shape, check_shape, check_table
from shipgym.files import read_json

#: Costs whose scores are 0 and 1.
ScoreScale = tuple[float, float]
BEST: Shape = {ANY_KEY: {"zero": (int, float), "costs": [(int, float)], "by": [(str,)]}}


def best_known(suite: str) -> dict[str, dict[str, Any]]:
    """Return the best known costs by task, as in the file; empty if there is none.

    Raises InputError naming the field of the file at fault.
    """
    path = suite_file(suite, "best")
    if not path.exists():
        return {}
    content = read_json(path, "file of best known costs", "take another copy")
    check_shape(content, BEST, str(path))
    for task, known in content.items():
        n_costs = len(known["costs"])
        n_by = len(known["by"])
        if n_costs != N_EPISODES or n_by != N_EPISODES:
            raise InputError(
                f"{path}: {task}: expected costs of {N_EPISODES} episodes and what"
                f" reached them, got {n_costs} and {n_by}"
            )
    return dict(content)


def reference_costs(suite: str) -> dict[str, ScoreScale]:
    """Return the mean costs whose scores are 0 and 1, by task.

    The first is that of wheel-over designed on the model, the second the best known.
    """
    scales = {}
    for task, known in best_known(suite).items():
        zero = float(known["zero"])
        costs = known["costs"]
        best = float(np.mean(costs))
        scales[task] = (zero, best)
    return scales


def best_costs(task: BenchmarkTask) -> Floats:
    """Return the best known cost of each scored episode of a task, shape (100,).

    Raises InputError if none are kept.
    """
    known = best_known(task.suite)
    if task.name not in known:
        raise InputError(f"no best known costs are kept for task '{task.name}'")
    return np.array(known[task.name]["costs"], dtype=np.float64)


def load_tuned(suite: str) -> dict[str, dict[str, Any]]:
    """Return the settings of classical controllers found by direct search.

    By task and controller. Raises InputError if the suite has none, or the file is
    broken.
    """
    path = suite_file(suite, "tuned")
    remedy = "make it again with scripts/tune_controllers.py"
    content = read_json(path, "file of tuned settings", remedy)
    where = f"{path}: tasks"
    tasks = check_table(content.get("tasks"), where)
    settings = {}
    for name, controllers in tasks.items():
        table = check_table(controllers, f"{where}.{name}")
        settings[name] = dict(table)
    return settings
