"""Files kept beside a suite: its best known costs, and settings of its controllers.

    SUITE-best.json     by task, of each scored episode: the cost of the tuned rule,
                        `rule_costs`, which scores are relative to; the bound from
                        clairvoyance, `costs`, and what reached it, `by`
                        (scripts/best_known.py)
    SUITE-tuned.json    `tasks`: by task and controller `settings`, `cost`,
                        `start_cost`, `evaluations` (scripts/tune_controllers.py)

`suite` is a `Suite.source` in all of these functions.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from agents.suites.benchmark_task import N_EPISODES, BenchmarkTask
from agents.suites.suite import suite_file
from shipgym import InputError
from shipgym.arrays import Floats
from shipgym.checks import ANY_KEY, Shape, check_shape, check_table
from shipgym.files import read_json

#: Controller whose cost scores are relative to.
RULE = "tuned-preview-lq"
BEST: Shape = {ANY_KEY: {"costs": [(int, float)], "by": [(str,)]}}


class ReferenceCosts(NamedTuple):
    """Costs of each scored episode of a task, which a controller is compared with.

    Attributes
    ----------
    rule : array of shape (100,)
        Of the tuned rule.
    bound : array of shape (100,)
        The lowest that is known, reached with full knowledge.
    """

    rule: Floats
    bound: Floats


def best_known(suite: str) -> dict[str, dict[str, Any]]:
    """Return what is kept by task, as in the file; empty if there is none.

    `rule_costs` is missing where the rule has not been run. Raises InputError naming
    the field of the file at fault.
    """
    path = suite_file(suite, "best")
    if not path.exists():
        return {}
    content = read_json(path, "file of best known costs", "take another copy")
    check_shape(content, BEST, str(path))
    for task, known in content.items():
        _check_costs(known, f"{path}: {task}")
    return dict(content)


def _check_costs(known: Mapping[str, Any], where: str) -> None:
    """Refuse costs of a task that are not of all scored episodes."""
    n_costs = len(known["costs"])
    n_by = len(known["by"])
    if n_costs != N_EPISODES or n_by != N_EPISODES:
        raise InputError(
            f"{where}: expected costs of {N_EPISODES} episodes and what reached them,"
            f" got {n_costs} and {n_by}"
        )
    if "rule_costs" in known:
        rule_costs = known["rule_costs"]
        check_shape(rule_costs, [(int, float)], f"{where}.rule_costs")
        if len(rule_costs) != N_EPISODES:
            raise InputError(
                f"{where}.rule_costs: expected costs of {N_EPISODES} episodes, got"
                f" {len(rule_costs)}"
            )


def reference_costs(suite: str) -> dict[str, ReferenceCosts]:
    """Return the costs of the tuned rule and the bound, by task.

    Tasks are left out where the rule's cost is not known, or is 0.
    """
    references = {}
    for task, known in best_known(suite).items():
        rule = np.array(known.get("rule_costs", 0.0), dtype=np.float64)
        bound = np.array(known["costs"], dtype=np.float64)
        if rule.mean() > 0.0:
            references[task] = ReferenceCosts(rule, bound)
    return references


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
