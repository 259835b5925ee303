"""Settings of classical controllers found by direct search for the tasks of a suite, and the oracle's costs.

Both are kept beside the suite, in `agents/suites`. `SUITE-tuned.json` holds, by task and kind,

    {"mariner-calm": {"lq": {"options": {"integral_lengths": 40.0}, "cost": 24.5}, ...}, ...}

options being those of the class's `from_model`; of a guidance law `autopilot` may be such a table with its
`kind`. `SUITE-oracle.json` holds, by task, the oracle's cost of each scored episode, in the order of the
seeds.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.contestants import CLASSICAL, designed
from agents.benchmarking.suite import N_EPISODES, BenchmarkTask, suite_file
from agents.controller import Policy
from shipgym.checks import check_choice, check_keys, check_number, check_table
from shipgym.errors import InputError
from shipgym.json_file import read_json

BEST = "best"
REMEDY = "take another copy"


def tuned(kind: str, task: BenchmarkTask, suite: str) -> Policy:
    """A classical controller with the settings found by direct search.

    Parameters
    ----------
    kind : str
        Of a classical controller, or "best": the one whose cost was least.
    task : BenchmarkTask
    suite : str
        Its suite's name.

    Raises
    ------
    InputError
        If none were found for this task, or the file is broken.
    """
    path = suite_file(suite, "tuned")
    found = _table(path).get(task.name, {})
    known = {name: _settings(value, f"{path}: {task.name}.{name}") for name, value in found.items()}
    if kind == BEST and known:
        kind = min(known, key=lambda name: known[name]["cost"])
    if kind not in known:
        raise InputError(f"no tuned settings of '{kind}' for task '{task.name}' of suite '{suite}'")
    return _with_options(kind, task, known[kind]["options"])


def oracle_costs(task: BenchmarkTask, suite: str) -> NDArray[np.float64]:
    """The oracle's cost of each scored episode, shape (100,).

    Raises
    ------
    InputError
        If they are not kept for this task, or the file is broken.
    """
    path = suite_file(suite, "oracle")
    costs = _table(path).get(task.name)
    if costs is None:
        raise InputError(f"no costs of the oracle are kept for task '{task.name}' of suite '{suite}'")
    if not isinstance(costs, list) or len(costs) != N_EPISODES:
        raise InputError(f"{path}: {task.name}: expected a list of {N_EPISODES} costs; {REMEDY}")
    return np.array([check_number(cost, f"{path}: {task.name}[{k}]") for k, cost in enumerate(costs)])


@lru_cache(maxsize=8)
def _table(path: Path) -> Mapping[str, Any]:
    return read_json(path, "file of the suite", REMEDY) if path.exists() else {}


def _settings(value: Any, where: str) -> dict[str, Any]:
    table = check_table(value, where)
    check_keys(table, ("options", "cost"), where)
    return {
        "options": dict(check_table(table.get("options", {}), f"{where}.options")),
        "cost": check_number(table.get("cost"), f"{where}.cost"),
    }


def _with_options(kind: str, task: BenchmarkTask, options: Mapping[str, Any]) -> Policy:
    given = dict(options)
    if "autopilot" in given:
        inner = dict(check_table(given["autopilot"], f"autopilot of {kind}"))
        name = check_choice(inner.pop("kind", None), CLASSICAL, f"autopilot of {kind}: kind")
        given["autopilot"] = designed(name, task, **inner)
    return designed(kind, task, **given)
