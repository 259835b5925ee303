"""What all commands share: what goes wrong becomes one message and an exit code; options of several."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, ParamSpec

import typer

P = ParamSpec("P")

FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130

ShipFileArgument = Annotated[Path, typer.Argument(metavar="SHIP.TOML", help="The ship file with its trials.")]
Structure = Annotated[
    str | None, typer.Option(help="Terms of the model; default: the ship file's, else abkowitz.")
]
Method = Annotated[
    str | None, typer.Option(help="tls-svm, ls-svm or ls; default: the ship file's, else tls-svm.")
]
Samples = Annotated[
    str | None, typer.Option(help="spline, integral or euler; default: the ship file's, else spline.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs instead of tables.")]


def answered(command: Callable[P, None]) -> Callable[P, None]:
    """Turn what goes wrong in a command into one message and the exit code it stands for."""

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> None:
        from shipgym.errors import InputError, ManoeuvreError, UnstableModelError

        try:
            command(*args, **kwargs)
        except InputError as error:
            fail(str(error), WRONG_INPUT)
        except (ManoeuvreError, UnstableModelError) as error:
            fail(str(error), FAILED)
        except KeyboardInterrupt:
            fail("interrupted, nothing was written", INTERRUPTED)
        except BrokenPipeError:  # the reader of the output went away
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            raise typer.Exit(FAILED) from None

    return wrapped


def fail(message: str, code: int) -> None:
    """Print the message of an error and leave with an exit code."""
    from agents.terminal import fail as tell

    tell(message)
    raise typer.Exit(code) from None
