"""Episodes in plain Python that check results of functions of task and sensors."""

from collections.abc import Callable
from functools import partial
from numbers import Integral, Real
from traceback import walk_tb
from typing import Any

import numpy as np

from shipgym.engine import episodes
from shipgym.engine.compiling import plain
from shipgym.engine.episode_program import EpisodeProgram
from shipgym.engine.motion import Motion
from shipgym.engine.records import LANES
from shipgym.engine.specialise import Specialisation
from shipgym.errors import InputError
from shipgym.python_files import asked, place_of
from shipgym.tasks.contract import Readings

#: Types of a number and of a boolean that a function returns.
KINDS: dict[Any, Any] = {bool: np.bool_ | Integral, float: np.bool_ | Real}


def plain_loop(
    program: EpisodeProgram,
    function: Callable[..., Any] = episodes.run,
) -> Any:
    """Return a loop of a program in plain Python.

    An error in a function of the task or the sensor set, or a result in another form
    than the contract's, is an InputError that names file, line and function.
    """
    task = program.task
    forms = {
        "task_begin": (Motion, task.State),
        "task_step": (task.State, task.Reward, bool, bool),
        "observe": task.Observation,
        "due": bool,
        "on_event": task.State,
        "worst_cost": float,
        "measure": program.sensors.Memory,
        "readings": Readings,
    }
    checked = {name: _checked(program, name, form) for name, form in forms.items()}
    run = plain(function, {**program.hooks, **checked})
    # words of random numbers overflow, as they do when compiled
    return np.errstate(all="ignore")(run)


def fault_of_interval(
    program: EpisodeProgram, memory: Any, tiles: int
) -> tuple[str, int]:
    """Judge the last interval again in plain Python; return the first fault and lane.

    The fault is empty if there is none.

    Parameters
    ----------
    program : EpisodeProgram
    memory : float64 array
        Of the engine; it stays as it is.
    tiles : int
        Number of tiles of lanes.
    """
    judge = plain_loop(program, episodes.judge_again)
    for number in range(tiles):
        try:
            judge(memory.copy(), number)
        except InputError as error:
            frames = [frame for frame, _ in walk_tb(error.__traceback__)]
            lane = next(
                one.f_locals["lane"] for one in frames if "lane" in one.f_locals
            )
            return str(error), LANES * number + lane
    return "", 0


def _checked(program: EpisodeProgram, name: str, form: Any) -> Callable[..., Any]:
    """Return a function of the task or the sensor set whose results are checked."""
    specialisation = Specialisation(program.hooks)
    own = program.hooks[name]
    function = specialisation.copy(own)
    # of a task with another's reward, the function that differs from its own step
    names = function.__globals__
    reward = names.get("reward_of_another")
    return partial(_result_of, function, reward, form)


def _result_of(function: Any, reward: Any, form: Any, *arguments: Any) -> Any:
    """Call a function, and refuse a result in another form."""
    # NumPy's numbers fail as Python's own do
    numbers = np.errstate(divide="raise", invalid="raise")
    with numbers:
        given = asked(function, *arguments)
    fault = _fault(given, form, "returned value")
    if fault and reward is not None:
        fault = fault.replace("result 2", "returned value")  # the reward
    if fault:
        raise InputError(f"{place_of(reward or function)}: {fault}")
    return given


def _fault(given: Any, form: Any, name: str) -> str:
    """Say where a value differs from a form; empty if it does not.

    A form is a record, float, bool, or a tuple of forms.
    """
    if not isinstance(form, tuple):
        kind = KINDS.get(form, form)
        fits = isinstance(given, kind)
    else:
        fits = type(given) is tuple and len(given) == len(form)
    if not fits:
        return f"{name}: expected {_words(form)}, got {_words(given)}"
    if isinstance(form, tuple):
        for k, part in enumerate(form):
            place = f"result {k + 1}"
            if fault := _fault(given[k], part, place):
                return fault
    return ""


def _words(given: Any) -> str:
    """Name a type, or the type of a value."""
    if given is None:
        return "nothing"
    if type(given) is tuple:
        words = [_words(item) for item in given]
        return f"({', '.join(words)})"
    kind = given if isinstance(given, type) else type(given)
    if issubclass(kind, bool | np.bool_):
        return "a boolean"
    if issubclass(kind, Real):
        return "a number"
    return kind.__name__
