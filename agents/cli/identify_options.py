"""The options of `identify` on the command line, made from `shipgym.trials.identify_table.Options`."""

import functools
import inspect
from collections.abc import Callable, Sequence
from typing import Annotated, Any

from typer import Option

from agents.cli.parameters import take_parameters, typed_parameters
from shipgym.files import named_values
from shipgym.trials.identify_table import (
    AUTO,
    FLAG,
    NUMBER,
    OPTIONS,
    TEXTS,
    WHOLE,
    Options,
    check_options,
)

TYPES: dict[str, Any] = {FLAG: bool, NUMBER: float, WHOLE: int, TEXTS: list[str]}
#: Options with a name of their own on the command line.
COMMON = tuple(name for name, option in OPTIONS.items() if option.common)
SET = "set_"
SET_HELP = "Any option of the table [identify]; repeatable."


def takes_identify_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of `identify`, those given as the one mapping `options` that it takes.

    Those with a name of their own go before those of `--set`.
    """

    @functools.wraps(command)
    def wrapped(**arguments: Any) -> None:
        named = {
            name: value
            for name in COMMON
            if (value := arguments.pop(name)) not in (None, [])
        }
        tables = [
            f"{name}={value}"
            for name, value in named.items()
            if str(value).lstrip().startswith("{")
        ]
        others = parsed_options(arguments.pop(SET) or ())
        command(
            options=others | check_options(named, "options") | parsed_options(tables),
            **arguments,
        )

    parameters: dict[str, inspect.Parameter] = {}
    for name, one in typed_parameters(command).items():
        parameters |= {
            each.name: each for each in (_parameters() if name == "options" else [one])
        }
    return take_parameters(wrapped, parameters)


def _parameters() -> list[inspect.Parameter]:
    """A parameter for each common option, and one for all others."""
    kinds: dict[str, Any] = {}
    for name in COMMON:
        kind, flag = OPTIONS[name].kind, f"--{name.replace('_', '-')}"
        flag += f"/--no-{name}" if kind == FLAG else ""
        kinds[name] = Annotated[
            TYPES.get(kind, str) | None, Option(flag, help=_help(name))
        ]
    kinds[SET] = Annotated[
        list[str] | None, Option("--set", metavar="OPTION=VALUE", help=SET_HELP)
    ]
    keyword = inspect.Parameter.KEYWORD_ONLY
    return [
        inspect.Parameter(name, keyword, default=None, annotation=kind)
        for name, kind in kinds.items()
    ]


def _help(name: str) -> str:
    """The meaning of an option, its choices and its default."""
    option = OPTIONS[name]
    text = option.meaning[0].upper() + option.meaning[1:]
    *others, last = [choice for choice in option.choices or () if choice] or [""]
    if others:
        last = f"{', '.join(others)} or {last}"
    if last:
        text += f": {last}"
    default = AUTO if name == "structure" else getattr(Options, name)
    if isinstance(default, str):
        text += f"; default: the ship file's, else {default}"
    return f"{text}; may be repeated." if option.kind == TEXTS else f"{text}."


def parsed_options(texts: Sequence[str]) -> dict[str, Any]:
    """Options written as on the command line, `name=value` with a value as in the ship file.

    Raises InputError for one that is not, or has no such name.
    """
    return check_options(named_values(texts, "--set", "seed=3"), "--set")
