"""Submissions to the leaderboard: the costs of one contestant as one JSON file, which `verify` checks.

format, kind    1, "shipgym-submission"
versions        of what the costs depend on, and the processor
suite           {"name", "sha256"}
seeds           {"first", "count"}: all that are scored
contestant      {"name", "source", "files": {path: SHA-256}}
costs           {task: [one list of costs of the episodes for each training run]}
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from agents.benchmarking.episode_table import joined
from agents.benchmarking.results import BenchmarkResult, versions
from agents.suites.suite import FIRST_SEED, N_EPISODES, load_suite, suite_hash
from shipgym.checks import ANY_KEY, Shape, check_choice, check_format, check_shape
from shipgym.errors import InputError
from shipgym.files import write_json

FORMAT, KIND = 1, "shipgym-submission"
SHAPE: dict[str, Shape] = {
    "versions": {ANY_KEY: (str,)},
    "suite": {"name": (str,), "sha256": (str,)},
    "seeds": {"first": (int,), "count": (int,)},
    "contestant": {"name": (str,), "source": (str,), "files": {ANY_KEY: (str,)}},
    "costs": {ANY_KEY: [[(int, float)]]},
}
SEEDS = {"first": FIRST_SEED, "count": N_EPISODES}


def submit(result: BenchmarkResult, contestant: str, path: str | Path) -> None:
    """Write what one contestant came to in all tasks of a suite.

    Raises InputError if it took no part in one of them, fewer episodes were run than
    are scored, or it was given as an object, which nobody else can make.
    """
    about = result.summary
    one = about["contestants"][check_choice(contestant, about["contestants"], "submit")]
    done = [task for task, found in about["tasks"].items() if contestant in found]
    missing = [
        task.name
        for task in load_suite(about["suite"]["name"]).tasks
        if task.name not in done
    ]
    if one["source"] is None or missing or about["seeds"] != SEEDS:
        why = (
            f"no results in {', '.join(missing)}"
            if missing
            else f"seeds {about['seeds']}"
        )
        raise InputError(
            f"submit: '{contestant}': {'an object' if one['source'] is None else why}"
            f" found, expected a contestant named by a text with all {N_EPISODES}"
            " episodes of all tasks of the suite"
        )
    content = {
        "format": FORMAT,
        "kind": KIND,
        "versions": about["versions"],
        "seeds": about["seeds"],
        "suite": {name: about["suite"][name] for name in ("name", "sha256")},
        "contestant": {
            "name": contestant,
            "source": one["source"],
            "files": one["files"],
        },
        "costs": {
            task: result.figures(contestant, task).tolist() for task in about["tasks"]
        },
    }
    write_json(content, Path(path))


def read_submission(content: Mapping[str, Any], where: str) -> BenchmarkResult:
    """A submission as results that can be run again; they have no figure but the cost.

    Raises InputError naming the field at fault: other seeds, another suite or version
    of shipgym than here.
    """
    check_format(content, FORMAT, where)
    for name, shape in SHAPE.items():
        check_shape(content.get(name), shape, f"{where}: {name}")
    suite, one = content["suite"], content["contestant"]
    tasks = [task.name for task in load_suite(suite["name"]).tasks]
    expected = {
        "seeds": (content["seeds"], SEEDS),
        "suite.sha256": (suite["sha256"], suite_hash(suite["name"])),
        "versions.shipgym": (
            content["versions"].get("shipgym"),
            versions().get("shipgym"),
        ),
        "costs: tasks": (sorted(content["costs"]), sorted(tasks)),
        "costs: episodes": (
            {len(run) for runs in content["costs"].values() for run in runs},
            {N_EPISODES},
        ),
    }
    for name, (found, wanted) in expected.items():
        if found != wanted:
            raise InputError(
                f"{where}: {name}: {found} found, expected {wanted}; submit what this"
                " version made"
            )
    seeds = FIRST_SEED + np.arange(N_EPISODES)
    costs = {
        task: np.array(runs, dtype=np.float64)
        for task, runs in content["costs"].items()
    }
    rows = [
        (one["name"], task, number, seeds, {"cost": run})
        for task, runs in costs.items()
        for number, run in enumerate(runs)
    ]
    found_runs = {
        task: {one["name"]: {"runs": len(runs)}} for task, runs in costs.items()
    }
    return BenchmarkResult(
        {**content, "contestants": {one["name"]: one}, "tasks": found_runs},
        joined(rows),
    )
