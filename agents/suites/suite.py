"""Suites: named tasks with their ship, their sea and the seeds of their episodes, fixed once and for all.

A suite is a TOML file of `agents/suites`, as docs/benchmark.md describes it. A task
with a ship is three (`SETS`): contestants are made for the model and evaluated on the
ship, on the model, and on the ship far from what they were made for.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from shipgym import InputError, ShipModel, SteeringGear, Weather
from shipgym.arrays import Integers
from shipgym.checks import (
    check_choice,
    check_keys,
    check_table,
    check_text,
    data_only,
    placed,
)
from shipgym.envs.engine import Engine
from shipgym.envs.environment import read_options
from shipgym.envs.randomisation import Randomisation
from shipgym.files import parse_toml
from shipgym.tasks.task import Task

#: Environments by their names in suites and on the command line: id, and task.
ENVIRONMENTS: Mapping[str, tuple[str, str]] = {
    "course-keeping": ("shipgym/CourseKeeping-v0", "CourseKeeping"),
    "path-following": ("shipgym/PathFollowing-v0", "PathFollowing"),
    "path-following-v1": ("shipgym/PathFollowing-v1", "PathFollowing-v1"),
}
#: Seeds of the episodes that are scored; training and tuning use smaller ones.
FIRST_SEED = 1_000_000
N_EPISODES = 100
DEFAULT_SUITE = "shipgym-v1"
FOLDER = Path(__file__).parent
FIELDS = ("environment", "model", "why", "sea", "options", "ship", "far")
#: Sets of episodes of a task with a ship, and what their names end in.
SETS: Mapping[str, str] = {"ship": "", "model": "-on-model", "far": "-far"}


@dataclass(frozen=True)
class BenchmarkTask:
    """One task of a suite."""

    name: str  # unique in its suite
    environment: str  # one of `ENVIRONMENTS`
    model: str  # shipped model that is steered
    why: str = ""  # what the task is there for
    options: Mapping[str, Any] = field(
        default_factory=dict
    )  # keywords of the environment, `sea` among them
    # shipped model of the ship that is steered, if not `model`; contestants are not
    # told
    behind: str = ""
    far: Mapping[str, Any] = field(
        default_factory=dict
    )  # keywords that differ in the episodes, and `gear`
    on: str = "ship"  # which of `SETS`
    base: str = ""  # name of the task that contestants are made for, if another

    def __post_init__(self) -> None:
        check_choice(self.environment, ENVIRONMENTS, f"task '{self.name}': environment")
        shown, steered = (
            task.observed(ship) for ship, task, _ in (self.parts, self.sailed)
        )
        for one, other in zip(shown, steered, strict=True):
            if (one.name, one.scale) != (other.name, other.scale):
                raise InputError(
                    f"task '{self.name}': ship: '{one.name}' of '{self.behind}' is"
                    f" shown in units of {other.scale:g}, of '{self.model}' in"
                    f" {one.scale:g}; expected a ship of the same particulars"
                )

    @property
    def env_id(self) -> str:
        """Id for `gymnasium.make`; its keywords are `model` and `options`."""
        return ENVIRONMENTS[self.environment][0]

    @cached_property
    def parts(self) -> tuple[ShipModel, Task, Randomisation]:
        """Ship, task and domain randomisation of the environment."""
        return read_options(ENVIRONMENTS[self.environment][1], self.model, self.options)

    @cached_property
    def sailed(self) -> tuple[ShipModel, Task, Randomisation]:
        """The same of its episodes, which contestants are evaluated in."""
        if not (self.behind or self.far):
            return self.parts
        options = {
            name: value
            for name, value in {**self.options, **self.far}.items()
            if name != "gear"
        }
        given = ENVIRONMENTS[self.environment][1], self.behind or self.model, options
        ship, task, randomisation = read_options(*given)
        gear = SteeringGear.from_mapping(
            {**asdict(ship.steering), **self.far.get("gear", {})}, "far.gear"
        )
        return replace(ship, steering=gear), task, randomisation

    @property
    def handed_out(self) -> Self:
        """What contestants are made for: the design model, without the ship."""
        return replace(
            self, name=self.base or self.name, behind="", far={}, on="ship", base=""
        )

    @property
    def ship(self) -> ShipModel:
        """The model that contestants are made for, steered itself if there is no ship behind it."""
        return self.parts[0]

    @property
    def task(self) -> Task:
        """What is asked of the autopilot."""
        return self.parts[1]

    @property
    def seeds(self) -> Integers:
        """Of the episodes that are scored, shape (100,)."""
        return FIRST_SEED + np.arange(N_EPISODES)

    def engine(
        self, num_envs: int, model: ShipModel | None = None, threads: int = 1
    ) -> Engine:
        """Many ships at once in its episodes, by default its own ship."""
        ship, task, randomisation = self.sailed
        return Engine(
            ship if model is None else model,
            num_envs,
            task,
            randomisation,
            threads=threads,
        )


@dataclass(frozen=True)
class Suite:
    """Tasks on which controllers are compared."""

    name: str  # with its version: a task never changes under the same name
    tasks: tuple[BenchmarkTask, ...]  # in the order of the file

    def task(self, name: str) -> BenchmarkTask:
        """The task by its name; raises InputError for an unknown name, with the nearest known one."""
        known = {task.name: task for task in self.tasks}
        return known[check_choice(name, known, f"suite '{self.name}': task")]


def list_suites() -> list[str]:
    """Names of the shipped suites."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


@cache
def load_suite(name: str = DEFAULT_SUITE) -> Suite:
    """Read a shipped suite; raises InputError for an unknown name, or naming the field at fault."""
    return parse_suite(_suite_text(name), f"suite '{name}'")


def suite_of(task: str) -> str | None:
    """Name of the shipped suite that has a task of this name to design for; None if there is none."""
    return next((name for name in list_suites() if task in _designed_for(name)), None)


def find_task(name: str) -> BenchmarkTask:
    """What contestants of a shipped suite are made for: its task, without the ship behind the model.

    Raises InputError for an unknown name, with the nearest known one of any suite.
    """
    known = {
        one: task
        for suite in list_suites()
        for one, task in _designed_for(suite).items()
    }
    return known[check_choice(name, known, "task")]


@cache
def _designed_for(suite: str) -> dict[str, BenchmarkTask]:
    """Tasks of a suite by name, as they are handed out."""
    return {
        task.name: task.handed_out
        for task in load_suite(suite).tasks
        if task.on == "ship"
    }


def suite_hash(name: str = DEFAULT_SUITE) -> str:
    """SHA-256 of the file of a shipped suite; an InputError for an unknown name."""
    return hashlib.sha256(_suite_text(name).encode()).hexdigest()


def suite_file(name: str, what: str) -> Path:
    """A file that is kept with a shipped suite, `NAME-WHAT.json`; it need not exist."""
    return FOLDER / f"{name}-{what}.json"


def _suite_text(name: str) -> str:
    check_choice(name, list_suites(), "suite")
    return (FOLDER / f"{name}.toml").read_text(encoding="utf-8")


def parse_suite(text: str, where: str) -> Suite:
    """A suite from its TOML text; raises InputError naming the field at fault."""
    content = parse_toml(text, f"{where}:")
    check_keys(content, ("name", "tasks"), where)
    tasks = check_table(content.get("tasks"), f"{where}: tasks")
    return Suite(
        check_text(content.get("name"), f"{where}: name"),
        tuple(
            task
            for name, table in tasks.items()
            for task in _sets(name, table, f"{where}: tasks.{name}")
        ),
    )


def _sets(name: str, value: Any, where: str) -> list[BenchmarkTask]:
    """A task, and if it has a ship behind its model that on the model and that far from the design."""
    task = _task(name, value, where)
    if not task.behind:
        return [task]
    far = _options(check_table(value.get("far", {}), f"{where}.far"), f"{where}.far")
    changes: dict[str, dict[str, Any]] = {
        "ship": {},
        "model": {"behind": ""},
        "far": {"far": far},
    }
    with placed(where):
        sets = [on for on in SETS if on != "far" or far]
        return [
            replace(task, name=name + SETS[on], on=on, base=name, **changes[on])
            for on in sets
        ]


def _options(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Keywords of an environment; a sea may be a table."""
    options = dict(table)
    if isinstance(options.get("sea"), Mapping):
        options["sea"] = Weather.from_dict(options["sea"], f"{where}.sea")
    return options


def _task(name: str, value: Any, where: str) -> BenchmarkTask:
    table = check_table(value, where, FIELDS)
    environment, model = (
        check_text(table.get(one), f"{where}.{one}") for one in ("environment", "model")
    )
    data_only(table, where)
    sea = {"sea": table["sea"]} if "sea" in table else {}
    options = _options(
        {**check_table(table.get("options", {}), f"{where}.options"), **sea}, where
    )
    behind = check_text(table["ship"], f"{where}.ship") if "ship" in table else ""
    if table.get("far") and not behind:
        raise InputError(
            f"{where}.far: found without a ship, expected `ship`, the one behind the"
            " model"
        )
    with placed(where):
        return BenchmarkTask(
            name, environment, model, table.get("why", ""), options, behind
        )
