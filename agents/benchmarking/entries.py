"""Entries of a benchmark: how a controller is named, and how it is made for a task.

A controller is named, on the command line and in Python, as

    pid                   a classical controller, designed for the model of each task
    tuned-pid             the same with the settings of direct search for the task
    tuned-best            of these, the one with the lowest cost in each task
    ppo                   the shipped agent of the environment (agents/pretrained)
    rule                  the rule in the file of the task (shipgym.tasks.contract)
    runs/agent.json       a file of an agent or controller
    runs/{task}-*.json    one file for each task; several that match are training runs
    my_module:factory     a function that returns a controller for a `BenchmarkTask`,
                          or a subclass of `agents.Controller`; its code is run
    name=...              any of these under another name
"""

import glob
import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents.agent_file import PRETRAINED, load_agent
from agents.controllers.controller import Controller
from agents.controllers.designs import design, tuned
from agents.controllers.interface import Policy, check_fits, model_hash
from agents.controllers.registry import (
    CLASSICAL,
    controller_class,
    controller_kinds,
    register_controller,
)
from agents.controllers.task_rule import TaskRule
from agents.suites.suite import BenchmarkTask
from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_TENSORS, read_bytes
from shipgym.python_files import working_folder

SHIPPED = "ppo"  # agents of agents/pretrained, one for each environment
RULE = "rule"  # of the task's own file
TUNED = "tuned-"


@dataclass(frozen=True, eq=False)
class Entry:
    """A controller that takes part in a benchmark.

    Attributes
    ----------
    name : str
        Its name in tables and files.
    source : str, controller, callable or sequence
        A text as in the module's docstring, a controller, a function that returns one
        for a `BenchmarkTask`, or several of the latter two, each a training run.
    """

    name: str
    source: Any

    @property
    def is_text(self) -> bool:
        """Return whether another process can make it too."""
        return isinstance(self.source, str)

    @property
    def is_code(self) -> bool:
        """Return whether it is `module:function`, whose code is run."""
        return self.is_text and names_code(self.source)

    @property
    def is_file(self) -> bool:
        """Return whether it is read from files that the user names."""
        return self.is_text and not self.is_code and self.source not in known_names()

    def policies(self, task: BenchmarkTask) -> list[Policy]:
        """Make its controllers for a task, one for each training run.

        Raises InputError if it cannot be made for this task, observes other quantities,
        or was designed on the ship that it should not know.
        """
        where = f"'{self.name}' on task '{task.name}'"
        given = task.design_task
        policies = _policies(self.source, given)
        for policy in policies:
            check_fits(policy, given.task, given.ship, where)
            if task.true_ship and _holds(policy, model_hash(task.evaluation.ship)):
                raise InputError(
                    f"{where}: expected a design on the model '{task.model}', got one"
                    f" on the ship '{task.true_ship}'"
                )
        return policies

    def fingerprint(self, task: BenchmarkTask) -> dict[str, str]:
        """Return the SHA-256 of each file that it is made from for a task, by path."""
        if not self.is_text:
            return {}
        return {str(path): file_hash(path) for path in source_files(self.source, task)}


def known_names() -> tuple[str, ...]:
    """Names that stand for a controller, other than files and functions."""
    tuned_names = [TUNED + kind for kind in ("best", *CLASSICAL)]
    return (*controller_kinds(), SHIPPED, RULE, *tuned_names)


def names_code(text: str) -> bool:
    """Return whether a text names a function, `module:function`."""
    module, colon, function = text.rpartition(":")
    parts = [*module.split("."), function]
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
    entries: dict[str, Entry] = {}
    for entry in _each_entry(controllers):
        name = entry.name
        if name in entries:
            raise InputError(
                f"controllers: expected different names, got '{name}' twice; name one"
                f" of them: other={name}"
            )
        entries[name] = entry
    if not entries:
        raise InputError("controllers: expected at least one, got none")
    return tuple(entries.values())


def check_agents(entry: Entry, tasks: Sequence[BenchmarkTask]) -> None:
    """Refuse files of agents that cannot be read or fit none of the tasks.

    Called before anything is run. Raises InputError naming the file.
    """
    if not entry.is_file:
        return
    refusals = []
    for task in tasks:
        try:
            entry.policies(task)
        except InputError as error:
            refusals.append(error)
        else:
            return
    raise InputError(
        f"controllers: '{entry.name}' fits none of the tasks: {refusals[0]}"
    )


def _each_entry(controllers: Any) -> Iterator[Entry]:
    if isinstance(controllers, Mapping):
        for name, source in controllers.items():
            yield _named(str(name), source)
        return
    if isinstance(controllers, str):
        controllers = controllers.split(",")
    elif hasattr(controllers, "predict") or not isinstance(controllers, Iterable):
        controllers = [controllers]
    for given in controllers:
        yield _read_entry(given)


def _read_entry(given: Any) -> Entry:
    if isinstance(given, Entry):
        return given
    if isinstance(given, str):
        name, equals, source = given.partition("=")
        if equals:
            return _named(name.strip(), source.strip())
        text = given.strip()
        return _named(_short_name(text), text)

    # an object is known by its name, a function by its own, others by their class
    own_name: Any = getattr(given, "name", None)
    if not own_name:
        own_name = getattr(given, "__name__", type(given).__name__)
    return _named(str(own_name), given)


def _named(name: str, source: Any) -> Entry:
    if not name:
        raise InputError("controllers: expected a name before '=', got none")
    if isinstance(source, str):
        _check_text(source)
        return Entry(name, source)
    runs = source if isinstance(source, Sequence) else [source]
    for run in runs:
        _check_object(run, name)
    return Entry(name, source)


def _short_name(text: str) -> str:
    """Name of an entry that was given without one."""
    if names_code(text):
        _, _, function = text.rpartition(":")
        return function
    if not text.endswith(".json"):
        return text
    stem = Path(text).stem
    for wildcard in ("{task}", "*"):
        stem = stem.replace(wildcard, "")
    return stem.strip("-_.") or "agent"


def _check_text(text: str) -> None:
    """Refuse a text that names no controller, function or file; nothing is run."""
    known = known_names()
    if text.endswith(".zip"):
        raise InputError(
            f"controllers: '{text}': expected a file that runs no code, got one of"
            " stable-baselines3; load it there, and write"
            " LearnedPolicy.from_sb3(agent).save('agent.json')"
        )
    if text in known or "{task}" in text:
        return
    if names_code(text):
        package, _, _ = text.partition(":")
        top, _, _ = package.partition(".")
        with working_folder():
            found = top in sys.modules or find_spec(top) is not None
        if not found:
            raise InputError(
                f"controllers: expected module:function, got '{text}', whose module"
                f" '{top}' is not found in this folder or on Python's path"
            )
    elif not _matching_files(text):
        raise InputError(
            f"controllers: expected one of {quoted(known)}, an existing file of an"
            f" agent, or module:function, got '{text}'.{did_you_mean(text, known)}"
        )


def _check_object(source: Any, name: str) -> None:
    """Refuse an object that is neither a controller nor a function."""
    is_policy = callable(getattr(source, "predict", None))
    if not is_policy and not callable(source):
        raise InputError(
            f"controllers: '{name}': expected a controller (with `predict`), a function"
            f" that makes one for a task, or a text such as 'pid', got {source!r}"
        )


def _policies(source: Any, task: BenchmarkTask) -> list[Policy]:
    """Make the controllers of a source for a design task."""
    if not isinstance(source, str):
        runs = source if isinstance(source, Sequence) else [source]
        return [_policy(run, task) for run in runs]
    if names_code(source):
        return [_policy(_imported(source), task)]
    if source == RULE:
        return [TaskRule(task.task, task.ship)]
    if source in controller_kinds():
        return [_designed(source, task)]
    if source.startswith(TUNED):
        return [tuned(source.removeprefix(TUNED), task, task.suite)]

    files = source_files(source, task)
    if not files:
        raise InputError(f"there is no file of '{source}' for task '{task.name}'")
    return [load_agent(path) for path in files]


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


def _designed(kind: str, task: BenchmarkTask) -> Policy:
    """Design a controller; without a path, the LQ that guidance leads."""
    if controller_class(kind).has_autopilot and not task.task.follows_path:
        kind = "lq"
    return design(kind, task)


def _imported(text: str) -> Any:
    """Import the function or class that a text names."""
    module, _, name = text.rpartition(":")
    try:
        with working_folder():
            found = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"controllers: expected module:function, got '{text}', which cannot be"
            f" imported ({error})"
        ) from None
    _check_object(found, text)
    return found


def _holds(policy: Any, sha256: str, depth: int = 4) -> bool:
    """Return whether a policy, or one within it, was made for a model of this hash."""
    if policy is None or depth == 0:
        return False
    if getattr(policy, "model_sha256", "") == sha256:
        return True
    inner = ("policy", "fallback", "base", "autopilot")  # that may be policies
    parts = [getattr(policy, name, None) for name in inner]
    return any(_holds(part, sha256, depth - 1) for part in parts)


def source_files(text: str, task: BenchmarkTask) -> list[Path]:
    """Files from which a text's controllers are made for a task, in order."""
    if names_code(text):
        return _module_files(text)
    if text == SHIPPED:
        agent = PRETRAINED / f"{task.environment}-{text}.json"
        return [agent] if agent.is_file() else []
    if text in known_names():
        return []
    return _matching_files(text.replace("{task}", task.design_name or task.name))


def _module_files(text: str) -> list[Path]:
    """File of the module that a function is named in; empty where it has none."""
    module, _, _ = text.rpartition(":")
    inside = Path(*module.split("."))
    candidates = (inside.with_suffix(".py"), inside / "__init__.py")
    for folder in (Path.cwd(), *map(Path, sys.path)):
        for candidate in candidates:
            if (folder / candidate).is_file():
                return [folder / candidate]
    return []


def _matching_files(pattern: str) -> list[Path]:
    paths = [Path(path) for path in sorted(glob.glob(pattern))]  # noqa: PTH207 - whole paths
    return [path for path in paths if path.is_file()]
