"""The command that trains: `train`."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agents.cli.command import (
    INTERRUPTED,
    Algorithm,
    Environment,
    EnvironmentOptions,
    Model,
    Sea,
    TaskName,
    answered,
    fail,
)

if TYPE_CHECKING:
    from agents.training.plan import Given
    from agents.training.training import TrainingResult


@answered
def train_command(
    algorithm: Algorithm,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder of the run.")],
    env: Environment = None,
    model: Model = None,
    sea: Sea = None,
    task: TaskName = None,
    environment_options: EnvironmentOptions = None,
    total_steps: Annotated[
        int | None, typer.Option(min=1, help="Decisions to learn from; default: as in the settings.")
    ] = None,
    settings: Annotated[
        Path | None, typer.Option(metavar="FILE.TOML", help="Settings that override the tuned ones.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SETTING=VALUE", help="Any setting of the algorithm; repeatable."),
    ] = None,
    from_nothing: Annotated[
        bool, typer.Option("--from-nothing", help="Learn without a base: --set base=none.")
    ] = False,
    seed: Annotated[int | None, typer.Option(min=0, max=799, help="Random seed; default: 0.")] = None,
    randomise: Annotated[
        bool | None,
        typer.Option(
            "--randomise", help="Domain randomisation: ships drawn from the covariance, all seas, all speeds."
        ),
    ] = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Threads for torch and the ships; default: 1.")
    ] = None,
    max_seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Stop after this time; --resume continues.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the run in the folder.")] = False,
) -> None:
    """Train an autopilot by reinforcement learning. Writes policy, learning curve and checkpoints.

    A run killed at any moment resumes with --resume from its last checkpoint, at most a minute old, and ends
    as if it had never stopped. With --resume, options not given keep their values; others must be the same.
    """
    from agents.training.plan import Given
    from agents.training.settings import parsed_settings

    own = parsed_settings(set_ or ()) | ({} if total_steps is None else {"total_steps": total_steps})
    own |= {"base": "none"} if from_nothing else {}
    given = Given(
        algorithm, env, model, sea, task, parsed_settings(environment_options or (), "--option"), settings,
        own, seed, randomise, threads,
    )  # fmt: skip
    result = _train(given, out, resume, max_seconds)
    _print_result(result, out)


def _train(given: Given, out: Path, resume: bool, max_seconds: float | None) -> TrainingResult:
    """Check what is given before anything heavy is imported or written, then train."""
    from agents.cli.terminal import training_bar, warn
    from agents.training import run_folder
    from agents.training.plan import make_plan

    stored = None
    if resume:
        stored = run_folder.read_plan(out, given)
    else:
        run_folder.check_new(out)
    plan = make_plan(given, stored)
    if resume:
        run_folder.check_resumable(out, plan)
        for line in run_folder.other_versions(out):
            warn(f"the run began with other versions: {line}; the result may differ in the last digits")
    from agents.training.training import train

    command = shlex.join(["shipgym", *sys.argv[1:]])
    try:
        with training_bar() as tell:
            return train(plan, out, resume=resume, max_seconds=max_seconds, tell=tell, command=command)
    except KeyboardInterrupt:
        kept = (out / run_folder.CHECKPOINT).is_file()
        fail(f"interrupted; continue with --resume --out {out}" if kept else "interrupted", INTERRUPTED)
        raise  # not reached: `fail` leaves


def _print_result(result: TrainingResult, out: Path) -> None:
    """Print costs, and where the agent was written."""
    from agents.cli.terminal import answer, console, say

    answer({**result.to_dict(), "agent": str(out / "agent.json")})
    if result.resumed_from is not None:
        console.print(f"resumed at step {result.resumed_from:,}")
    lq = "" if result.lq_cost is None else f"; LQ's: {result.lq_cost:.2f}"
    found = f"cost of a held-out episode: {result.best_cost:.2f}{lq}"
    say(f"{found} (step {result.best_steps:,} of {result.steps:,})")
    reached = result.lq_reached
    if reached is not None:
        console.print(f"LQ's cost reached at step {reached['steps']:,}, after {reached['seconds']:.0f} s")
    if not result.finished:
        total = result.plan.settings.total_steps
        say(f"stopped at step {result.steps:,} of {total:,}: continue with --resume --out {out}")
    say(f"written: {out / 'agent.json'}")
