"""The parameters of a command as typer sees them, for decorators that add some."""

import functools
import inspect
from collections.abc import Callable
from typing import Any, get_type_hints


def typed_parameters(command: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """The parameters of a command, keyword only, their annotations as objects."""
    hints = get_type_hints(command, include_extras=True)
    parameters = {}
    for name, parameter in inspect.signature(command).parameters.items():
        parameters[name] = parameter.replace(
            annotation=hints[name],
            kind=inspect.Parameter.KEYWORD_ONLY,
        )
    return parameters


def take_parameters(
    command: Callable[..., None], parameters: dict[str, inspect.Parameter]
) -> Callable[..., None]:
    """Tell typer which parameters a command takes."""
    annotations = {}
    for name, parameter in parameters.items():
        annotations[name] = parameter.annotation
    command.__annotations__ = annotations
    signature = inspect.Signature(list(parameters.values()))
    command.__signature__ = signature  # type: ignore[attr-defined]
    return command


def with_options(
    read: Callable[..., Any], name: str
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator that gives a command the parameters of `read`.

    The command takes what `read` makes of them as its argument `name`.
    """
    added = typed_parameters(read)

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def wrapped(**arguments: Any) -> None:
            values = {option: arguments.pop(option) for option in added}
            arguments[name] = read(**values)
            command(**arguments)

        parameters = typed_parameters(command)
        del parameters[name]
        return take_parameters(wrapped, parameters | added)

    return decorate
