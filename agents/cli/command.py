"""Options, arguments and error messages that commands share."""

import functools
import inspect
import os
import shlex
import sys
from collections.abc import Callable
from contextvars import ContextVar
from errno import EBADF, ENOSPC, EPIPE
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer import Argument, Option
from typer.core import TyperGroup

from agents.cli.parameters import take_parameters, typed_parameters
from agents.cli.terminal import print_error, printing
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130  # exit codes
#: Words of the command line after `shipgym`.
GIVEN: ContextVar[tuple[str, ...]] = ContextVar("given", default=())

ShipFileArgument = Annotated[
    Path, Argument(metavar="SHIP.TOML", help="The ship file with its trials.")
]
EngineName = Annotated[
    str, Option("--engine", help="Where jobs run: local (this computer) or ray.")
]
Address = Annotated[
    str | None,
    Option(
        metavar="HOST:PORT", help="Ray cluster; default: start Ray on this computer."
    ),
]
AllowCode = Annotated[
    bool, Option("--allow-code", help="Run Python files that your suite names.")
]
Out = Annotated[Path, Option(metavar="FOLDER", help="Folder for the results.")]
Json = Annotated[
    bool, Option("--json", help="Print JSON for programs instead of tables.")
]
Quiet = Annotated[
    bool, Option("--quiet", "-q", help="Print only errors, and the result with --json.")
]


class CommandGroup(TyperGroup):
    """The commands; an empty argument is refused before any of them runs."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Refuse arguments that are empty."""
        GIVEN.set(tuple(args))
        for text in args:
            name, sign, value = text.partition("=")
            if not text or (sign and not value and name.startswith("--")):
                ctx.fail(f"{name or 'argument'}: expected a non-empty string, got ''")
        return super().parse_args(ctx, args)


def shared_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command --json and --quiet; an expected error is one message."""

    @functools.wraps(command)
    def wrapped(*, as_json: bool = False, quiet: bool = False, **options: Any) -> None:

        try:
            with printing(as_json, quiet):
                command(**options)
            sys.stdout.flush()
        except KeyboardInterrupt:
            fail("interrupted, nothing was written", INTERRUPTED)
        except Exception as error:
            code = report(error)
            if code is None:
                raise
            raise typer.Exit(code) from None

    parameters = typed_parameters(command)
    for name, annotation in {"as_json": Json, "quiet": Quiet}.items():
        parameters[name] = inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=False,
            annotation=annotation,
        )
    return take_parameters(wrapped, parameters)


def interrupted(kept: str, *more: str) -> NoReturn:
    """Leave after an interruption: say what is kept, and the command that goes on.

    `kept`: ends before the command; `more`: words that the command needs now.
    """
    given = [word for word in GIVEN.get() if word not in more]
    command = shlex.join(["shipgym", *given, *more])
    fail(f"interrupted; {kept}: {command}", INTERRUPTED)


def report(error: Exception) -> int | None:
    """Print an expected error and return its exit code; None for an unexpected one."""
    if isinstance(error, InputError):
        print_error(str(error))
        return WRONG_INPUT
    if isinstance(error, OSError):
        return report_os_error(error)

    from agents.jobs import JobError

    if isinstance(error, (ManoeuvreError, UnstableModelError, JobError)):
        print_error(str(error))
        return FAILED
    return None


def report_os_error(error: OSError) -> int:
    """Print what could not be read or written; the exit code."""
    reason = error.strerror or error
    if error.filename is not None:
        print_error(f"{str(error.filename)[:200]}: {reason}")
        return WRONG_INPUT
    if error.errno not in (EPIPE, ENOSPC, EBADF):
        print_error(str(reason))
        return WRONG_INPUT

    # standard output failed: what is still in its buffer must not fail again
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    if error.errno != EPIPE:  # the reader of the output has not just gone away
        print_error(f"the output cannot be written ({reason})")
    return FAILED


def fail(message: str, code: int) -> NoReturn:
    """Print the message of an error and leave with an exit code."""
    print_error(message)
    raise typer.Exit(code) from None
