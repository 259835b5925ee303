"""The parameters of a command as typer sees them, for decorators that add some."""

import inspect
from collections.abc import Callable
from typing import Any, get_type_hints


def typed_parameters(command: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """The parameters of a command, keyword only, their annotations as objects."""
    hints = get_type_hints(command, include_extras=True)
    return {
        name: one.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)
        for name, one in inspect.signature(command).parameters.items()
    }


def take_parameters(
    command: Callable[..., None], parameters: dict[str, inspect.Parameter]
) -> Callable[..., None]:
    """Tell typer which parameters a command takes."""
    command.__signature__ = inspect.Signature(list(parameters.values()))  # type: ignore[attr-defined]
    command.__annotations__ = {name: one.annotation for name, one in parameters.items()}
    return command
