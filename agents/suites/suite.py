"""Suites: named tasks with their ship, their sea and the seeds of their episodes.

A suite is a TOML file, as docs/benchmark.md describes it: a shipped one in this folder,
or a user's own. A task with a true ship has three sets of episodes (`SETS`):
controllers are made for its model and evaluated on the ship, on the model, and on the
ship far from what they were made for.
"""

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from agents.suites.benchmark_task import (
    FIRST_SEED,
    N_EPISODES,
    SETS,
    BenchmarkTask,
)
from agents.suites.environments import read_environment
from agents.suites.limits import read_limits
from shipgym import InputError, Weather
from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    check_text,
    data_only,
    placed,
)
from shipgym.files import parse_toml, read_bytes, read_json

__all__ = [
    "DEFAULT_SUITE",
    "FIRST_SEED",
    "N_EPISODES",
    "SETS",
    "BenchmarkTask",
    "Suite",
    "find_task",
    "load_suite",
    "load_tuned",
    "parse_suite",
    "suite_file",
]

DEFAULT_SUITE = "shipgym-v1"
FOLDER = Path(__file__).parent
FIELDS = (
    "environment",
    "model",
    "why",
    "sea",
    "options",
    "ship",
    "far",
    "limits",
)


@dataclass(frozen=True)
class Suite:
    """Tasks on which controllers are compared."""

    name: str  # with its version: a task never changes under the same name
    tasks: tuple[BenchmarkTask, ...]  # in the order of the file
    source: str = ""  # name of a shipped suite, or the absolute path of a user's own
    sha256: str = ""  # of the file

    def task(self, name: str) -> BenchmarkTask:
        """Return a task by name; raises InputError for an unknown one."""
        known = {task.name: task for task in self.tasks}
        check_choice(name, known, f"suite '{self.name}': task")
        return known[name]

    def select(self, names: str | Sequence[str] | None) -> tuple[BenchmarkTask, ...]:
        """Return tasks by name, each once; None for all of them.

        The name of a task with a true ship stands for all its sets of episodes.
        """
        if names is None:
            return self.tasks
        if isinstance(names, str):
            parts = names.split(",")
            names = [name.strip() for name in parts]
        if not names:
            raise InputError("tasks: expected at least one, got none")

        selected: dict[str, BenchmarkTask] = {}
        for name in names:
            for task in self._sets(name):
                selected[task.name] = task
        return tuple(selected.values())

    def _sets(self, name: str) -> list[BenchmarkTask]:
        """Return the sets of episodes of a task, or the one of this name."""
        sets = [task for task in self.tasks if task.design_name == name]
        return sets or [self.task(name)]


def load_suite(
    suite: str | Path = DEFAULT_SUITE, allow_code: Collection[str] = ()
) -> Suite:
    """Read a shipped suite by name, or a suite of the user's own.

    Models and ships of a shipped one are loaded when they are used.

    Raises InputError for an unknown name, with the nearest, or naming the field at
    fault.

    Parameters
    ----------
    suite : str or Path
        A name, or the path of a TOML file; relative paths in it begin at its folder.
    allow_code : collection of str
        Python files and modules that the suite may name, as it writes them, or their
        paths. A suite is data: it runs no code that its user has not named too.
    """
    where = str(suite)
    if not where.endswith(".toml"):
        return _shipped(where)
    path = Path(where).resolve()
    largest_suite = 1_000_000  # bytes
    content = read_bytes(path, "TOML file of a suite", largest_suite)
    try:
        text = content.decode()
    except UnicodeDecodeError:
        raise InputError(f"{where}: expected UTF-8, got other bytes") from None
    found = parse_suite(text, where, path.parent, allow_code, source=str(path))
    for task in found.tasks:
        with placed(f"{where}: tasks.{task.design_name}"):
            task.check_ship()
    return found


@cache
def _shipped(name: str) -> Suite:
    check_choice(name, (DEFAULT_SUITE,), "suite", " or the path of a TOML file")
    text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    return parse_suite(text, f"suite '{name}'", FOLDER, source=name)


def find_task(
    name: str, suite: str | Path = DEFAULT_SUITE, allow_code: Collection[str] = ()
) -> BenchmarkTask:
    """Return the task that controllers are made for: without the ship behind the model.

    Raises InputError for an unknown name, with the nearest, or as `load_suite`.
    """
    known = {}
    found = load_suite(suite, allow_code)
    for task in found.tasks:
        if task.on == "ship":
            known[task.name] = task
    check_choice(name, known, "task")
    return known[name].design_task


def suite_file(suite: str, what: str) -> Path:
    """Return the path of a file that is kept beside a suite; it need not exist.

    `suite` is a `Suite.source`, the file's name is NAME-`what`.json.
    """
    if suite.endswith(".toml"):
        path = Path(suite)
        return path.with_name(f"{path.stem}-{what}.json")
    return FOLDER / f"{suite}-{what}.json"


def load_tuned(suite: str) -> dict[str, dict[str, Any]]:
    """Return the settings of classical controllers found by direct search.

    By task and controller, as scripts/tune_controllers.py keeps them beside a suite:
    `settings`, `cost`, `start_cost`, `evaluations`. `suite`: a `Suite.source`. Raises
    InputError if the suite has none, or the file is broken.
    """
    path = suite_file(suite, "tuned")
    remedy = "make it again with scripts/tune_controllers.py"
    content = read_json(path, "file of tuned settings", remedy)
    tasks = check_table(content.get("tasks"), f"{path}: tasks")
    settings = {}
    for name, controllers in tasks.items():
        settings[name] = dict(check_table(controllers, f"{path}: tasks.{name}"))
    return settings


def parse_suite(
    text: str,
    where: str,
    folder: Path = Path(),
    allow_code: Collection[str] = (),
    source: str = "",
) -> Suite:
    """Read a suite from its TOML text; its models and ships are loaded when used.

    `where` begins the messages, `folder` is where relative paths begin, `source` the
    `Suite.source`; for `allow_code` see `load_suite`. Raises InputError naming the
    field at fault.
    """
    reader = _Reader(folder, allow_code)
    content = parse_toml(text, f"{where}:")
    check_keys(content, ("name", "tasks"), where)
    name = check_text(content.get("name"), f"{where}: name")
    tasks_field = f"{where}: tasks"
    tables = check_table(content.get("tasks"), tasks_field)

    tasks: list[BenchmarkTask] = []
    for task_name, table in tables.items():
        field = f"{tasks_field}.{task_name}"
        task = reader.read(task_name, table, field)
        tasks += _sets_of(replace(task, suite=source))

    sha256 = hashlib.sha256(text.encode()).hexdigest()
    return Suite(name, tuple(tasks), source, sha256)


@dataclass(frozen=True)
class _Reader:
    """Reads the tasks of a suite."""

    folder: Path
    allow_code: Collection[str] = ()

    def read(self, name: str, value: Any, where: str) -> BenchmarkTask:
        """Return a task, that of the ship if it has one."""
        table = check_table(value, where, FIELDS)
        if table.get("far") and "ship" not in table:
            raise InputError(
                f"{where}.far: expected `ship` too, the one behind the model, got none"
            )
        field = f"{where}.environment"
        text = check_text(table.get("environment"), field)
        self.check_code(text, table, where)

        environment = read_environment(text, self.folder, field)
        options = {**environment.options, **self.own_options(table, where)}
        far = self.options(table.get("far", {}), f"{where}.far")

        default_model = options.pop("model", None)
        named_model = table.get("model", default_model)
        model = check_text(named_model, f"{where}.model")
        ship = ""
        if "ship" in table:
            ship = check_text(table["ship"], f"{where}.ship")
        with placed(where):
            return BenchmarkTask(
                name=name,
                environment=environment.name,
                model=self.absolute(model),
                why=str(table.get("why", "")),
                options=options,
                true_ship=self.absolute(ship),
                far=far,
                design_name=name,
                limits=read_limits(table.get("limits", {}), f"{where}.limits"),
            )

    def own_options(self, table: Mapping[str, Any], where: str) -> dict[str, Any]:
        """Keywords of an environment that a task's table gives, its sea among them."""
        options = self.options(table.get("options", {}), f"{where}.options")
        if "sea" in table:
            sea = {"sea": table["sea"]}
            options |= self.options(sea, where)
        return options

    def check_code(
        self, environment: str, table: Mapping[str, Any], where: str
    ) -> None:
        """Refuse code that the user has not named too."""
        is_code = ":" in environment or environment.endswith(".py")
        if is_code and not self.allows(environment):
            raise InputError(
                f"{where}.environment: expected no code that you have not named"
                f" yourself, got '{environment}'; if you trust it: --allow-code"
                f" {environment}"
            )
        data_only(self.without_allowed(table), where)

    def allows(self, text: str) -> bool:
        """Tell whether the user has named this code too."""
        paths = [Path(code).resolve() for code in self.allow_code]
        return text in self.allow_code or (self.folder / text).resolve() in paths

    def without_allowed(self, value: Any) -> Any:
        """Copy a value of TOML without the code that is allowed."""
        if isinstance(value, Mapping):
            kept = {}
            for key, part in value.items():
                kept[key] = self.without_allowed(part)
            return kept
        if isinstance(value, list):
            return [self.without_allowed(part) for part in value]
        if isinstance(value, str) and self.allows(value):
            return None
        return value

    def options(self, value: Any, where: str) -> dict[str, Any]:
        """Keywords of an environment: a sea may be a table, paths become absolute."""
        options = {}
        for name, option in check_table(value, where).items():
            options[name] = self.absolute(option)

        sea = options.get("sea")
        if isinstance(sea, Mapping):
            field = f"{where}.sea"
            with placed(field):
                options["sea"] = Weather.from_dict(sea, field)
        return options

    def absolute(self, value: Any) -> Any:
        """Absolute path of a Python or JSON file; anything else as it is."""
        if isinstance(value, list):
            return [self.absolute(part) for part in value]
        if isinstance(value, str) and value.endswith((".py", ".json")):
            path = self.folder / value
            return str(path.resolve())
        return value


def _sets_of(task: BenchmarkTask) -> list[BenchmarkTask]:
    """Return a task once for each set of episodes that it has."""
    on_ship = replace(task, far={})
    if not task.true_ship:
        return [on_ship]
    on_model = replace(
        task,
        name=task.name + SETS["model"],
        on="model",
        true_ship="",
        far={},
    )
    if not task.far:
        return [on_ship, on_model]
    return [on_ship, on_model, replace(task, name=task.name + SETS["far"], on="far")]
