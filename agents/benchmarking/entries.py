"""Entries of a benchmark: how a controller is named, and how it is made for a task.

A controller is named, on the command line and in Python, as

    pid                   a classical controller, designed for the model of each task
    tuned-pid             the same with the settings of direct searches for the task
    ppo                   the shipped agent of the environment (agents/pretrained)
    rule                  the rule in the file of the task (shipgym.tasks.contract),
                          or the one that its suite names
    roll-damping, ...     a rule of agents.controllers.learning_rules
    runs/agent.json       a file of an agent or controller
    runs/{task}-*.json    one file for each task; several that match are runs
    my_module:factory     a function that returns a controller for a `BenchmarkTask`,
                          or a subclass of `agents.Controller`; its code is run
    my_file.py:factory    the same in a file
    name=...              any of these under another name

Runs are the unit: what searches or learns is made several times. A function that takes
`seed` is called with 0, 1, ...; of a tuned controller each search is a run.
"""

import glob
import hashlib
import inspect
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from agents.agent_file import PRETRAINED, load_agent
from agents.controllers.controller import Controller
from agents.controllers.designs import design, tuned_runs
from agents.controllers.interface import Policy, check_fits, model_hash
from agents.controllers.learning_rules import LEARNING_RULES
from agents.controllers.registry import (
    CLASSICAL,
    controller_class,
    controller_kinds,
    register_controller,
)
from agents.controllers.task_rule import TaskRule
from agents.suites.benchmark_task import BenchmarkTask
from agents.suites.environments import import_named
from agents.suites.suite import tuned_file
from shipgym import load_model
from shipgym.checks import did_you_mean, quoted
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.files import LARGEST_TENSORS, read_bytes
from shipgym.python_files import load_file

SHIPPED = "ppo"  # agents of agents/pretrained, one for each environment
RULE = "rule"  # of the task
TUNED = "tuned-"


class Made(NamedTuple):
    """Controllers of an entry for a task, one for each run, and what they took.

    Attributes
    ----------
    policies : list of Policy
    ship_steps : float
        Control intervals that ships were simulated for, mean over the runs.
    seconds : float
        Of processor, mean over the runs.
    """

    policies: list[Policy]
    ship_steps: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Entry:
    """A controller that takes part in a benchmark.

    Attributes
    ----------
    name : str
        Its name in tables and files.
    source : str, controller or callable
        A text as in the module's docstring, a controller, or a function that returns
        one for a `BenchmarkTask`.
    """

    name: str
    source: Any

    @property
    def is_text(self) -> bool:
        """Return whether another process can make it too."""
        return isinstance(self.source, str)

    def made(self, task: BenchmarkTask, runs: int = 1, budget: float = inf) -> Made:
        """Make its controllers for a task, at most so many runs.

        Raises InputError if it cannot be made for this task, observes other quantities,
        was designed on the ship that it should not know, or took more ship steps than
        the budget.
        """
        where = f"'{self.name}' on task '{task.name}'"
        given = task.design_task
        before, began = Engine.ship_steps, time.process_time()
        source = source_for(self.source, given)
        policies = _policies(source, given, runs)
        seconds = (time.process_time() - began) / len(policies)
        steps = (Engine.ship_steps - before) / len(policies)
        if self.is_text and source.startswith(TUNED):
            kind = _kind(source.removeprefix(TUNED), given)
            found = tuned_runs(kind, given, given.suite)
            steps = float(np.mean([run.get("ship_steps", 0) for run in found]))
            seconds = float(np.mean([run.get("seconds", 0.0) for run in found]))
        if steps > budget:
            raise InputError(
                f"{where}: expected at most {budget:,.0f} ship steps in making a run,"
                f" got {steps:,.0f}; search or train for less"
            )
        if source != self.source:
            where += f": has no rule(seen, ship, settings), and '{source}' does not fit"
        hidden = model_hash(load_model(task.true_ship)) if task.true_ship else None
        for policy in policies:
            check_fits(policy, given.task, given.ship, where)
            if hidden and getattr(policy, "model_sha256", "") == hidden:
                raise InputError(
                    f"{where}: expected a design on the model '{task.model}', got one"
                    f" on the ship '{task.true_ship}'"
                )
        return Made(policies, steps, seconds)

    def fingerprint(self, task: BenchmarkTask) -> dict[str, str]:
        """Return the SHA-256 of each file that it is made from for a task, by path."""
        if not self.is_text:
            return {}
        files = source_files(source_for(self.source, task), task)
        return {str(path): file_hash(path) for path in files}


def known_names() -> tuple[str, ...]:
    """Names that stand for a controller, other than files and functions."""
    named = (*controller_kinds(), SHIPPED, RULE, *LEARNING_RULES)
    return (*named, *(TUNED + kind for kind in CLASSICAL))


def names_code(text: str) -> bool:
    """Return whether a text names a function, in a module or a file."""
    module, colon, function = text.rpartition(":")
    parts = [function] if module.endswith(".py") else [*module.split("."), function]
    return bool(colon) and all(part.isidentifier() for part in parts)


def file_hash(path: str | Path) -> str:
    """Return the SHA-256 of a file; raises InputError if it cannot be read."""
    content = read_bytes(Path(path), "file", LARGEST_TENSORS)
    return hashlib.sha256(content).hexdigest()


def read_entries(controllers: Any) -> tuple[Entry, ...]:
    """Read what a user gave as controllers.

    Raises InputError for an unknown one, with the nearest known, or two of one name.

    Parameters
    ----------
    controllers : str, sequence or mapping
        Texts, several in one separated by commas; entries; controllers; functions; or
        any of these by name.
    """
    if isinstance(controllers, str):
        controllers = controllers.split(",")
    elif hasattr(controllers, "predict") or not isinstance(controllers, Iterable):
        controllers = [controllers]
    named = [_named(one) for one in controllers]
    if isinstance(controllers, Mapping):
        named = [(str(name), source) for name, source in controllers.items()]

    entries = {}
    for name, source in named:
        if not name or name in entries:
            raise InputError(
                "controllers: expected different names before '=', got"
                f" '{name}' {'twice' if name else ''}; name one of them: other={name}"
            )
        if isinstance(source, str):
            _check_text(source)
        else:
            _check_object(source, name)
        entries[name] = Entry(name, source)
    if not entries:
        raise InputError("controllers: expected at least one, got none")
    return tuple(entries.values())


def _named(given: Any) -> tuple[str, Any]:
    """Name and source of an entry that was given without a mapping."""
    if isinstance(given, Entry):
        return given.name, given.source
    if isinstance(given, str):
        name, _, source = (part.strip() for part in given.partition("="))
        return name, source or name
    # an object is known by its name, a function by its own, others by their class
    kind = type(given).__name__
    own = getattr(given, "name", None)
    if not own:
        own = getattr(given, "__name__", kind)
    return str(own), given


def _check_text(text: str) -> None:
    """Refuse a text that names no controller, function or file."""
    known = known_names()
    if text in known or "{task}" in text:
        return
    if names_code(text):
        _imported(text)
    elif text.endswith(".py"):
        raise InputError(
            f"controllers: expected {text}:function, which makes a controller for a"
            f" task, got '{text}'"
        )
    else:
        files = _matching_files(text)
        if not files:
            raise InputError(
                f"controllers: expected one of {quoted(known)}, an existing file of an"
                f" agent, or module:function, got '{text}'.{did_you_mean(text, known)}"
            )
        for file in files:
            load_agent(file)


def _check_object(source: Any, name: str) -> None:
    """Refuse an object that is neither a controller nor a function."""
    is_policy = callable(getattr(source, "predict", None))
    if not is_policy and not callable(source):
        raise InputError(
            f"controllers: '{name}': expected a controller (with `predict`), a function"
            f" that makes one for a task, or a text such as 'pid', got {source!r}"
        )


def source_for(source: Any, task: BenchmarkTask) -> Any:
    """Return a source; of the rule of a task whose file has none, the suite's."""
    is_suites = source == RULE and task.task.definition.rule is None
    return task.rule if is_suites else source


def _policies(source: Any, task: BenchmarkTask, runs: int) -> list[Policy]:
    """Make the controllers of a source for a design task."""
    if not isinstance(source, str):
        return _runs(source, task, runs)
    if names_code(source):
        return _runs(_imported(source), task, runs)
    if source == RULE:
        return [TaskRule(task.task, task.ship)]
    if source in LEARNING_RULES:
        names = [shown.name for shown in task.task.observed(task.ship)]
        return [LEARNING_RULES[source](names)]
    if source in controller_kinds():
        return [design(_kind(source, task), task)]
    if source.startswith(TUNED):
        kind = _kind(source.removeprefix(TUNED), task)
        found = tuned_runs(kind, task, task.suite)[:runs]
        return [design(kind, task, run["settings"]) for run in found]

    files = source_files(source, task)
    if not files:
        raise InputError(f"there is no file of '{source}' for task '{task.name}'")
    return [load_agent(path) for path in files]


def _runs(source: Any, task: BenchmarkTask, runs: int) -> list[Policy]:
    """Make the runs of a policy, a function or a class of controllers."""
    is_policy = hasattr(source, "predict")
    if is_policy or "seed" not in inspect.signature(source).parameters:
        return [_policy(source, task)]
    return [_policy(partial(source, seed=seed), task) for seed in range(runs)]


def _policy(source: Any, task: BenchmarkTask) -> Policy:
    """Return a policy itself, what a function makes, or a class of controllers'."""
    policy = source
    if isinstance(source, type) and issubclass(source, Controller):
        policy = design(register_controller(source).kind, task)
    elif not hasattr(source, "predict"):
        policy = source(task)
    if not callable(getattr(policy, "predict", None)):
        name = getattr(source, "__name__", source)
        raise InputError(
            f"{name}: expected a controller with `predict` for task '{task.name}', got"
            f" {policy!r}"
        )
    return policy  # type: ignore[no-any-return]


def _kind(kind: str, task: BenchmarkTask) -> str:
    """Kind of controller; without a path, the LQ that guidance leads."""
    leads = controller_class(kind).has_autopilot
    return "lq" if leads and not task.task.follows_path else kind


def _imported(text: str) -> Any:
    """Import the function or class that a text names."""
    holder = _module(text)
    _, _, name = text.rpartition(":")
    if not hasattr(holder, name):
        raise InputError(
            f"controllers: expected a function or class of {holder.__file__}, got"
            f" '{name}'.{did_you_mean(name, vars(holder))}"
        )
    found = getattr(holder, name)
    _check_object(found, text)
    return found


def _module(text: str) -> ModuleType:
    """Import the module or file that a function is named in."""
    module, _, _ = text.rpartition(":")
    if module.endswith(".py"):
        return load_file(Path(module))
    return import_named(module, text, "controllers")


def source_files(text: str, task: BenchmarkTask) -> list[Path]:
    """Files from which a text's controllers are made for a task, in order."""
    if names_code(text):
        return [Path(str(_module(text).__file__))]
    kept = {SHIPPED: PRETRAINED / f"{task.environment}-{text}.json"}
    if text.startswith(TUNED):
        kept[text] = tuned_file(task.suite)
    if text in known_names():
        path = kept.get(text)
        return [path] if path and path.is_file() else []
    return _matching_files(text.replace("{task}", task.name))


def _matching_files(pattern: str) -> list[Path]:
    paths = [Path(path) for path in sorted(glob.glob(pattern))]  # noqa: PTH207 - whole paths
    return [path for path in paths if path.is_file()]
