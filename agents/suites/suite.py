"""Suites: named tasks with their ship, their sea and the seeds of their episodes.

A suite is a TOML file, as docs/benchmark.md describes it: a shipped one in this folder,
or a user's own.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from agents.suites.benchmark_task import (
    BenchmarkTask,
)
from agents.suites.environments import read_environment
from agents.suites.limits import read_limits
from shipgym import InputError
from shipgym.checks import (
    check_choice,
    check_keys,
    check_number,
    check_table,
    check_text,
    data_only,
    placed,
)
from shipgym.files import LARGEST_TOML, parse_toml, read_json, read_text

DEFAULT_SUITE = "shipgym-v1"
FOLDER = Path(__file__).parent
FIELDS = (
    "environment",
    "model",
    "why",
    "sea",
    "options",
    "ship",
    "judge",
    "sweep",
    "part",
    "rule",
    "limits",
)


@dataclass(frozen=True)
class Suite:
    """Tasks on which controllers are compared."""

    name: str  # with its version: a task never changes under the same name
    tasks: tuple[BenchmarkTask, ...]  # in the order of the file
    source: str = ""  # name of a shipped suite, or the absolute path of a user's own
    sha256: str = ""  # of the file
    budget: float = 1e12  # most ship steps that making a run of an entry may take

    def task(self, name: str) -> BenchmarkTask:
        """Return a task by name; raises InputError for an unknown one."""
        known = {task.name: task for task in self.tasks}
        check_choice(name, known, f"suite '{self.name}': task")
        return known[name]

    def select(self, names: str | Sequence[str] | None) -> tuple[BenchmarkTask, ...]:
        """Return tasks by name, each once; None for all of them."""
        if names is None:
            return self.tasks
        if isinstance(names, str):
            names = [name.strip() for name in names.split(",")]
        if not names:
            raise InputError("tasks: expected at least one, got none")
        return tuple(self.task(name) for name in dict.fromkeys(names))


def load_suite(suite: str | Path = DEFAULT_SUITE, allow_code: bool = False) -> Suite:
    """Read a shipped suite by name, or a suite of the user's own.

    Models and ships of a shipped one are loaded when they are used.

    Raises InputError for an unknown name, with the nearest, or naming the field at
    fault.

    Parameters
    ----------
    suite : str or Path
        A name, or the path of a TOML file; relative paths in it begin at its folder.
    allow_code : bool
        Whether the suite may name Python files and modules, which are run.
    """
    where = str(suite)
    if not where.endswith(".toml"):
        return _shipped(where)
    path = Path(where).resolve()
    text = read_text(path, "TOML file of a suite", LARGEST_TOML)
    found = parse_suite(
        text,
        where,
        path.parent,
        allow_code,
        source=str(path),
    )
    for task in found.tasks:
        with placed(f"{where}: tasks.{task.name}"):
            task.check_ship()
    return found


@cache
def _shipped(name: str) -> Suite:
    check_choice(name, (DEFAULT_SUITE,), "suite", " or the path of a TOML file")
    text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    return parse_suite(text, f"suite '{name}'", FOLDER, source=name)


def find_task(name: str) -> BenchmarkTask:
    """Return the task that controllers are made for: without the ship behind the model.

    Raises InputError for an unknown name, with the nearest.
    """
    return load_suite().task(name).design_task


def tuned_file(suite: str) -> Path:
    """Return the path of the tuned settings beside a suite; it need not exist.

    `suite` is a `Suite.source`, the file's name is NAME-tuned.json.
    """
    if suite.endswith(".toml"):
        path = Path(suite)
        return path.with_name(f"{path.stem}-tuned.json")
    return FOLDER / f"{suite}-tuned.json"


def load_tuned(suite: str) -> dict[str, dict[str, Any]]:
    """Return the settings of classical controllers found by direct search.

    By task and controller, as scripts/tune_controllers.py keeps them beside a suite:
    `settings`, `cost`, `start_cost`, `evaluations`. `suite`: a `Suite.source`. Raises
    InputError if the suite has none, or the file is broken.
    """
    path = tuned_file(suite)
    remedy = "make it again with scripts/tune_controllers.py"
    content = read_json(path, "file of tuned settings", remedy)
    return dict(check_table(content.get("tasks"), f"{path}: tasks"))


def parse_suite(
    text: str,
    where: str,
    folder: Path = Path(),
    allow_code: bool = False,
    source: str = "",
) -> Suite:
    """Read a suite from its TOML text; its models and ships are loaded when used.

    `where` begins the messages, `folder` is where relative paths begin, `source` the
    `Suite.source`; for `allow_code` see `load_suite`. Raises InputError naming the
    field at fault.
    """
    content = parse_toml(text, f"{where}:")
    check_keys(content, ("name", "budget", "tasks"), where)
    budget = check_number(content.get("budget", 1e12), f"{where}: budget", above=0.0)
    name = check_text(content.get("name"), f"{where}: name")
    tasks = []
    for task_name, value in check_table(
        content.get("tasks"), f"{where}: tasks"
    ).items():
        place = f"{where}: tasks.{task_name}"
        table = check_table(value, place, FIELDS)
        if not allow_code:
            _check_data(table, place)
        tasks.append(
            replace(
                _read_task(task_name, table, folder, place),
                suite=source,
            )
        )
    return Suite(
        name,
        tuple(tasks),
        source,
        hashlib.sha256(text.encode()).hexdigest(),
        budget,
    )


def _check_data(table: Mapping[str, Any], where: str) -> None:
    """Refuse a task that names code."""
    for name in ("environment", "rule"):
        text = str(
            table.get(name, ""),
        )
        if ":" in text or text.endswith(".py"):
            raise InputError(
                f"{where}.{name}: expected no code, got '{text}'; if you trust the"
                " suite: --allow-code"
            )
    data_only(table, where)


def _read_task(
    name: str, table: Mapping[str, Any], folder: Path, where: str
) -> BenchmarkTask:
    """Return a task from its table; relative paths in it begin at the folder."""
    field = f"{where}.environment"
    text = check_text(table.get("environment"), field)
    given = _resolved(table, folder)
    options = dict(check_table(given.pop("options", {}), f"{where}.options"))
    if "sea" in given:
        options["sea"] = given.pop("sea")
    environment = read_environment(text, folder, field)
    options = {**environment.options, **options}
    given.setdefault("model", options.pop("model", None))
    for named in {"model", "ship", "why", "part", "rule"} & given.keys():
        check_text(given[named], f"{where}.{named}")
    check_table(given.get("judge", {}), f"{where}.judge")
    sweep = given.get("sweep", ())
    for k, point in enumerate(sweep, start=1):
        check_table(point, f"{where}.sweep-{k}")
    given["limits"] = read_limits(
        given.get("limits", {}),
        f"{where}.limits",
    )
    given["true_ship"] = given.pop("ship", "")
    given["environment"] = environment.name
    given["options"] = options
    with placed(where):
        return BenchmarkTask(name=name, **given)


def _resolved(value: Any, folder: Path) -> Any:
    """Copy a value of TOML; paths of files become absolute."""
    if isinstance(value, Mapping):
        return {name: _resolved(part, folder) for name, part in value.items()}
    if isinstance(value, list):
        return [_resolved(part, folder) for part in value]
    if isinstance(value, str) and value.endswith((".py", ".json")):
        return str((folder / value).resolve())
    return value
