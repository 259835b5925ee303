"""Functions of a task that leave out arguments, completed to the full list.

`step`, `observe`, `due` and `reward` are called with all arguments of a moment, and
with the `EXTRAS`. A function that names only some of those is wrapped by one of the
functions here, whose hook `partial_function` is filled by it.
"""

from collections.abc import Sequence
from functools import cache
from types import FunctionType
from typing import Any

#: Arguments that a function may name behind the required ones, in any order.
EXTRAS = ("random", "plan")


#: Last of the required arguments of such a function.
LAST_REQUIRED = ("interval", "ship", "settings")


def takes_extras(arguments: Sequence[str]) -> bool:
    """Return whether a function of these arguments may name extras behind them."""
    return tuple(arguments[-len(LAST_REQUIRED) :]) == LAST_REQUIRED


def partial_function(*arguments: Any) -> Any:
    """Hook: the function that is wrapped."""
    raise NotImplementedError("filled by `completed`")


def without_extras(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    random: Any,
    plan: Any,
) -> Any:
    """Call a function that takes neither random numbers nor the plan."""
    return partial_function(moment, state, interval, ship, settings)


def with_random(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    random: Any,
    plan: Any,
) -> Any:
    """Call a function that takes random numbers."""
    return partial_function(moment, state, interval, ship, settings, random)


def with_plan(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    random: Any,
    plan: Any,
) -> Any:
    """Call a function that takes the plan."""
    return partial_function(moment, state, interval, ship, settings, plan)


def with_plan_first(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    random: Any,
    plan: Any,
) -> Any:
    """Call a function that takes the plan and random numbers, in this order."""
    return partial_function(moment, state, interval, ship, settings, plan, random)


WRAPPERS = {
    (): without_extras,
    ("random",): with_random,
    ("plan",): with_plan,
    ("plan", "random"): with_plan_first,
}


def extras_of(function: Any) -> tuple[str, ...]:
    """Names of the extra arguments that a function of a moment takes."""
    code = function.__code__
    required = 5  # those of a moment
    names: tuple[str, ...] = code.co_varnames[required : code.co_argcount]
    return names


@cache
def completed(function: Any) -> Any:
    """Return a function of a moment that takes all extra arguments."""
    wrapper = WRAPPERS.get(extras_of(function))
    if wrapper is None:
        return function
    hooks = {"__name__": __name__, "partial_function": function}
    return FunctionType(wrapper.__code__, hooks, wrapper.__name__)


def innermost(function: Any) -> Any:
    """Return the function that a completed one wraps, or itself."""
    return function.__globals__.get("partial_function", function)
