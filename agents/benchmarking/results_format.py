"""What stands where in `results.json`, format 2, and that it is checked when read."""

from collections.abc import Mapping
from types import NoneType
from typing import Any

from shipgym.checks import ANY_KEY, Shape, check_choice, check_shape, check_whole

TEXT, COUNT, NUMBER = (str,), (int,), (int, float)
PERHAPS = (int, float, NoneType)
INTERVAL: Shape = {"value": PERHAPS, "low": PERHAPS, "high": PERHAPS}
TASK: dict[str, Shape] = dict.fromkeys(
    ("environment", "model", "model_sha256", "why", "on", "ship"), TEXT
)
CONTESTANT: Shape = {  # files: SHA-256 by path; refused: why, by task
    "source": (str, NoneType),
    "files": {ANY_KEY: TEXT},
    "runs": COUNT,
    "refused": {ANY_KEY: TEXT},
}
FOUND: Shape = {
    "cost": {"value": NUMBER, "low": PERHAPS, "high": PERHAPS},
    "cost_iqm": INTERVAL,
    "score": INTERVAL,
    "relative_cost": PERHAPS,
    "runs": COUNT,
    "lost": COUNT,
    "failed": COUNT,
    "failure": TEXT,
    "policy_sha256": [(str, NoneType)],
    "microseconds_per_action": PERHAPS,
    "metrics": {ANY_KEY: {"mean": PERHAPS, "median": PERHAPS, "p95": PERHAPS}},
}
ENTRY: dict[str, Shape] = {
    "score": INTERVAL,
    "relative_cost": PERHAPS,
    "tasks": COUNT,
    "lost": COUNT,
    "failed": COUNT,
}
RANKED: Shape = {
    "name": TEXT,
    **ENTRY,
    "elsewhere": {ANY_KEY: ENTRY},
}  # the last by set of episodes
SHAPE: dict[str, Shape] = {
    "versions": {ANY_KEY: TEXT},  # and the processor: bit for bit on equal ones only
    "suite": {"name": TEXT, "sha256": TEXT, "tasks": {ANY_KEY: TASK}},
    "seeds": {"first": COUNT, "count": COUNT},
    "contestants": {ANY_KEY: CONTESTANT},
    "tasks": {ANY_KEY: {ANY_KEY: FOUND}},  # by task and contestant
    "reference": {
        ANY_KEY: {"zero": NUMBER, "best": NUMBER}
    },  # costs that are scores of 0 and 1, by task
    "ranking": [RANKED],  # best first
    "improvement": {
        ANY_KEY: {ANY_KEY: INTERVAL}
    },  # probability that one costs less than another
    "profile": {"thresholds": [NUMBER], "shares": {ANY_KEY: [NUMBER]}},
    "episodes": {"file": TEXT, "rows": COUNT, "sha256": (str, NoneType)},
}


def check_summary(content: Mapping[str, Any], where: str) -> None:
    """Refuse a summary with another value somewhere, or one that names whom or what it does not know.

    Raises InputError that begins with `where`, the file, and names the place.
    """
    for name, shape in SHAPE.items():
        check_shape(content[name], shape, f"{where}: {name}")
    check_whole(content["seeds"]["count"], f"{where}: seeds.count", at_least=1)
    known, tasks = content["contestants"], content["suite"]["tasks"]
    names = [entry["name"] for entry in content["ranking"]]
    for name in [*names, *content["improvement"], *content["profile"]["shares"]]:
        check_choice(name, known, f"{where}: name of a contestant")
    for name in [*content["tasks"], *content["reference"]]:
        check_choice(name, tasks, f"{where}: name of a task")
    for task, found in content["tasks"].items():
        for name in found:
            check_choice(name, names, f"{where}: tasks.{task}: name of a contestant")
