"""Functions of a task that name what else they need: random numbers, the plan.

`step`, `observe`, `due` and `reward` have five arguments, and may name `EXTRAS` behind
them. Loops call them with tile and lane behind the five. Each is therefore wrapped by
a function that takes from tile and lane what it names, and nothing else: a loop is not
slower for what a task does not use.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

from shipgym.engine.hooks import load_random
from shipgym.engine.lane_records import Random
from shipgym.engine.random import interval_key
from shipgym.engine.record_code import written
from shipgym.engine.tiles import Tile, plan_of

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


#: Source that takes each from tile and lane.
_TAKEN = {
    "random": "random_of(tile, lane, interval.steps)",
    "plan": "plan_to_read(tile, lane)",
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
    given = "moment, state, interval, ship, settings"
    taken = ", ".join([given, *(f"{name}={_TAKEN[name]}" for name in extras)])
    names = {
        "random_of": random_of,
        "plan_to_read": plan_to_read,
        "wrapped_function": function,
    }
    body = [f"return wrapped_function({taken})"]
    return written("completed", f"{given}, tile, lane", body, names)


def innermost(function: Any) -> Any:
    """Return the function that a completed one wraps, or itself."""
    return function.__globals__.get("wrapped_function", function)
