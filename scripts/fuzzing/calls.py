"""Public functions called with arguments of wrong types.

Each has to return, or to raise what its documentation names: `InputError`, and other
exceptions by their names in its docstring.
"""

from __future__ import annotations

import inspect
import math
import traceback
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from document_api import PACKAGES, names

from shipgym import example_ship, load_model
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.trials.ship_file import ShipFile

#: Values of types that somebody may give by mistake.
WRONG: tuple[Any, ...] = (
    *(None, True, 0, -1, 3, 1.5, math.nan, math.inf, 10**30),
    *("", "x", "mariner", b"x", Path("nowhere"), object()),
    *([], [1.0, 2.0], ["a"], {}, {"a": 1}, (), np.zeros(3), np.zeros((2, 2))),
)
#: Functions whose argument is another's object, or which write where they are told to,
#: and classes that do not check types of their fields.
LEFT_OUT = (
    *("benchmark", "to_minari", "from_minari", "register_structure"),
    *("InputError", "ManoeuvreError", "UnstableModelError", "Policy", "panels"),
    *("register_manoeuvre", "TurnRate", "LearnedPolicy", "ShipModel", "Sensors"),
    *("PriorKnowledge", "layout"),
)


def functions() -> dict[str, Callable[..., Any]]:
    """Public functions, classes and their constructors by name."""
    found: dict[str, Callable[..., Any]] = {}
    for package in PACKAGES:
        home = import_module(package)
        for name in names(package):
            value = getattr(home, name)
            if inspect.ismodule(value):
                continue
            if name not in LEFT_OUT:
                found[f"{package}.{name}"] = value
            for maker in (
                "from_dict",
                "from_mapping",
                "load",
                "from_model",
                "from_csv",
            ):
                if inspect.isclass(value) and hasattr(value, maker):
                    found[f"{package}.{name}.{maker}"] = getattr(value, maker)
    return found


def right() -> dict[str, Any]:
    """Right arguments by name."""
    model = load_model("mariner")
    trials = ShipFile.load(example_ship()).trials()
    return {
        "model": model,
        "models": [model],
        "trial": trials[0],
        "trials": trials,
        "length": 100.0,
        "particulars": model.particulars,
        "steering": model.steering,
        "name": "x",
        "t": np.arange(5.0),
    }


def arguments(function: Callable[..., Any], draw: Random, known: Any) -> dict[str, Any]:
    """Arguments by name, one of them or more of a wrong type."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except ValueError:
        return {}
    given: dict[str, Any] = {}
    for one in parameters:
        if one.kind in (one.VAR_KEYWORD, one.VAR_POSITIONAL) or one.name == "height":
            continue
        is_needed = one.default is one.empty
        if one.name in known and draw.random() < 0.6:
            given[one.name] = known[one.name]
        elif is_needed or draw.random() < 0.2:
            given[one.name] = draw.choice(WRONG)
    return given


def is_documented(error: BaseException, function: Callable[..., Any]) -> bool:
    """True for InputError and its like, and for what the docstring names."""
    if isinstance(error, (InputError, ManoeuvreError, UnstableModelError)):
        return True
    return type(error).__name__ in (inspect.getdoc(function) or "")


def faults(calls: int, seed: int) -> Iterator[tuple[str, str]]:
    """Functions and their undocumented exceptions, in so many calls."""
    known, found = right(), functions()
    order = sorted(found)
    for number in range(calls):
        draw = Random(f"{seed} {number}")
        name = order[number % len(order)]
        function = found[name]
        given = arguments(function, draw, known)
        try:
            with np.errstate(all="ignore"):
                function(**given)
        except Exception as error:
            if not is_documented(error, function):
                frame = traceback.extract_tb(error.__traceback__)[-1]
                place = f"{Path(frame.filename).name}:{frame.lineno}"
                yield name, f"{type(error).__name__} at {place}: {error} with {given}"
