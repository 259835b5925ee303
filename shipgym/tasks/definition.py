"""Definitions of tasks: read from a module, path or name, checked, rewards replaced."""

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
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
    placed,
    quoted,
    unexpected,
)
from shipgym.engine.hooks import reward_of_another, step_of_task
from shipgym.engine.records import (
    Record,
    field_types,
    is_array,
    is_record,
    members,
    short_names,
)
from shipgym.engine.source import (
    Configurable,
    annotated,
    check_namespace,
    read_source,
)
from shipgym.engine.specialise import is_shipped
from shipgym.errors import InputError
from shipgym.python_files import asked, check_function
from shipgym.tasks.contract import ObservationSpec
from shipgym.tasks.scales import STEPS_PER_LENGTH

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
    "draw": ("motion", "state", "ship", "settings"),
    "rule": ("seen", "ship", "settings"),
    "check": ("settings", "model"),
    "listed": ("value",),
}
#: Numbers of a task that have defaults, besides `EPISODE_STEPS`, with their bounds.
NUMBERS: dict[str, dict[str, Any]] = {
    "STEPS_PER_LENGTH": {"at_least": 0.2},
    "HALF_REWARD_COST": {"above": 0.0},
    "PERFECT_STEP": {"at_least": 0.0, "at_most": 1.0},
    "LOSS_HORIZON": {"at_least": 0.0},
}
#: Names in `info` that are the engine's.
TAKEN = (
    "reward",
    "terminated",
    "truncated",
    "envelope_distance",
    "extrapolating",
    "end",
    "cost",
)
#: Registered tasks: name to module name.
TASKS = {
    "CourseKeeping": "shipgym.tasks.course_keeping",
    "PathFollowing": "shipgym.tasks.path_following",
    "Encounter": "shipgym.tasks.encounter",
}


def never_due(motion: Any, state: Any, interval: Any, ship: Any, settings: Any) -> bool:
    """Default `due`: the task has no events."""
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
    """Default `on_event`: the task has no events."""
    return state


def no_worst_cost(settings: Any) -> float:
    """Default `worst_cost`: a lost ship costs nothing more."""
    return 0.0


def no_plan(settings: Any) -> int:
    """Default `plan_length`: the task has no plan."""
    return 0


def no_check(settings: Any, model: Any) -> None:
    """Default `check`: all settings fit."""


@dataclass(frozen=True)
class TaskDefinition(Configurable):
    """Records and functions of a task by their names in its file.

    `shipgym.tasks.contract` says what each is.

    Attributes
    ----------
    name : str
    source : str
        Place of the file, for messages.
    Settings, State, Reward, Observation : type
    begin, step, observe : callable
    due, on_event, worst_cost, plan_length, check, listed : callable
    draw : callable or None
        Shapes for pictures (`shipgym.tasks.shapes`).
    rule : callable or None
        Command by a rule, `rule(seen, ship, settings)`, the yardstick of agents.
    reported : tuple of str
        Fields of the state that `info` has.
    constraints : tuple of str
        Fields of the state that `info["constraints"]` has.
    episode_steps : int
        Control intervals after which an episode is truncated, by default.
    steps_per_length : float
        Control intervals in the time to travel one ship length, about, by default.
    half_reward_cost, perfect_step, loss_horizon : float
        Bounded reward: cost of a step that earns 0.5 less than one without cost, what
        that earns, and control intervals that the end of an episode stands for.
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
    plan_length: Callable[[Any], int] = no_plan
    check: Callable[[Any, Any], None] = no_check
    listed: Callable[[Any], Any] = np.asarray
    reported: tuple[str, ...] = ()
    constraints: tuple[str, ...] = ()
    episode_steps: int = 600
    steps_per_length: float = STEPS_PER_LENGTH
    half_reward_cost: float = 0.1
    perfect_step: float = 1.0
    loss_horizon: float = 100.0
    draw: Callable[..., Any] | None = None
    rule: Callable[..., Any] | None = None

    @cached_property
    def observations(self) -> dict[str, ObservationSpec]:
        """Bounds, unit and scale of each observation, by its path in `Observation`."""
        return _observations(self.Observation)

    @cached_property
    def flags(self) -> tuple[str, ...]:
        """Reported fields that are booleans."""
        kinds = field_types(self.State, notes=True)
        flags = []
        for name in self.reported:
            notes = getattr(kinds[name], "__metadata__", ())
            if bool in notes:
                flags.append(name)
        return tuple(flags)

    @cached_property
    def reward_names(self) -> tuple[str, ...]:
        """Names of the parts of its reward."""
        return tuple(short_names(self.Reward).values())

    @cached_property
    def observation_names(self) -> dict[str, str]:
        """Name of each observation by its path in `Observation`."""
        return short_names(self.Observation)

    @property
    def shipped(self) -> bool:
        """True where its reward is one of the package's."""
        return is_shipped(self.Reward)

    @property
    def reward_source(self) -> str:
        """File of its reward, for messages."""
        module = sys.modules.get(self.Reward.__module__)
        return getattr(module, "__file__", None) or self.source

    def make_settings(self, options: Mapping[str, Any]) -> Any:
        """Make settings by keywords.

        InputError for an unknown one, or a value that does not fit.
        """
        settings = super().make_settings(options)
        asked(self.check, settings, None)
        return settings


def _observations(record: Record, prefix: str = "") -> dict[str, Any]:
    """Annotations of the fields of a record, and of those within it, by their paths."""
    specs: dict[str, Any] = {}
    for name, kind, spec in annotated(record, ObservationSpec):
        specs |= _observations_at(f"{prefix}{name}", kind, spec)
    return specs


def _observations_at(path: str, kind: Any, spec: Any) -> dict[str, Any]:
    """Annotations of a field by their paths; entries of an array have the same."""
    if is_record(kind):
        return _observations(kind, f"{path}.")
    if not is_array(kind):
        return {path: spec}
    specs: dict[str, Any] = {}
    for name, entry in members(kind):
        specs |= _observations_at(f"{path}.{name}", entry, spec)
    return specs


#: Definitions, each its own key: one that is read again is the same object, so that it
#: is compiled once.
_KNOWN: dict[TaskDefinition, TaskDefinition] = {}


def read_definition(source: Any, reward: Any = None) -> TaskDefinition:
    """Read the task of a module, a file, or one of the package's by name.

    Raises InputError if something is missing or of another form, naming it.

    Parameters
    ----------
    source : str, Path or module
        A name, the path of a Python file, or a module or object with the names of the
        contract.
    reward : str, Path or module, optional
        The path of a file, or a module, whose reward replaces the task's.
    """
    known = isinstance(source, TaskDefinition)
    definition = source if known else _definition(source)
    if reward is not None:
        definition = _with_reward(definition, reward)
    return _KNOWN.setdefault(definition, definition)


def _definition(source: Any) -> TaskDefinition:
    if isinstance(source, str) and source in TASKS:
        module = importlib.import_module(TASKS[source])
        return _definition_of(module, str(module.__file__))
    if isinstance(source, str) and Path(source).suffix != ".py":
        raise InputError(
            f"task: expected the path of a .py file or one of {quoted(TASKS)}, got"
            f" {source!r}.{did_you_mean(source, TASKS)}"
        )

    namespace, where = read_source(source)
    _check_task(namespace, where)
    definition = _definition_of(namespace, where)
    for path, spec in definition.observations.items():
        _check_observation(spec, f"{where}: Observation.{path}")
    _check_names(definition)
    return definition


def _definition_of(namespace: Any, where: str) -> TaskDefinition:
    """Return the definition in a namespace, with defaults for absent names."""
    found = {}
    for name in (*RECORDS, *FUNCTIONS):
        if hasattr(namespace, name):
            found[name] = getattr(namespace, name)
    return TaskDefinition(
        name=getattr(namespace, "NAME", Path(where).stem),
        source=where,
        reported=tuple(getattr(namespace, "REPORTED", ())),
        constraints=tuple(getattr(namespace, "CONSTRAINTS", ())),
        **{
            name.lower(): getattr(namespace, name)
            for name in ("EPISODE_STEPS", *NUMBERS)
            if hasattr(namespace, name)
        },
        **found,
    )


def _check_task(namespace: Any, where: str) -> None:
    """Refuse a namespace that lacks what a task defines, or has it in another form."""
    needed = ("begin", "step", "observe")
    check_namespace(
        namespace,
        where,
        records=RECORDS,
        functions=FUNCTIONS,
        optional=[name for name in FUNCTIONS if name not in needed],
    )
    for name in ("REPORTED", "CONSTRAINTS"):
        _check_reported(namespace, name, where)
    if hasattr(namespace, "NAME"):
        check_text(namespace.NAME, f"{where}: NAME")
    if hasattr(namespace, "EPISODE_STEPS"):
        steps = namespace.EPISODE_STEPS
        check_whole(steps, f"{where}: EPISODE_STEPS", at_least=1)
    for name, limits in NUMBERS.items():
        value = getattr(namespace, name, inf)  # the horizon may be the whole episode
        if value != inf:
            check_number(value, f"{where}: {name}", **limits)


def _check_reported(namespace: Any, table: str, where: str) -> None:
    """Check which fields of a state are to be reported."""
    reported = getattr(namespace, table, ())
    where = f"{where}: {table}"
    expected = f"a tuple of fields of State, none of {TAKEN}, each a number"
    if not isinstance(reported, tuple | list):
        raise unexpected(where, expected, reported)
    kinds = field_types(namespace.State)
    for name in reported:
        if name not in kinds or name in TAKEN or members(kinds[name]):
            raise unexpected(where, expected, name)


def _check_observation(spec: ObservationSpec | None, where: str) -> None:
    if spec is None:
        raise InputError(
            f"{where}: expected Annotated[float, ObservationSpec(low, high, unit,"
            " scale)], got no bounds"
        )
    check_number(spec.low, f"{where}: lower bound")
    check_number(spec.high, f"{where}: upper bound", above=spec.low)
    # options of an environment that observations are made for
    known = ("", "roll", "shaft", "shaft speed")
    check_choice(spec.option, known, f"{where}: option")
    check_text(spec.unit, f"{where}: unit")
    where = f"{where}: scale"
    if callable(spec.scale):
        check_function(spec.scale, 2, where, "a function of ship and settings")
    else:
        check_number(spec.scale, where, above=0.0)


def _check_names(definition: TaskDefinition) -> None:
    """Refuse two fields of one name, or one of the engine's."""
    with placed(definition.source):
        short_names(definition.Observation)
    with placed(definition.reward_source):
        if "end" in definition.reward_names:
            raise InputError("Reward.end: expected another name: the engine has one")


def rewarded_step(
    motion: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
) -> Any:
    """Step of a task with the reward of another file."""
    after, _, failed, arrived = step_of_task(motion, state, interval, ship, settings)
    reward = reward_of_another(motion, after, interval, ship, settings)
    return after, reward, failed, arrived


#: `rewarded_step` with its hooks filled, one function for the same ones.
_FILLED: dict[Any, FunctionType] = {}


def _with_reward(definition: TaskDefinition, source: Any) -> TaskDefinition:
    """Replace the reward of a task by that of a file."""
    namespace, where = read_source(source)
    found = check_namespace(
        namespace,
        where,
        records=("Reward",),
        functions={"reward": MOMENT, "worst_cost": ("settings",)},
        optional=("worst_cost",),
    )
    found["step"] = _filled(definition.step, found.pop("reward"))
    rewarded = replace(definition, **found)
    _check_names(rewarded)
    return rewarded


def _filled(step: Any, reward: Any) -> FunctionType:
    """Fill the hooks of `rewarded_step`."""
    hooks = {
        "__name__": __name__,
        "step_of_task": step,
        "reward_of_another": reward,
    }
    function = FunctionType(rewarded_step.__code__, hooks, "rewarded_step")
    return _FILLED.setdefault((step, reward), function)
