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
    str | None,
    typer.Option(help="How the coefficients are fitted; default: the ship file's, else tls-svm."),
]
Samples = Annotated[
    str | None, typer.Option(help="spline, integral or euler; default: the ship file's, else spline.")
]
Preprocessing = Annotated[
    str | None, typer.Option(help="How channels are smoothed: spline, savgol, median, rts or none.")
]
Repair = Annotated[
    bool | None, typer.Option("--repair/--no-repair", help="Replace outliers, fill short dropouts.")
]
Uncertainty = Annotated[str | None, typer.Option(help="Standard errors: analytic or bootstrap.")]
Prior = Annotated[
    str | None, typer.Option(help="Pull coefficients to: auto, a reference ship, clarke or kijima.")
]
PriorStrength = Annotated[
    float | None, typer.Option(help="Of the pull, 0 to inf; default: by cross-validation.")
]
Reference = Annotated[
    str | None, typer.Option("--reference-model", help="Reference ship of a grey box: auto, a name or file.")
]
HoldOut = Annotated[
    list[str] | None, typer.Option(metavar="FILE", help="Predict this trial only; may be repeated.")
]
Objective = Annotated[
    str | None, typer.Option(help="What a search makes small: k-fold, training or free-running.")
]
Rank = Annotated[int | None, typer.Option(min=1, help="Directions of the features that are kept.")]
Weight = Annotated[float | None, typer.Option("--C", help="Weight of the errors of an LS-SVM.")]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="OPTION=VALUE", help="Any option of the table [identify]; repeatable."),
]
Algorithm = Annotated[str, typer.Argument(metavar="ALGORITHM", help="ppo, sac, td3 or tqc.")]
Environment = Annotated[
    str | None, typer.Option(help="course-keeping (default), path-following, or an environment's id.")
]
Model = Annotated[
    str | None, typer.Option(help="A model file, or the name of a shipped model; default: mariner.")
]
Sea = Annotated[str | None, typer.Option(help="calm (default), slight, moderate or rough.")]
TaskName = Annotated[
    str | None, typer.Option(help="A task of the suite, in place of --env, --model and --sea.")
]
EnvironmentOptions = Annotated[
    list[str] | None,
    typer.Option("--option", metavar="NAME=VALUE", help="Any other keyword of the environment; repeatable."),
]
EngineName = Annotated[
    str, typer.Option("--engine", help="Where jobs are done: local (this computer) or ray.")
]
Workers = Annotated[int, typer.Option(min=1, help="Jobs done at once; the results do not depend on it.")]
Address = Annotated[
    str | None, typer.Option(metavar="HOST:PORT", help="Of a ray cluster; default: ray on this computer.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs instead of tables.")]


def answered(command: Callable[P, None]) -> Callable[P, None]:
    """Turn what goes wrong in a command into one message and the exit code it stands for."""

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> None:
        from agents.engines.jobs import WorkerDiedError
        from shipgym.errors import InputError, ManoeuvreError, UnstableModelError

        try:
            command(*args, **kwargs)
        except InputError as error:
            fail(str(error), WRONG_INPUT)
        except (ManoeuvreError, UnstableModelError, WorkerDiedError) as error:
            fail(str(error), FAILED)
        except KeyboardInterrupt:
            fail("interrupted, nothing was written", INTERRUPTED)
        except BrokenPipeError:  # the reader of the output went away
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            raise typer.Exit(FAILED) from None

    return wrapped


def fail(message: str, code: int) -> None:
    """Print the message of an error and leave with an exit code."""
    from agents.cli.terminal import fail as tell

    tell(message)
    raise typer.Exit(code) from None
