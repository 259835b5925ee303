"""A task file as the engine takes it: read from a module, path or name, checked, its reward replaced."""

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from shipgym.checks import (
    check_choice,
    check_number,
    check_text,
    check_whole,
    did_you_mean,
    quoted,
    shown,
)
from shipgym.engine.hooks import reward_of_another, step_of_task
from shipgym.engine.records import Record, field_types, is_record, leaves
from shipgym.engine.specialise import is_shipped
from shipgym.errors import InputError
from shipgym.python_files import asked, check_function
from shipgym.tasks.contract import Seen
from shipgym.tasks.source import (
    Configurable,
    annotated,
    check_namespace,
    keywords,
    read_source,
)

RECORDS = ("Settings", "State", "Reward", "Observation")
MOMENT = ("motion", "state", "interval", "ship", "settings")
FUNCTIONS = {
    "begin": ("ship", "settings", "random", "plan"),
    "step": MOMENT,
    "observe": ("readings", *MOMENT[1:]),
    "due": MOMENT,
    "on_event": (*MOMENT, "random", "plan"),
    "worst_cost": ("settings",),
    "plan_length": ("settings",),
    "check": ("settings", "model"),
    "listed": ("value",),
}
NEEDED = ("begin", "step", "observe")
#: What shows an observation beside the others: an environment with `roll`, or with
#: orders to the shaft.
OPTIONS = ("", "roll", "shaft", "shaft speed")
#: Names in `info` that are the engine's.
TAKEN = (
    "reward",
    "terminated",
    "truncated",
    "envelope_distance",
    "extrapolating",
    "end",
)
#: Registered tasks: name to module name.
TASKS = {
    "CourseKeeping": "shipgym.tasks.course_keeping",
    "PathFollowing": "shipgym.tasks.path_following",
}


def never_due(motion: Any, state: Any, interval: Any, ship: Any, settings: Any) -> bool:
    """Of a task without events."""
    return False


def no_event(
    motion: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    random: Any,
    plan: Any,
) -> Any:
    """Of a task without events."""
    return state


def no_worst_cost(settings: Any) -> float:
    """Of a task in which a lost ship costs nothing more."""
    return 0.0


@dataclass(frozen=True)
class TaskDefinition(Configurable):
    """Records and functions of a task, by their names in its file (`shipgym.tasks.contract`).

    Attributes
    ----------
    name : str
        Of the task.
    source : str
        Where it was read from, for messages.
    Settings, State, Reward, Observation : type
        Its records.
    begin, step, observe, due, on_event, worst_cost, plan_length, check, listed : callable
        Its functions.
    reported : tuple of str
        Fields of the state that `info` has.
    episode_steps : int
        Control intervals after which an episode is truncated, by default.
    """

    State: Record
    Reward: Record
    Observation: Record
    begin: Callable[..., Any]
    step: Callable[..., Any]
    observe: Callable[..., Any]
    due: Callable[..., Any] = never_due
    on_event: Callable[..., Any] = no_event
    worst_cost: Callable[..., Any] = no_worst_cost
    plan_length: Callable[[Any], int] = lambda settings: 0
    check: Callable[[Any, Any], None] = lambda settings, model: None
    listed: Callable[[Any], Any] = np.asarray
    reported: tuple[str, ...] = ()
    episode_steps: int = 600

    @cached_property
    def seen(self) -> dict[str, Seen]:
        """How each quantity is observed, by its path in `Observation`."""
        return _seen(self.Observation)

    @cached_property
    def flags(self) -> tuple[str, ...]:
        """Reported fields that are true or false."""
        kinds = field_types(self.State, notes=True)
        return tuple(
            name
            for name in self.reported
            if bool in getattr(kinds[name], "__metadata__", ())
        )

    @cached_property
    def reward_names(self) -> tuple[str, ...]:
        """Names of the parts of its reward."""
        return tuple(path.rpartition(".")[2] for path in leaves(self.Reward))

    @property
    def shipped(self) -> bool:
        """Whether its reward is one of the package's."""
        return is_shipped(self.Reward)

    @property
    def reward_source(self) -> str:
        """The file of its reward, for messages."""
        return str(
            getattr(sys.modules.get(self.Reward.__module__), "__file__", None)
            or self.source
        )

    def make_settings(self, options: Mapping[str, Any]) -> Any:
        """Settings by keywords; InputError for an unknown one, or a value that does not fit."""
        settings = super().make_settings(options)
        asked(self.check, settings, None)
        return settings


def _seen(record: Record, prefix: str = "") -> dict[str, Any]:
    """How the fields of a record, and of those within it, are observed, by their paths."""
    paths: dict[str, Any] = {}
    for name, kind, seen in annotated(record, Seen):
        paths |= (
            _seen(kind, f"{prefix}{name}.")
            if is_record(kind)
            else {prefix + name: seen}
        )
    return paths


#: Definitions by themselves: one that is read again is the same object, so that it is
#: looked at once.
_KNOWN: dict[TaskDefinition, TaskDefinition] = {}


def read_definition(source: Any, reward: Any = None) -> TaskDefinition:
    """The task of a module, a file, or one of the package's by name.

    Raises InputError if something is missing or of another form, naming it.

    Parameters
    ----------
    source : str, Path or module
        A name, the path of a Python file, or a module or object with the names of the
        contract.
    reward : str, Path or module, optional
        The path of a file, or a module, whose reward takes the place of the task's.
    """
    definition = (
        source if isinstance(source, TaskDefinition) else _definition(*_named(source))
    )
    if reward is not None:
        definition = _with_reward(definition, reward)
    _check_names(definition)
    return _KNOWN.setdefault(definition, definition)


def _named(source: Any) -> tuple[Any, str]:
    if isinstance(source, str) and source in TASKS:
        return read_source(importlib.import_module(TASKS[source]))
    if isinstance(source, str) and Path(source).suffix != ".py":
        raise InputError(
            f"task: {source!r} found, expected the path of a .py file or one of"
            f" {quoted(TASKS)}.{did_you_mean(source, TASKS)}"
        )
    return read_source(source)


def _definition(namespace: Any, where: str) -> TaskDefinition:
    optional = [name for name in FUNCTIONS if name not in NEEDED]
    found = check_namespace(namespace, where, RECORDS, FUNCTIONS, optional)
    reported = getattr(namespace, "REPORTED", ())
    expected = f"expected a tuple of fields of State, none of {TAKEN}"
    if not isinstance(reported, tuple | list):
        raise InputError(f"{where}: REPORTED: {shown(reported)} found, {expected}")
    for name in reported:
        if name not in found["State"]._fields or name in TAKEN:
            raise InputError(f"{where}: REPORTED: {shown(name)} found, {expected}")
    definition = TaskDefinition(
        name=check_text(getattr(namespace, "NAME", Path(where).stem), f"{where}: NAME"),
        source=where,
        reported=tuple(reported),
        episode_steps=check_whole(
            getattr(namespace, "EPISODE_STEPS", 600),
            f"{where}: EPISODE_STEPS",
            at_least=1,
        ),
        **found,
    )
    for path, seen in definition.seen.items():
        _check_seen(seen, f"{where}: Observation.{path}")
    return definition


def _check_seen(seen: Seen | None, where: str) -> None:
    if seen is None:
        raise InputError(
            f"{where}: no bounds found, expected Annotated[float, Seen(low, high, unit,"
            " scale)]"
        )
    check_number(seen.low, f"{where}: lower bound")
    check_number(seen.high, f"{where}: upper bound", above=seen.low)
    check_choice(seen.option, OPTIONS, f"{where}: option")
    check_text(seen.unit, f"{where}: unit")
    if callable(seen.scale):
        check_function(
            seen.scale, 2, f"{where}: scale", "a function of ship and settings"
        )
    else:
        check_number(seen.scale, f"{where}: scale", above=0.0)


def _check_names(definition: TaskDefinition) -> None:
    seen = tuple(path.rpartition(".")[2] for path in definition.seen)
    settings = tuple(name for name, *_ in keywords(definition.Settings))
    rewards = ("end", *definition.reward_names)
    for kind, names in (
        ("Reward", rewards),
        ("Settings", settings),
        ("Observation", seen),
    ):
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            also = "; the engine has one of that name" if twice[0] == "end" else ""
            where = definition.reward_source if kind == "Reward" else definition.source
            raise InputError(
                f"{where}: {kind}: two fields named {twice[0]!r} found, expected names"
                f" that differ{also}"
            )


#: `rewarded_step` with its places filled, one function for the same ones.
_FILLED: dict[Any, FunctionType] = {}


def rewarded_step(
    motion: Any, state: Any, interval: Any, ship: Any, settings: Any
) -> Any:
    """What the task does in an interval, and what another's reward gives for it."""
    after, _, failed, arrived = step_of_task(motion, state, interval, ship, settings)
    return (
        after,
        reward_of_another(motion, after, interval, ship, settings),
        failed,
        arrived,
    )


def _with_reward(definition: TaskDefinition, source: Any) -> TaskDefinition:
    """A task with the reward of another file: `Reward` and `reward`, or `Reward` and a whole `step`."""
    namespace, where = read_source(source)
    name = (
        "step"
        if hasattr(namespace, "step") and not hasattr(namespace, "reward")
        else "reward"
    )
    functions = {name: MOMENT, "worst_cost": ("settings",)}
    found = check_namespace(namespace, where, ("Reward",), functions, ("worst_cost",))
    if name == "reward":
        places = {
            "__name__": __name__,
            "step_of_task": definition.step,
            "reward_of_another": found.pop(name),
        }
        step = FunctionType(rewarded_step.__code__, places, "rewarded_step")
        found["step"] = _FILLED.setdefault(tuple(places.values()), step)
    return replace(definition, **found)
