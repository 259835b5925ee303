"""Functions of a ship model that take its name or its file too."""

import functools
import inspect
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, cast

from shipgym.checks import shown
from shipgym.errors import InputError

Function = TypeVar("Function", bound=Callable[..., Any])


def takes_name(function: Function) -> Function:
    """Let the argument `model` be a model, or what `load_model` takes.

    Anything else is an InputError.
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def wrapped(*given: Any, **named: Any) -> Any:
        bound = signature.bind(*given, **named)
        bound.arguments["model"] = ship_of(bound.arguments["model"])
        return function(*bound.args, **bound.kwargs)

    return cast(Function, wrapped)


def ship_of(model: Any) -> Any:
    """The model itself, or that of a name or a file."""
    models = import_module("shipgym.models")
    if isinstance(model, models.ShipModel):
        return model
    if isinstance(model, str | Path):
        return models.load_model(model)
    raise InputError(
        f"model: expected a ship model, its name or its file, got {shown(model)}"
    )
