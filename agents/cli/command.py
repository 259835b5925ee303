"""What all commands share: what goes wrong becomes one message and an exit code; options of several."""

import functools
import inspect
import os
import sys
from collections.abc import Callable
from errno import EBADF, ENOSPC, EPIPE
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer import Argument, Option
from typer.core import TyperGroup

from agents.cli.parameters import take_parameters, typed_parameters

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130
OUTPUT_GONE = (EPIPE, ENOSPC, EBADF)
LONGEST_NAME = 200  # characters of a path that are told

ShipFileArgument = Annotated[
    Path, Argument(metavar="SHIP.TOML", help="The ship file with its trials.")
]
EngineName = Annotated[
    str, Option("--engine", help="Where jobs run: local (this computer) or ray.")
]
Workers = Annotated[
    int, Option(min=1, help="Jobs at a time; the results do not depend on it.")
]
Address = Annotated[
    str | None,
    Option(
        metavar="HOST:PORT", help="Ray cluster; default: start Ray on this computer."
    ),
]
Json = Annotated[
    bool, Option("--json", help="Print JSON for programs instead of tables.")
]
Quiet = Annotated[
    bool, Option("--quiet", "-q", help="Print only errors, and the result with --json.")
]
SHARED = {"as_json": Json, "quiet": Quiet}  # options of every command


def answered(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that all share, and turn what goes wrong into one message and an exit code.

    It prints to the terminal's `out`, which is silent with `--json` and `--quiet`, and
    gives its result as fields to `answer`.
    """

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        from agents.cli.terminal import printing
        from agents.engines.job import WorkerDiedError
        from shipgym.errors import InputError, ManoeuvreError, UnstableModelError

        try:
            with printing(*(kwargs.pop(name, False) for name in SHARED)):
                command(*args, **kwargs)
            sys.stdout.flush()
        except InputError as error:
            fail(str(error), WRONG_INPUT)
        except (ManoeuvreError, UnstableModelError, WorkerDiedError) as error:
            fail(str(error), FAILED)
        except KeyboardInterrupt:
            fail("interrupted, nothing was written", INTERRUPTED)
        except OSError as error:
            raise typer.Exit(told_failure(error)) from None

    shared = {
        name: inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=kind
        )
        for name, kind in SHARED.items()
    }
    return take_parameters(wrapped, typed_parameters(command) | shared)


def told_failure(error: OSError) -> int:
    """Say what could not be read or written; the exit code."""
    from agents.cli.terminal import fail as tell

    if error.filename is None and error.errno in OUTPUT_GONE:
        os.dup2(
            os.open(os.devnull, os.O_WRONLY), 1
        )  # what is left in buffers fails no more
        if error.errno != EPIPE:  # the reader of the output went away
            tell(f"the output cannot be written ({error.strerror})")
        return FAILED
    name = "" if error.filename is None else f"{str(error.filename)[:LONGEST_NAME]}: "
    tell(f"{name}{error.strerror or error}")
    return WRONG_INPUT


class Commands(TyperGroup):
    """The commands; an argument without text is refused before any of them is called."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Refuse empty arguments, and those that no name of a file can be."""
        for k, text in enumerate(args):
            name, sign, value = (
                text.partition("=") if text.startswith("--") else ("", "", text)
            )
            if "\0" in text or (not value and (sign or not name)):
                name = name or (
                    args[k - 1] if k and args[k - 1].startswith("-") else "argument"
                )
                ctx.fail(f"{name}: {value!r} found, expected a text that is not empty")
        return super().parse_args(ctx, args)


def fail(message: str, code: int) -> NoReturn:
    """Print the message of an error and leave with an exit code."""
    from agents.cli.terminal import fail as tell

    tell(message)
    raise typer.Exit(code) from None
