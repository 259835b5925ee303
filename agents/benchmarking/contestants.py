"""Who takes part in a benchmark, and how each is made for a task.

A contestant is named on the command line as

    pid                        a classical controller, designed for each task's ship
    with `from_model` tuned-pid                  the same with the settings that direct
    search found for each task of the suite tuned-best                 of these the one
    that costs least in each task best-known                 the lowest cost that
    anything reached in each episode, kept with the suite ppo                        the
    pretrained agents of `agents/pretrained` runs/agent.json            a file of an
    agent or controller runs/model.zip             an agent as stable-baselines3 saves
    it runs/{task}-ppo-*.json     one for each task; several that match are training
    runs of one contestant a.json+b.json              training runs, one by one
    my_module:factory          your own function: given a `BenchmarkTask`, it returns a
    controller my_module:Mine             your own class, a subclass of
    `agents.Controller` name=...                   any of these under another name

What a file of results names so is made again by name, or from files that have the
hashes in it; code only where the user names it too (`remade`).
"""

import glob
import hashlib
import json
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

from agents.agent_file import load_agent
from agents.controllers.controller import Controller, Policy, model_hash
from agents.controllers.designs import CLASSICAL, design, tuned
from agents.controllers.registry import (
    controller_class,
    controller_kinds,
    register_controller,
)
from agents.jobs import working_folder
from agents.policies.sb3_zip import read_sb3
from agents.rollouts.rollout import check_fits
from agents.suites.suite import BenchmarkTask
from shipgym.checks import check_table, check_text, did_you_mean, quoted
from shipgym.errors import InputError
from shipgym.files import LARGEST_TENSORS, read_bytes

LEARNED = ("ppo", "sac", "td3", "tqc")
TUNED = "tuned-"
BEST_KNOWN = "best-known"
PARTS = (
    "policy",
    "fallback",
    "base",
    "autopilot",
)  # attributes of a policy that are policies
MOST_PARTS = 1000


@dataclass(frozen=True, eq=False)
class Contestant:
    """One who takes part."""

    name: str  # in tables and files
    #: a text as in the module's docstring; a controller; a factory, given a
    #: `BenchmarkTask`; or several, each a training run
    source: Any

    @property
    def is_text(self) -> bool:
        """Whether another process can make it too."""
        return isinstance(self.source, str)

    def policies(self, task: BenchmarkTask, suite: str) -> tuple[Policy, ...]:
        """Its controllers for a task, one for each training run.

        Raises InputError if it cannot be made for this task, or was made for other
        observations.
        """
        handed, where = task.handed_out, f"'{self.name}' on task '{task.name}'"
        made = tuple(_made(self.source, handed, suite))
        for policy in made:
            check_fits(policy, handed.task, handed.ship, where)
            if task.behind and model_hash(task.sailed[0]) in _models(policy):
                raise InputError(
                    f"{where}: was designed on the ship, '{task.behind}', expected on"
                    f" the model that it is handed, '{task.model}'"
                )
        return made

    def fingerprint(self, task: BenchmarkTask) -> dict[str, str]:
        """SHA-256 of each file that it is made from for a task, by path."""
        if not self.is_text:
            return {}
        return {str(path): file_hash(path) for path in _files(self.source, task)}


def _models(policy: Any) -> set[str]:
    """Hashes of the models that a policy, and what it is made of, were made for."""
    parts, known = [policy], {id(policy)}
    for part in parts:  # which grow
        for inner in (getattr(part, name, None) for name in PARTS):
            if inner is not None and id(inner) not in known:
                known.add(id(inner))
                parts.append(inner)
        if len(parts) > MOST_PARTS:
            raise InputError(
                f"{type(policy).__name__}: more than {MOST_PARTS} policies within one"
                " another found, expected a policy made of fewer"
            )
    return {getattr(part, "model_sha256", "") for part in parts}


def remade(
    name: str,
    about: Mapping[str, Any],
    task: BenchmarkTask,
    allow_code: Collection[str],
) -> Contestant:
    """A contestant of a file of results, to run once more in a task.

    `about`: what the file says of it; `allow_code`: functions that the user names.
    Raises InputError for any other function, for files that did not take part or have
    changed since, and for an object.
    """
    if about.get("source") is None:
        raise InputError(f"'{name}' was given as an object, which results do not hold")
    source = check_text(about["source"], f"'{name}': source")
    if names_code(source) and source not in allow_code:
        raise InputError(
            f"'{source}' is code, run only if you name it: --allow-code {source}"
        )
    if names_code(source) or source in _known():
        return Contestant(name, source)
    files = check_table(about.get("files"), f"'{name}': files")
    patterns = [
        Path(one.replace("{task}", task.name)).parts for one in source.split("+")
    ]
    found = [
        path
        for pattern in patterns
        for path in sorted(files)
        if _is_like(Path(path).parts, pattern)
    ]
    for path in found:
        if not Path(path).is_file() or file_hash(path) != files[path]:
            raise InputError(f"'{path}' is not the file that took part")
    if not found:
        raise InputError(f"'{source}': no such file took part")
    return Contestant(name, "+".join(map(glob.escape, found)))


def _is_like(path: Sequence[str], pattern: Sequence[str]) -> bool:
    return len(path) == len(pattern) and all(map(fnmatchcase, path, pattern))


def check_agents(one: Contestant, tasks: Sequence[BenchmarkTask]) -> None:
    """Refuse, before anything is run, files of agents that cannot be read, or fit none of the tasks.

    Raises InputError naming the file and what is wrong with it.
    """
    if not one.is_text or names_code(one.source):
        return
    pairs = [(path, task) for task in tasks for path in _files(one.source, task)]
    agents = {path: _loaded(path) for path in {path for path, _ in pairs}}
    refusals: list[str] = []
    for path, task in pairs:
        try:
            check_fits(
                _policy(agents[path], task),
                task.task,
                task.ship,
                f"'{path}' on task '{task.name}'",
            )
        except InputError as error:
            refusals.append(str(error))
    if pairs and len(refusals) == len(pairs):
        raise InputError(
            f"controllers: '{one.name}' fits no task asked for: {refusals[0]}"
        )


def contestants(given: Any) -> tuple[Contestant, ...]:
    """Contestants from what a user gave.

    `given`: texts (several in one are separated by commas), contestants, controllers
    with a `name`; or any source by name. Raises InputError for an unknown one, with the
    nearest known; or two of one name.
    """
    if isinstance(given, Mapping):
        found = [_named(str(name), source) for name, source in given.items()]
    elif isinstance(given, str):
        found = [_contestant(text) for text in given.split(",")]
    else:
        single = hasattr(given, "predict") or not isinstance(given, Iterable)
        found = [_contestant(one) for one in ([given] if single else given)]
    if not found:
        raise InputError("controllers: none found, expected at least one")
    names = [one.name for one in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"controllers: '{name}' found twice; give one of them a name:"
                f" other={name}"
            )
    return tuple(found)


def _contestant(one: Any) -> Contestant:
    if isinstance(one, Contestant):
        return one
    if isinstance(one, str):
        text = one.strip()
        name, equals, source = text.partition("=")
        if equals:
            return _named(name.strip(), source.strip())
        _check_text(text)
        return Contestant(_short_name(text), text)
    name = (
        getattr(one, "name", None)
        or getattr(one, "__name__", None)
        or type(one).__name__
    )
    return _named(str(name), one)


def _named(name: str, source: Any) -> Contestant:
    if not name or set(name) & set(",=/{}*"):
        raise InputError(
            f"controllers: name '{name}' found, expected one without any of , = / {{"
            " } *"
        )
    if isinstance(source, str):
        _check_text(source)
    else:
        for run in source if isinstance(source, Sequence) else [source]:
            _check_object(run, name)
    return Contestant(name, source)


def _check_object(source: Any, name: str) -> None:
    if not callable(getattr(source, "predict", None)) and not callable(source):
        raise InputError(
            f"controllers: '{name}' is {source!r}, expected a controller (with"
            " `predict`), a function that makes one for a task, or a text such as"
            " 'pid'"
        )


def _known() -> tuple[str, ...]:
    """Names of contestants."""
    searched = (TUNED + kind for kind in ("best", *CLASSICAL))
    return (*controller_kinds(), *LEARNED, BEST_KNOWN, *searched)


def _check_text(text: str) -> None:
    """Refuse what is neither a name, nor a file, nor a function."""
    known = _known()
    if names_code(text):
        _factory(text)
    elif (
        text not in known
        and "{task}" not in text
        and not all(map(_matches, text.split("+")))
    ):
        raise InputError(
            f"controllers: '{text}' found, expected one of {quoted(known)}, a file of"
            f" an agent that is there, or module:function.{did_you_mean(text, known)}"
        )


def _short_name(text: str) -> str:
    if names_code(text):
        return text.rpartition(":")[2]
    if text.endswith((".json", ".zip")):
        stem = (
            Path(text.split("+")[0])
            .stem.replace("{task}", "")
            .replace("*", "")
            .strip("-_.")
        )
        return stem or "agent"
    return text


def names_code(text: str) -> bool:
    """Whether a text names a function, `module:function`."""
    module, colon, function = text.rpartition(":")
    return (
        bool(colon)
        and function.isidentifier()
        and all(part.isidentifier() for part in module.split("."))
    )


def _factory(text: str) -> Any:
    """The function that a text names; modules of the working folder are found."""
    module, _, function = text.rpartition(":")
    try:
        with working_folder():
            found = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"controllers: '{text}' cannot be imported ({error}); expected"
            " module:function"
        ) from None
    if isinstance(found, type) and issubclass(found, Controller):
        return partial(design, register_controller(found).kind)
    _check_object(found, text)
    return found


def _matches(pattern: str) -> list[Path]:
    return [Path(path) for path in sorted(glob.glob(pattern)) if Path(path).is_file()]  # noqa: PTH207 - whole paths


def _files(text: str, task: BenchmarkTask) -> list[Path]:
    """Files from which a contestant is made for a task."""
    name = task.handed_out.name
    if text in LEARNED:
        return pretrained(name, text)
    if names_code(text):
        source = getattr(sys.modules.get(text.rpartition(":")[0]), "__file__", None)
        return [Path(source)] if source else []
    if text in controller_kinds() or text == BEST_KNOWN or text.startswith(TUNED):
        return []
    return [
        path
        for one in text.split("+")
        for path in _matches(one.replace("{task}", name))
    ]


def pretrained(task: str, algorithm: str) -> list[Path]:
    """Files of the agents trained for a task: `TASK-ALGO.json`, or one for each run, `TASK-ALGO-RUN.json`."""
    folder = Path(str(files("agents").joinpath("pretrained")))
    name = f"{glob.escape(str(folder / task))}-{algorithm}"
    return [*_matches(f"{name}.json"), *_matches(f"{name}-*.json")]


def _made(source: Any, task: BenchmarkTask, suite: str) -> list[Policy]:
    if not isinstance(source, str):
        return [
            _policy(run, task)
            for run in (source if isinstance(source, Sequence) else [source])
        ]
    if source in controller_kinds():
        led = controller_class(source).has_autopilot and not task.task.follows_path
        return [design("lq" if led else source, task)]
    if source.startswith(TUNED):
        return [tuned(source.removeprefix(TUNED), task, suite)]
    if names_code(source):
        with working_folder():
            return [_policy(_factory(source), task)]
    paths = _files(source, task)
    if not paths:
        what = f"a pretrained {source} agent" if source in LEARNED else f"'{source}'"
        raise InputError(f"there is no file of {what} for task '{task.name}'")
    return [_policy(_loaded(path), task) for path in paths]


def _loaded(path: Path) -> Any:
    """A policy, or, of a zip, a function that makes it for a task."""
    if path.suffix == ".zip":
        zipped = read_sb3(path)
        return lambda task: zipped.policy(task.task, task.ship)
    return load_agent(path)


def _policy(source: Any, task: BenchmarkTask) -> Policy:
    """A policy itself, or what a function makes of a task."""
    made: Policy = source if hasattr(source, "predict") else source(task)
    if not callable(getattr(made, "predict", None)):
        raise InputError(
            f"{getattr(source, '__name__', source)}: {made!r} found for task"
            f" '{task.name}', expected a controller with `predict`"
        )
    return made


def file_hash(path: str | Path) -> str:
    """SHA-256 of a file; raises InputError if it cannot be read."""
    return hashlib.sha256(read_bytes(Path(path), "file", LARGEST_TENSORS)).hexdigest()


def policy_hash(policy: Policy) -> str | None:
    """SHA-256 of what the file of a controller would hold; None for one that has no file."""
    if not isinstance(policy, Controller):
        return None
    try:
        content = policy.to_dict()
    except (AttributeError, InputError):  # guidance over a user's own autopilot
        return None
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
