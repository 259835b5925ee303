"""Functions of a task that name what else they need: random numbers, the plan.

`step`, `observe`, `due` and `reward` have five arguments, and may name `EXTRAS` behind
them. Loops call them with tile and lane behind the five. Each is therefore wrapped by
one of the functions here, which take from tile and lane what it names, and nothing
else: a loop is not slower for what a task does not use.
"""

from collections.abc import Sequence
from functools import cache
from types import FunctionType
from typing import Any

from shipgym.engine.hooks import load_random
from shipgym.engine.random import interval_key
from shipgym.engine.tiles import Tile, plan_of
from shipgym.tasks.contract import Random

#: Arguments that a function may name behind the required ones, in any order.
EXTRAS = ("random", "plan")


def takes_extras(arguments: Sequence[str]) -> bool:
    """Return whether a function of these arguments may name extras behind them."""
    last = tuple(arguments[-3:])
    return last == ("interval", "ship", "settings")


def random_of(tile: Tile, lane: int, steps: float) -> Random:
    """Return what the random numbers of one interval of a lane follow from."""
    random = load_random(tile.random, lane)
    return Random(interval_key(random.key, steps), random.episode)


def plan_to_read(tile: Tile, lane: int) -> Any:
    """Return the plan of a lane's episode."""
    return plan_of(tile.state, lane)


def wrapped_function(*arguments: Any, **extras: Any) -> Any:
    """Hook: the function that is wrapped."""
    raise NotImplementedError("filled by `completed`")


def with_nothing(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Call a function that names no extras."""
    return wrapped_function(moment, state, interval, ship, settings)


def with_random(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Call a function that names random numbers."""
    random = random_of(tile, lane, interval.steps)
    return wrapped_function(moment, state, interval, ship, settings, random)


def with_plan(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Call a function that names the plan."""
    plan = plan_to_read(tile, lane)
    return wrapped_function(moment, state, interval, ship, settings, plan)


def with_both(
    moment: Any,
    state: Any,
    interval: Any,
    ship: Any,
    settings: Any,
    tile: Tile,
    lane: int,
) -> Any:
    """Call a function that names both, in either order."""
    return wrapped_function(
        moment,
        state,
        interval,
        ship,
        settings,
        random=random_of(tile, lane, interval.steps),
        plan=plan_to_read(tile, lane),
    )


_WRAPPERS = {
    (): with_nothing,
    ("random",): with_random,
    ("plan",): with_plan,
    ("random", "plan"): with_both,
    ("plan", "random"): with_both,
}


@cache
def completed(function: Any) -> Any:
    """Wrap a function of a task, so that it is called with tile and lane."""
    code = function.__code__
    arguments = code.co_varnames[: code.co_argcount]
    required = 5
    extras = arguments[required:]
    if extras == ("tile", "lane"):  # one of the package's
        return function
    wrapper = _WRAPPERS[extras]
    hooks = {**wrapper.__globals__, "wrapped_function": function}
    return FunctionType(wrapper.__code__, hooks, wrapper.__name__)


def innermost(function: Any) -> Any:
    """Return the function that a completed one wraps, or itself."""
    return function.__globals__.get("wrapped_function", function)
