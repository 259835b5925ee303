"""Episodes in plain Python, which look at what a task's and a sensor set's functions give."""

from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

from shipgym.engine import episodes
from shipgym.engine.compiling import plain
from shipgym.engine.motion import Motion
from shipgym.engine.records import Record, field_types, is_record
from shipgym.engine.specialise import Part, Specialisation
from shipgym.engine.voyages import Voyages
from shipgym.errors import InputError
from shipgym.python_files import asked, place_of
from shipgym.tasks.contract import Readings


def plain_loop(made: Voyages, parts: Mapping[str, Part] | None = None) -> Any:
    """The loop `Voyages.run` in plain Python, `parts` in place of its own.

    What a function of the task or of the sensor set raises, or gives in another form
    than the contract asks, is an InputError that names file, line and function.
    """
    task = made.task
    forms = {
        "task_begin": (Motion, task.State),
        "task_step": (task.State, task.Reward, bool, bool),
        "observe": task.Observation,
        "due": bool,
        "on_event": task.State,
        "worst_cost": float,
        "measure": made.sensors.Memory,
        "readings": Readings,
    }
    looked_at = {name: _looked_at(made, name, form) for name, form in forms.items()}
    run = plain(episodes.run, {**made.parts, **looked_at, **(parts or {})})
    return np.errstate(all="ignore")(
        run
    )  # words of random numbers overflow, as they do when compiled


def _looked_at(made: Voyages, name: str, form: Any) -> Part:
    function = Specialisation(made.parts, "plain", None).copy(made.parts[name].function)
    own = function.__globals__.get(
        "reward_of_another", function
    )  # what differs from the task's step

    def look(*arguments: Any) -> Any:
        given = asked(function, *arguments)
        if fault := _fault(given, form, "what it returns"):
            fault = (
                fault
                if own is function
                else fault.replace("result 2", "what it returns")
            )  # of a reward
            raise InputError(f"{place_of(own)}: {fault}")
        return given

    return Part(look, code=lambda: None, key=name)


def _fault(given: Any, form: Any, name: str) -> str:
    """Where something differs from a record, a number (float), a truth value (bool) or a tuple of these."""
    if isinstance(form, tuple):
        if isinstance(given, tuple) and len(given) == len(form):
            each = enumerate(zip(given, form, strict=True), start=1)
            faults = (_fault(one, kind, f"result {k}") for k, (one, kind) in each)
            return next(filter(None, faults), "")
    elif is_record(form):
        if type(given) is form:
            record: Record = form
            faults = (
                _fault(
                    one, kind if is_record(kind) else float, f"{form.__name__}.{field}"
                )
                for one, (field, kind) in zip(
                    given, field_types(record).items(), strict=True
                )
            )
            return next(filter(None, faults), "")
    elif isinstance(given, np.bool_ | (Integral if form is bool else Real)):
        return ""
    return f"{name} is {_words(given)}, expected {_words(form)}"


def _words(given: Any) -> str:
    """Types by their names."""
    if type(given) is tuple:
        return f"({', '.join(map(_words, given))})"
    kind = given if isinstance(given, type) else type(given)
    if issubclass(kind, bool | np.bool_):
        return "true or false"
    return (
        "a number"
        if issubclass(kind, Real)
        else "nothing"
        if given is None
        else kind.__name__
    )
