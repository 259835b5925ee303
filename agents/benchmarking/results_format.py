"""Fields of `results.json`, checked when it is read."""

from collections.abc import Mapping
from types import NoneType
from typing import Any

from shipgym.checks import ANY_KEY, Shape, check_choice, check_shape, check_whole

FORMAT, KIND = 2, "shipgym-benchmark"

TEXT, COUNT, NUMBER = (str,), (int,), (int, float)
TEXT_OR_NULL, NUMBER_OR_NULL = (str, NoneType), (int, float, NoneType)
INTERVAL: Shape = {
    "value": NUMBER_OR_NULL,
    "low": NUMBER_OR_NULL,
    "high": NUMBER_OR_NULL,
}
TASK: Shape = {
    "environment": TEXT,
    "model": TEXT,
    "model_sha256": TEXT,
    "why": TEXT,
    "on": TEXT,
    "ship": TEXT,
    "limits": {ANY_KEY: NUMBER},  # largest values of figures
}
CONTROLLER: Shape = {
    "source": TEXT_OR_NULL,
    "files": {ANY_KEY: TEXT},  # SHA-256 by path
    "runs": COUNT,
    "refused": {ANY_KEY: TEXT},  # why, by task
}
CELL: Shape = {
    "cost": {"value": NUMBER, "low": NUMBER_OR_NULL, "high": NUMBER_OR_NULL},
    "cost_iqm": INTERVAL,
    "score": INTERVAL,  # cost of the rule over this cost
    "gain": INTERVAL,  # share of the rule's cost that is saved
    "relative_cost": NUMBER_OR_NULL,  # to the lowest one here
    "runs": COUNT,
    "lost": COUNT,
    "failed": COUNT,
    "failure": TEXT,
    "exceeded": {ANY_KEY: NUMBER},  # figures beyond their limits
    "policy_sha256": [TEXT_OR_NULL],
    "microseconds_per_action": NUMBER_OR_NULL,
    "metrics": {
        ANY_KEY: {
            "mean": NUMBER_OR_NULL,
            "median": NUMBER_OR_NULL,
            "p95": NUMBER_OR_NULL,
        }
    },
}
TOTAL: dict[str, Shape] = {
    "score": INTERVAL,  # geometric mean over tasks
    "score_iqm": INTERVAL,  # interquartile mean over runs and tasks
    "improvement": INTERVAL,  # probability of costing less than the rule
    "scored_tasks": COUNT,  # those in which the rule's cost is known
    "relative_cost": NUMBER_OR_NULL,
    "tasks": COUNT,
    "lost": COUNT,
    "failed": COUNT,
    "exceeding": COUNT,  # tasks in which a limit is exceeded
}
#: The total is that of the episodes on the ship, `elsewhere` has those of other sets.
RANKED: Shape = {"name": TEXT, **TOTAL, "elsewhere": {ANY_KEY: TOTAL}}

SUMMARY: dict[str, Shape] = {
    "versions": {ANY_KEY: TEXT},  # and the processor
    "suite": {
        "name": TEXT,
        "sha256": TEXT,
        "file": TEXT,  # of a suite of the user's own
        "complete": (bool,),  # all tasks of the suite were run
        "tasks": {ANY_KEY: TASK},
    },
    "seeds": {"first": COUNT, "count": COUNT},
    "controllers": {ANY_KEY: CONTROLLER},
    "tasks": {ANY_KEY: {ANY_KEY: CELL}},  # by task and controller
    # mean costs of the tuned rule, and the bound from clairvoyance, by task
    "reference": {ANY_KEY: {"rule": NUMBER, "bound": NUMBER}},
    "ranking": [RANKED],  # best first
    # probability that the first costs less than the second
    "improvement": {ANY_KEY: {ANY_KEY: INTERVAL}},
    "profile": {"thresholds": [NUMBER], "shares": {ANY_KEY: [NUMBER]}},
    "episodes": {"file": TEXT, "rows": COUNT, "sha256": TEXT_OR_NULL},
}
FIELDS = ("format", "kind", *SUMMARY)


def check_summary(content: Mapping[str, Any], where: str) -> None:
    """Refuse a wrong value, or a controller or task that is named but not described.

    Raises InputError that begins with `where`, the file, and names the field.
    """
    for name, shape in SUMMARY.items():
        check_shape(content[name], shape, f"{where}: {name}")
    n_episodes = content["seeds"]["count"]
    check_whole(n_episodes, f"{where}: seeds.count", at_least=1)

    known = content["controllers"]
    ranked = [total["name"] for total in content["ranking"]]
    improving = content["improvement"]
    profiled = content["profile"]["shares"]
    for name in [*ranked, *improving, *profiled]:
        check_choice(name, known, f"{where}: name of a controller")

    tasks = content["tasks"]
    known_tasks = content["suite"]["tasks"]
    for task in [*content["reference"], *tasks]:
        check_choice(task, known_tasks, f"{where}: name of a task")
    for task, cells in tasks.items():
        field = f"{where}: tasks.{task}: name of a controller"
        for name in cells:
            check_choice(name, ranked, field)
