"""Entries of a benchmark: how a controller is named, and how it is made for a task.

A controller is named, on the command line and in Python, as

    pid                   a classical controller, designed for the model of each task
    tuned-pid             the same with the settings of direct search for the task
    tuned-best            of these, the one with the lowest cost in each task
    best-known            the lowest known cost of each episode, kept with the suite
    ppo                   the pretrained agents of agents/pretrained
    runs/agent.json       a file of an agent or controller
    runs/model.zip        an agent as stable-baselines3 saves it
    runs/{task}-*.json    one file for each task; several that match are training runs
    a.json+b.json         training runs, file by file
    my_module:factory     a function that returns a controller for a `BenchmarkTask`,
                          or a subclass of `agents.Controller`; its code is run
    name=...              any of these under another name
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.benchmarking.sources import (
    Source,
    check_module,
    check_object,
    file_hash,
    known_names,
    load_source,
    make_policies,
    make_policy,
    matching_files,
    names_code,
    source_files,
)
from agents.controllers.interface import Policy, check_fits, model_hash
from agents.suites.suite import BenchmarkTask
from shipgym.checks import did_you_mean, quoted
from shipgym.errors import InputError


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

    def policies(self, task: BenchmarkTask) -> tuple[Policy, ...]:
        """Make its controllers for a task, one for each training run.

        Raises InputError if it cannot be made for this task, observes other quantities,
        or was designed on the ship that it should not know.
        """
        where = f"'{self.name}' on task '{task.name}'"
        design = task.design_task
        policies = make_policies(self.source, design)
        for policy in policies:
            check_fits(policy, design.task, design.ship, where)
            if task.true_ship:
                _check_design(design_hashes(policy), task, where)
        return tuple(policies)

    def fingerprint(self, task: BenchmarkTask) -> dict[str, str]:
        """Return the SHA-256 of each file that it is made from for a task, by path."""
        if not self.is_text:
            return {}
        return {str(path): file_hash(path) for path in source_files(self.source, task)}


def _check_design(hashes: Collection[str], task: BenchmarkTask, where: str) -> None:
    """Refuse a policy that was designed on the ship behind a task's model."""
    true_ship = task.evaluation.ship
    if model_hash(true_ship) in hashes:
        raise InputError(
            f"{where}: expected a design on the model '{task.model}', got one on the"
            f" ship '{task.true_ship}'"
        )


def design_hashes(policy: Policy) -> set[str]:
    """Hashes of the models that a policy and the policies within it were made for."""
    hashes = set()
    visited: set[int] = set()
    waiting: list[Any] = [policy]
    # Attributes of a policy that may be policies themselves, and how many are looked
    # at.
    inner_policies = ("policy", "fallback", "base", "autopilot")
    most_inner_policies = 1000
    while waiting:
        part = waiting.pop()
        if part is None or id(part) in visited:
            continue
        visited.add(id(part))
        if len(visited) > most_inner_policies:
            raise InputError(
                f"{type(policy).__name__}: expected a policy made of at most"
                f" {most_inner_policies} policies, got more"
            )

        hashes.add(getattr(part, "model_sha256", ""))
        for name in inner_policies:
            waiting.append(getattr(part, name, None))
    return hashes


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


def _each_entry(controllers: Any) -> Iterator[Entry]:
    if isinstance(controllers, Mapping):
        for name, source in controllers.items():
            yield _named(str(name), source)
    else:
        for given in _as_list(controllers):
            yield _read_entry(given)


def _as_list(controllers: Any) -> list[Any]:
    if isinstance(controllers, str):
        return controllers.split(",")
    is_policy = hasattr(controllers, "predict")
    if is_policy or not isinstance(controllers, Iterable):
        return [controllers]
    return list(controllers)


def _read_entry(given: Any) -> Entry:
    if isinstance(given, Entry):
        return given
    if isinstance(given, str):
        name, equals, source = given.partition("=")
        if equals:
            return _named(name.strip(), source.strip())
        text = given.strip()
        return Entry(_short_name(text), _checked_text(text))

    # an object is known by its name, a function by its own, others by their class
    own_name: Any = getattr(given, "name", None)
    if not own_name:
        own_name = getattr(given, "__name__", type(given).__name__)
    return _named(str(own_name), given)


def _named(name: str, source: Any) -> Entry:
    not_in_names = ",=/{}*"
    forbidden = set(name) & set(not_in_names)
    if not name or forbidden:
        raise InputError(
            f"controllers: expected a name without any of {' '.join(not_in_names)}, got"
            f" '{name}'"
        )
    if isinstance(source, str):
        return Entry(name, _checked_text(source))
    runs = source if isinstance(source, Sequence) else [source]
    for run in runs:
        check_object(run, name)
    return Entry(name, source)


def _short_name(text: str) -> str:
    """Name of an entry that was given without one."""
    if names_code(text):
        _, _, function = text.rpartition(":")
        return function
    if not text.endswith((".json", ".zip")):
        return text
    first_file, _, _ = text.partition("+")
    stem = Path(first_file).stem
    for wildcard in ("{task}", "*"):
        stem = stem.replace(wildcard, "")
    return stem.strip("-_.") or "agent"


def _checked_text(text: str) -> str:
    """Return a text that names a known controller, a function, or files."""
    known = known_names()
    if text in known or "{task}" in text:
        return text
    if names_code(text):
        check_module(text)
        return text
    if not all(matching_files(pattern) for pattern in text.split("+")):
        raise InputError(
            f"controllers: expected one of {quoted(known)}, an existing file of an"
            f" agent, or module:function, got '{text}'.{did_you_mean(text, known)}"
        )
    return text


def check_agents(entry: Entry, tasks: Sequence[BenchmarkTask]) -> None:
    """Refuse files of agents that cannot be read or fit none of the tasks.

    Called before anything is run. Raises InputError naming the file.
    """
    if not entry.is_text or entry.is_code:
        return
    sources: dict[Path, Source] = {}
    refusals: list[InputError] = []
    fits_one = False
    for task in tasks:
        for path in source_files(entry.source, task):
            if path not in sources:
                sources[path] = load_source(path)
            try:
                policy = make_policy(sources[path], task)
                where = f"'{path}' on task '{task.name}'"
                check_fits(policy, task.task, task.ship, where)
                fits_one = True
            except InputError as error:
                refusals.append(error)

    if refusals and not fits_one:
        raise InputError(
            f"controllers: '{entry.name}' fits none of the tasks: {refusals[0]}"
        )
