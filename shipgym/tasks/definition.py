"""A task file as the engine takes it: read from a module, a path or a name, checked, and registered."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, get_args

import numpy as np

from shipgym.checks import check_keys, check_number, check_whole, did_you_mean, quoted
from shipgym.engine.records import Record, field_types, is_list, is_record, leaves
from shipgym.errors import InputError
from shipgym.tasks.contract import Seen, Setting

RECORDS = ("Settings", "State", "Reward", "Observation")
FUNCTIONS = {
    "begin": ("ship", "settings", "random", "plan"),
    "step": ("motion", "state", "interval", "ship", "settings"),
    "observe": ("readings", "state", "interval", "ship", "settings"),
    "due": ("motion", "state", "interval", "ship", "settings"),
    "on_event": ("motion", "state", "interval", "ship", "settings", "random", "plan"),
    "worst_cost": ("settings",),
}
NEEDED = ("begin", "step", "observe")


@dataclass(frozen=True, eq=False)
class TaskDefinition:
    """Records and functions of a task (`shipgym.tasks.contract`).

    Attributes
    ----------
    name : str
        Of the task.
    source : str
        Where it was read from, for messages.
    Settings, State, Reward, Observation : type
        Its records.
    begin, step, observe, due, on_event, worst_cost : callable
        Its functions.
    reported : tuple of str
        Fields of the state that `info` has.
    episode_steps : int
        Control intervals after which an episode is truncated, by default.
    plan_length, check, listed : callable
        See the contract.
    """

    name: str
    source: str
    Settings: Record
    State: Record
    Reward: Record
    Observation: Record
    begin: Callable[..., Any]
    step: Callable[..., Any]
    observe: Callable[..., Any]
    due: Callable[..., Any]
    on_event: Callable[..., Any]
    worst_cost: Callable[..., Any]
    reported: tuple[str, ...] = ()
    episode_steps: int = 600
    plan_length: Callable[[Any], int] = lambda settings: 0
    check: Callable[[Any, Any], None] = lambda settings, model: None
    listed: Callable[[Any], Any] = np.asarray

    @cached_property
    def seen(self) -> dict[str, Seen]:
        """How each quantity is observed, by its path in `Observation`."""
        return dict(_annotated(self.Observation, Seen))

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Bounds of each setting by its keyword."""
        return dict(_keywords(self.Settings))

    @cached_property
    def flags(self) -> tuple[str, ...]:
        """Reported fields that are true or false."""
        kinds = field_types(self.State, notes=True)
        return tuple(name for name in self.reported if bool in getattr(kinds[name], "__metadata__", ()))

    @cached_property
    def reward_names(self) -> tuple[str, ...]:
        """Names of the parts of its reward."""
        return tuple(path.rpartition(".")[2] for path in leaves(self.Reward))

    def make_settings(self, options: Mapping[str, Any]) -> Any:
        """Settings by keywords, checked.

        Raises
        ------
        InputError
            For an unknown keyword, or a value out of its range.
        """
        check_keys(options, self.settings, f"{self.name} options")
        settings = _made(self.Settings, options, self.settings, self.listed)
        self.check(settings, None)
        return settings


def _annotated(record: Record, kind: type, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """What the fields of a record are annotated with, by their paths."""
    for name, hint in field_types(record, notes=True).items():
        base = get_args(hint)[0] if get_args(hint) else hint
        if is_record(base):
            yield from _annotated(base, kind, f"{prefix}{name}.")
            continue
        notes = [note for note in getattr(hint, "__metadata__", ()) if isinstance(note, kind)]
        yield prefix + name, notes[0] if notes else None


def _keywords(record: Record) -> Iterator[tuple[str, Setting]]:
    """Keywords of a record of settings: its fields, and those of records within it that have defaults."""
    for name, hint in field_types(record, notes=True).items():
        kind = get_args(hint)[0] if get_args(hint) else hint
        notes = [note for note in getattr(hint, "__metadata__", ()) if isinstance(note, Setting)]
        if is_record(kind) and kind._field_defaults:
            yield from _keywords(kind)
        else:
            yield name, notes[0] if notes else Setting("")


def _made(
    record: Record, options: Mapping[str, Any], bounds: Mapping[str, Setting], listed: Callable[[Any], Any]
) -> Any:
    """A record of settings, the given ones in place of its defaults."""
    values: dict[str, Any] = {}
    for name, hint in field_types(record).items():
        default = record._field_defaults[name]  # type: ignore[attr-defined]
        if is_record(hint) and hint._field_defaults:
            values[name] = _made(hint, options, bounds, listed)
        elif name not in options:
            values[name] = default
        elif is_list(hint):
            values[name] = _list_of_numbers(options[name], name, bounds[name], listed)
        elif is_record(hint):
            values[name] = _small_record(hint, options[name], name, bounds[name])
        else:
            values[name] = _number(options[name], name, bounds[name])
    return record(**values)


def _number(value: Any, name: str, bounds: Setting) -> float:
    if bounds.whole:
        check_whole(value, name, at_least=int(bounds.at_least or 0))
    return check_number(value, name, above=bounds.above, at_least=bounds.at_least, at_most=bounds.at_most)


def _small_record(kind: Record, value: Any, name: str, bounds: Setting) -> Any:
    names = kind._fields  # type: ignore[attr-defined]
    words = " and ".join(f"the {word}" for word in names)
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != len(names):
        raise InputError(f"{name}: {value!r} found, expected {words}")
    return kind(
        *[_number(one, f"{name}: the {word}", bounds) for one, word in zip(value, names, strict=True)]
    )


def _list_of_numbers(value: Any, name: str, bounds: Setting, listed: Callable[[Any], Any]) -> Any:
    if value is None:
        return np.zeros(0)
    numbers = np.asarray(listed(value))
    if numbers.ndim != 1:
        raise InputError(f"{name}: {value!r} found, expected a list")
    if len(numbers) == 0:
        raise InputError(f"{name}: none found, expected one at least, or None")
    return np.array([_number(one, f"{name}: number {i}", bounds) for i, one in enumerate(numbers.tolist())])


def never_due(motion: Any, state: Any, interval: Any, ship: Any, settings: Any) -> bool:
    """Of a task without events."""
    return False


def no_event(motion: Any, state: Any, interval: Any, ship: Any, settings: Any, random: Any, plan: Any) -> Any:
    """Of a task without events."""
    return state


def no_worst_cost(settings: Any) -> float:
    """Of a task in which a lost ship costs nothing more."""
    return 0.0


def read_definition(source: Any, reward: Any = None) -> TaskDefinition:
    """The task of a module, a file, or one registered by name.

    Parameters
    ----------
    source : str, Path or module
        A registered name, the path of a Python file, or a module or object with the names of the contract.
    reward : str, Path or module, optional
        Likewise, with a `Reward` and a `step` of its own, which take the place of the task's.

    Returns
    -------
    TaskDefinition

    Raises
    ------
    InputError
        If something is missing or of another form, naming it.
    """
    if isinstance(source, TaskDefinition):
        return source
    if isinstance(source, str) and source in TASKS:
        namespace: Any = (
            importlib.import_module(TASKS[source]) if isinstance(TASKS[source], str) else TASKS[source]
        )
    elif isinstance(source, str | Path) and Path(source).suffix == ".py":
        namespace = load_file(Path(source))
    elif isinstance(source, str):
        raise InputError(
            f"task: {source!r} found, expected the path of a .py file or one of {quoted(TASKS)}."
            f"{did_you_mean(source, TASKS)}"
        )
    else:
        namespace = source
    where = str(getattr(namespace, "__file__", None) or getattr(namespace, "__name__", source))
    if reward is not None:
        other = load_file(Path(reward)) if isinstance(reward, str | Path) else reward
        namespace = SimpleNamespace(**{**vars(namespace), "Reward": other.Reward, "step": other.step})
    return _definition(namespace, where)


def _definition(namespace: Any, where: str) -> TaskDefinition:
    for name in (*RECORDS, *NEEDED):
        if not hasattr(namespace, name):
            raise InputError(
                f"{where}: no {name!r} found, expected {_what(name)} (see shipgym.tasks.contract)"
            )
    for name in RECORDS:
        if not is_record(getattr(namespace, name)):
            raise InputError(f"{where}: {name} is no NamedTuple, expected {_what(name)}")
    functions: dict[str, Any] = {"due": never_due, "on_event": no_event, "worst_cost": no_worst_cost}
    functions |= {name: getattr(namespace, name) for name in FUNCTIONS if hasattr(namespace, name)}
    for name, function in functions.items():
        _check_arguments(function, name, where)
    name = getattr(namespace, "NAME", None) or Path(where).stem
    optional: dict[str, Any] = {
        key: getattr(namespace, key) for key in ("plan_length", "check", "listed") if hasattr(namespace, key)
    }
    definition = TaskDefinition(
        name=name, source=where, **{record: getattr(namespace, record) for record in RECORDS}, **functions,
        reported=tuple(getattr(namespace, "REPORTED", ())),
        episode_steps=getattr(namespace, "EPISODE_STEPS", 600), **optional,
    )  # fmt: skip
    _check_records(definition)
    return definition


def _what(name: str) -> str:
    if name in RECORDS:
        return f"a NamedTuple {name!r} of floats"
    return f"a function {name}({', '.join(FUNCTIONS[name])})"


def _check_arguments(function: Any, name: str, where: str) -> None:
    code = getattr(function, "__code__", None)
    expected = FUNCTIONS[name]
    if code is None or code.co_argcount != len(expected):
        found = f"{code.co_argcount} arguments" if code is not None else "no plain function"
        raise InputError(f"{where}: {name}: {found} found, expected {_what(name)}")


def _check_records(definition: TaskDefinition) -> None:
    where = definition.source
    for path, seen in definition.seen.items():
        if seen is None or not (np.isfinite(seen.low) and np.isfinite(seen.high) and seen.low < seen.high):
            raise InputError(
                f"{where}: Observation.{path}: no bounds found, expected "
                "Annotated[float, Seen(low, high, unit, scale)] with finite bounds"
            )
    for name in definition.reported:
        if name not in definition.State._fields:  # type: ignore[attr-defined]
            raise InputError(f"{where}: REPORTED: {name!r} found, expected fields of State")
    names = definition.reward_names
    for kind, words in (("Reward", names), ("Settings", tuple(k for k, _ in _keywords(definition.Settings)))):
        twice = [name for name in words if words.count(name) > 1]
        if twice:
            raise InputError(
                f"{where}: {kind}: two fields named {twice[0]!r} found, expected names that differ"
            )
    for name in definition.Settings._fields:  # type: ignore[attr-defined]
        if name not in definition.Settings._field_defaults:  # type: ignore[attr-defined]
            raise InputError(f"{where}: Settings.{name}: no default found, expected one")


def load_file(path: Path) -> ModuleType:
    """A Python file as a module, executed once however often it is asked for while it stays the same.

    Raises
    ------
    InputError
        If there is none, or it cannot be executed.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file, expected a Python file")
    resolved = path.resolve()
    name = f"shipgym_user_{abs(hash((str(resolved), resolved.stat().st_mtime_ns)))}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, resolved)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise InputError(f"{path}: cannot be executed: {type(error).__name__}: {error}") from error
    return module


#: Registered tasks: name to module name, or what was registered.
TASKS: dict[str, Any] = {
    "CourseKeeping": "shipgym.tasks.course_keeping",
    "PathFollowing": "shipgym.tasks.path_following",
}

__all__ = ["TASKS", "TaskDefinition", "load_file", "read_definition"]
