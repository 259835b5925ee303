"""Sources of controllers: what a text names, and how it is made for a task."""

import glob
import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents.controllers.interface import Policy
from agents.controllers.registry import (
    CLASSICAL,
    controller_class,
    controller_kinds,
    register_controller,
)
from agents.suites.suite import BenchmarkTask
from shipgym.errors import InputError
from shipgym.files import LARGEST_TENSORS, read_bytes
from shipgym.python_files import working_folder

LEARNED = ("ppo", "sac", "td3", "tqc")
TUNED = "tuned-"
BEST_KNOWN = "best-known"

#: A policy, or a function that makes one for a task.
Source = Policy | Callable[[BenchmarkTask], Any]


def known_names() -> tuple[str, ...]:
    """Names that stand for a controller, other than files and functions."""
    tuned_names = [TUNED + kind for kind in ("best", *CLASSICAL)]
    return (*controller_kinds(), *LEARNED, BEST_KNOWN, *tuned_names)


def names_code(text: str) -> bool:
    """Return whether a text names a function, `module:function`."""
    module, colon, function = text.rpartition(":")
    parts = [*module.split("."), function]
    return bool(colon) and all(part.isidentifier() for part in parts)


def check_module(text: str) -> None:
    """Refuse a function whose module is not found; nothing of it is run."""
    package, _, _ = text.partition(":")
    top, _, _ = package.partition(".")
    with working_folder():
        known = top in sys.modules or find_spec(top) is not None
    if not known:
        raise InputError(
            f"controllers: expected module:function, got '{text}', whose module"
            f" '{top}' is not found in this folder or on Python's path"
        )


def import_code(text: str) -> Any:
    """Import the function that a text names.

    A subclass of Controller is registered, and becomes a function that designs it.
    """
    module, _, name = text.rpartition(":")
    try:
        with working_folder():
            function = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"controllers: expected module:function, got '{text}', which cannot be"
            f" imported ({error})"
        ) from None
    from agents.controllers.controller import Controller

    if isinstance(function, type) and issubclass(function, Controller):
        from agents.controllers.designs import design

        kind = register_controller(function).kind
        return partial(design, kind)
    check_object(function, text)
    return function


def check_object(source: Any, name: str) -> None:
    """Refuse an object that is neither a controller nor a function."""
    is_policy = callable(getattr(source, "predict", None))
    if not is_policy and not callable(source):
        raise InputError(
            f"controllers: '{name}': expected a controller (with `predict`), a function"
            f" that makes one for a task, or a text such as 'pid', got {source!r}"
        )


def make_policies(source: Any, task: BenchmarkTask) -> list[Policy]:
    """Make the controllers of a source for a design task."""
    if not isinstance(source, str):
        runs = source if isinstance(source, Sequence) else [source]
        return [make_policy(run, task) for run in runs]

    if names_code(source):
        return [make_policy(import_code(source), task)]
    if source in controller_kinds():
        return [_designed(source, task)]
    if source.startswith(TUNED):
        from agents.controllers.designs import tuned

        kind = source.removeprefix(TUNED)
        return [tuned(kind, task, task.suite)]
    policies = []
    for path in source_files(source, task):
        agent = load_source(path)
        policies.append(make_policy(agent, task))
    if not policies:
        is_learned = source in LEARNED
        missing = f"pretrained {source} agent" if is_learned else f"file '{source}'"
        raise InputError(f"there is no {missing} for task '{task.name}'")
    return policies


def _designed(kind: str, task: BenchmarkTask) -> Policy:
    """Design a controller; without a path, the LQ that guidance leads."""
    from agents.controllers.designs import design

    needs_path = controller_class(kind).has_autopilot
    if needs_path and not task.task.follows_path:
        kind = "lq"
    return design(kind, task)


def make_policy(source: Source, task: BenchmarkTask) -> Policy:
    """Return a policy itself, or what a function makes for a task."""
    policy: Any = source
    if not hasattr(source, "predict"):
        policy = source(task)
    if not callable(getattr(policy, "predict", None)):
        name = getattr(source, "__name__", source)
        raise InputError(
            f"{name}: expected a controller with `predict` for task '{task.name}', got"
            f" {policy!r}"
        )
    return policy  # type: ignore[no-any-return]


def load_source(path: Path) -> Source:
    """Read a policy; of a zip, a function that makes one for a task."""
    if path.suffix != ".zip":
        from agents.agent_file import load_agent

        return load_agent(path)

    from agents.policies.sb3_zip import read_sb3

    agent = read_sb3(path)
    return lambda task: agent.policy(task.task, task.ship)


def source_files(text: str, task: BenchmarkTask) -> list[Path]:
    """Files from which a text's controllers are made for a task."""
    name = task.design_name or task.name
    if text in LEARNED:
        return pretrained(name, text)
    if names_code(text):
        return module_files(text)
    if text in known_names():
        return []

    paths: list[Path] = []
    for pattern in text.split("+"):
        paths += matching_files(pattern.replace("{task}", name))
    return paths


def module_files(text: str) -> list[Path]:
    """File of the module that a function is named in; empty where it has none."""
    module, _, _ = text.rpartition(":")
    inside = Path(*module.split("."))
    candidates = (inside.with_suffix(".py"), inside / "__init__.py")
    for folder in (Path.cwd(), *map(Path, sys.path)):
        for candidate in candidates:
            if (folder / candidate).is_file():
                return [folder / candidate]
    return []


def matching_files(pattern: str) -> list[Path]:
    """Return the files that a pattern matches, in order."""
    paths = [Path(path) for path in sorted(glob.glob(pattern))]  # noqa: PTH207 - whole paths
    return [path for path in paths if path.is_file()]


def pretrained(task: str, algorithm: str) -> list[Path]:
    """Return the files of the agents trained for a task.

    TASK-ALGORITHM.json, or one for each training run, TASK-ALGORITHM-RUN.json.
    """
    from agents.agent_file import PRETRAINED

    folder = glob.escape(str(PRETRAINED))
    name = f"{folder}/{task}-{algorithm}"
    return [*matching_files(f"{name}.json"), *matching_files(f"{name}-*.json")]


def file_hash(path: str | Path) -> str:
    """Return the SHA-256 of a file; raises InputError if it cannot be read."""
    content = read_bytes(Path(path), "file", LARGEST_TENSORS)
    return hashlib.sha256(content).hexdigest()


def policy_hash(policy: Policy) -> str | None:
    """Return the SHA-256 of a controller's file; None for one that has no file."""
    from agents.controllers.controller import Controller

    if not isinstance(policy, Controller):
        return None
    try:
        content = policy.to_dict()
    except (AttributeError, InputError):  # guidance over a user's own autopilot
        return None
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
