"""What stands where in `results.json`, and that it is checked when read."""

from __future__ import annotations

from collections.abc import Mapping
from types import NoneType
from typing import Any

from shipgym.checks import ANY_KEY, Shape, check_choice, check_shape, check_whole

NUMBER: Shape = (int, float)
PERHAPS: Shape = (int, float, NoneType)
INTERVAL: Shape = {"value": PERHAPS, "low": PERHAPS, "high": PERHAPS}
ENTRY: Shape = {
    "cost": {"value": NUMBER, "low": PERHAPS, "high": PERHAPS}, "cost_iqm": INTERVAL, "score": INTERVAL,
    "relative_cost": PERHAPS, "runs": (int,), "lost": (int,), "failed": (int,), "failure": (str,),
    "policy_sha256": [(str, NoneType)], "microseconds_per_action": PERHAPS,
    "metrics": {ANY_KEY: {"mean": PERHAPS, "median": PERHAPS, "p95": PERHAPS}},
}  # fmt: skip
SHAPE: dict[str, Shape] = {
    "versions": {ANY_KEY: (str,)},
    "suite": {
        "name": (str,),
        "sha256": (str,),
        "tasks": {ANY_KEY: {"environment": (str,), "model": (str,), "model_sha256": (str,), "why": (str,)}},
    },
    "seeds": {"first": (int,), "count": (int,)},
    "contestants": {
        ANY_KEY: {
            "source": (str, NoneType), "files": {ANY_KEY: (str,)}, "runs": (int,),
            "refused": {ANY_KEY: (str,)},
        }
    },
    "tasks": {ANY_KEY: {ANY_KEY: ENTRY}},
    "reference": {ANY_KEY: {"pid": NUMBER, "oracle": NUMBER}},
    "ranking": [
        {
            "name": (str,), "score": INTERVAL, "relative_cost": PERHAPS, "tasks": (int,), "lost": (int,),
            "failed": (int,),
        }
    ],
    "improvement": {ANY_KEY: {ANY_KEY: INTERVAL}},
    "profile": {"thresholds": [NUMBER], "shares": {ANY_KEY: [NUMBER]}},
    "episodes": {"file": (str,), "rows": (int,), "sha256": (str, NoneType)},
}  # fmt: skip


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
