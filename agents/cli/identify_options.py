"""The options of `identify` on the command line, made from `shipgym.trials.identify_table.Options`."""

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import typer

from agents.cli.parameters import take_parameters, typed_parameters
from shipgym.files import named_values
from shipgym.trials.identify_table import AUTO, FLAG, NUMBER, OPTIONS, TEXTS, WHOLE, Options, check_options

TYPES: dict[str, Any] = {FLAG: bool, NUMBER: float, WHOLE: int, TEXTS: list[str]}
#: Options with a name of their own on the command line.
COMMON = tuple(name for name, option in OPTIONS.items() if option.common)
SET = "set_"
SET_HELP = "Any option of the table [identify]; repeatable."


def takes_identify_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of `identify`, those given as the one mapping `options` that it takes."""

    @functools.wraps(command)
    def wrapped(**arguments: Any) -> None:
        named = {name: arguments.pop(name) for name in COMMON}
        command(options=given_options(named, arguments.pop(SET) or ()), **arguments)

    parameters: dict[str, inspect.Parameter] = {}
    for name, one in typed_parameters(command).items():
        parameters |= {each.name: each for each in (_parameters() if name == "options" else [one])}
    return take_parameters(wrapped, parameters)


def _parameters() -> list[inspect.Parameter]:
    """A parameter for each common option, and one for all others."""
    of_options = [
        (name, TYPES.get(OPTIONS[name].kind, str), typer.Option(*_flags(name), help=_help(name)))
        for name in COMMON
    ]
    of_others = (SET, list[str], typer.Option("--set", metavar="OPTION=VALUE", help=SET_HELP))
    return [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, option]
        )
        for name, kind, option in (*of_options, of_others)
    ]


def _flags(name: str) -> tuple[str, ...]:
    flag = f"--{name.replace('_', '-')}"
    return (f"{flag}/--no-{name}",) if OPTIONS[name].kind == FLAG else (flag,)


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


def given_options(named: Mapping[str, Any], texts: Sequence[str]) -> dict[str, Any]:
    """Options of the command line: those with a name of their own, which go first, and those of `--set`."""
    given = {name: value for name, value in named.items() if value not in (None, [])}
    return parsed_options(texts) | check_options(given, "options")


def parsed_options(texts: Sequence[str]) -> dict[str, Any]:
    """Options written as on the command line, `name=value` with a value as in the ship file.

    Raises InputError for one that is not, or has no such name.
    """
    return check_options(named_values(texts, "--set", "seed=3"), "--set")
