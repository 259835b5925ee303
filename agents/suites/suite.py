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
from shipgym import InputError, Weather
from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    check_text,
    data_only,
    placed,
)
from shipgym.files import parse_toml, read_bytes

__all__ = [
    "DEFAULT_SUITE",
    "FIRST_SEED",
    "N_EPISODES",
    "SETS",
    "BenchmarkTask",
    "Suite",
    "find_task",
    "list_suites",
    "load_suite",
    "parse_suite",
    "suite_file",
]

DEFAULT_SUITE = "shipgym-v1"
FOLDER = Path(__file__).parent
FIELDS = ("environment", "model", "why", "sea", "options", "ship", "far")
LARGEST_SUITE = 1_000_000  # bytes


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
        return known[check_choice(name, known, f"suite '{self.name}': task")]

    def select(self, names: str | Sequence[str] | None) -> tuple[BenchmarkTask, ...]:
        """Return tasks by name, each once; None for all of them.

        The name of a task with a true ship stands for all its sets of episodes.
        """
        if names is None:
            return self.tasks
        if isinstance(names, str):
            names = [name.strip() for name in names.split(",")]
        if not names:
            raise InputError("tasks: expected at least one, got none")
        selected: dict[str, BenchmarkTask] = {}
        for name in names:
            sets = [task for task in self.tasks if task.design_name == name]
            for task in sets or [self.task(name)]:
                selected[task.name] = task
        return tuple(selected.values())


def list_suites() -> list[str]:
    """Return the names of the shipped suites."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load_suite(
    suite: str | Path = DEFAULT_SUITE, allow_code: Collection[str] = ()
) -> Suite:
    """Read a shipped suite by name, or a suite of the user's own.

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
    text = str(suite)
    if not text.endswith(".toml"):
        return _shipped(text)
    path = Path(text).resolve()
    content = read_bytes(path, "TOML file of a suite", LARGEST_SUITE)
    read = parse_suite(_decoded(content, text), text, path.parent, allow_code)
    tasks = tuple(replace(task, suite=str(path)) for task in read.tasks)
    return Suite(read.name, tasks, str(path), hashlib.sha256(content).hexdigest())


@cache
def _shipped(name: str) -> Suite:
    content = _shipped_file(name).read_bytes()
    read = parse_suite(content.decode(), f"suite '{name}'")
    tasks = tuple(replace(task, suite=name) for task in read.tasks)
    return Suite(read.name, tasks, name, hashlib.sha256(content).hexdigest())


def _shipped_file(name: str) -> Path:
    known = list_suites()
    check_choice(name, known, "suite", " or the path of a TOML file")
    return FOLDER / f"{name}.toml"


def _decoded(content: bytes, where: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError:
        raise InputError(f"{where}: expected UTF-8, got other bytes") from None


def find_task(
    name: str, suite: str | Path = DEFAULT_SUITE, allow_code: Collection[str] = ()
) -> BenchmarkTask:
    """Return the task that controllers are made for: without the ship behind the model.

    Raises InputError for an unknown name, with the nearest, or as `load_suite`.
    """
    tasks = load_suite(suite, allow_code).tasks
    known = {task.name: task for task in tasks if task.on == "ship"}
    return known[check_choice(name, known, "task")].design_task


def suite_file(suite: str, what: str) -> Path:
    """Return the path of a file that is kept beside a suite; it need not exist.

    `suite` is a `Suite.source`, the file's name is NAME-`what`.json.
    """
    if suite.endswith(".toml"):
        path = Path(suite)
        return path.with_name(f"{path.stem}-{what}.json")
    return FOLDER / f"{suite}-{what}.json"


def parse_suite(
    text: str,
    where: str,
    folder: Path = Path(),
    allow_code: Collection[str] = (),
) -> Suite:
    """Read a suite from its TOML text; raises InputError naming the field at fault.

    `where` begins the messages, `folder` is where relative paths begin; for
    `allow_code` see `load_suite`.
    """
    content = parse_toml(text, f"{where}:")
    check_keys(content, ("name", "tasks"), where)
    name = check_text(content.get("name"), f"{where}: name")
    reader = _Reader(folder, allow_code)
    tasks: list[BenchmarkTask] = []
    for task, table in check_table(content.get("tasks"), f"{where}: tasks").items():
        tasks += reader.read(task, table, f"{where}: tasks.{task}")
    return Suite(name, tuple(tasks))


@dataclass(frozen=True)
class _Reader:
    """Reads the tasks of a suite."""

    folder: Path
    allow_code: Collection[str]

    def read(self, name: str, value: Any, where: str) -> list[BenchmarkTask]:
        """Return a task, once for each of its sets of episodes."""
        table = check_table(value, where, FIELDS)
        if table.get("far") and "ship" not in table:
            raise InputError(
                f"{where}.far: expected `ship` too, the one behind the model, got none"
            )
        text = check_text(table.get("environment"), f"{where}.environment")
        if ":" in text or text.endswith(".py"):
            self.check_allowed(text, f"{where}.environment")
        data_only(self.without_allowed(table), where)

        environment = read_environment(text, self.folder, f"{where}.environment")
        options = {
            **environment.options,
            **self.options(table.get("options", {}), f"{where}.options"),
            **self.options({"sea": table["sea"]} if "sea" in table else {}, where),
        }
        default = options.pop("model", None)
        model = check_text(table.get("model", default), f"{where}.model")
        ship = check_text(table["ship"], f"{where}.ship") if "ship" in table else ""
        far = self.options(table.get("far", {}), f"{where}.far")
        with placed(where):
            task = BenchmarkTask(
                name=name,
                environment=environment.name,
                model=self.absolute(model),
                why=table.get("why", ""),
                options=options,
                true_ship=self.absolute(ship),
                design_name=name,
            )
            return _with_sets(task, far)

    def check_allowed(self, text: str, where: str) -> None:
        """Refuse code that the user has not named too."""
        if not self.allowed(text):
            raise InputError(
                f"{where}: expected no code that you have not named yourself, got"
                f" '{text}'; if you trust it: --allow-code {text}"
            )

    def allowed(self, text: str) -> bool:
        """Say whether the user has named this code too."""
        paths = [Path(code).resolve() for code in self.allow_code]
        return text in self.allow_code or (self.folder / text).resolve() in paths

    def without_allowed(self, value: Any) -> Any:
        """Copy a value of TOML without the code that is allowed."""
        if isinstance(value, Mapping):
            return {key: self.without_allowed(one) for key, one in value.items()}
        if isinstance(value, list):
            return [self.without_allowed(one) for one in value]
        return None if isinstance(value, str) and self.allowed(value) else value

    def options(self, value: Any, where: str) -> dict[str, Any]:
        """Keywords of an environment: a sea may be a table, paths become absolute."""
        options = {
            name: self.absolute(one) for name, one in check_table(value, where).items()
        }
        if isinstance(options.get("sea"), Mapping):
            with placed(f"{where}.sea"):
                options["sea"] = Weather.from_dict(options["sea"], f"{where}.sea")
        return options

    def absolute(self, value: Any) -> Any:
        """Absolute path of a Python or JSON file; anything else as it is."""
        if isinstance(value, list):
            return [self.absolute(one) for one in value]
        if isinstance(value, str) and value.endswith((".py", ".json")):
            return str((self.folder / value).resolve())
        return value


def _with_sets(task: BenchmarkTask, far: Mapping[str, Any]) -> list[BenchmarkTask]:
    """Return a task once for each set of episodes that it has."""
    if not task.true_ship:
        return [task]
    on_model = replace(task, name=task.name + SETS["model"], on="model", true_ship="")
    if not far:
        return [task, on_model]
    return [
        task,
        on_model,
        replace(task, name=task.name + SETS["far"], on="far", far=far),
    ]
