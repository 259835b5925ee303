"""The command that tunes: `tune`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from agents.cli.command import (
    Address,
    Algorithm,
    EngineName,
    Environment,
    EnvironmentOptions,
    Model,
    Sea,
    TaskName,
    Workers,
    answered,
)

if TYPE_CHECKING:
    from agents.training.tuning import Tuning


@answered
def tune_command(
    algorithm: Algorithm,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder of the study; resumed if it exists.")],
    env: Environment = None,
    model: Model = None,
    sea: Sea = None,
    task: TaskName = None,
    environment_options: EnvironmentOptions = None,
    trials: Annotated[int, typer.Option(min=1, help="Trials in all, with those already done.")] = 20,
    total_steps: Annotated[
        int | None, typer.Option(min=1, help="For each trial; default: as in the settings.")
    ] = None,
    settings: Annotated[
        Path | None, typer.Option(metavar="FILE.TOML", help="Settings to start from; they are varied too.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SETTING=VALUE", help="A setting that is not varied; repeatable."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=799, help="Random seed of trainings and search.")] = 0,
    randomise: Annotated[
        bool,
        typer.Option(
            "--randomise", help="Domain randomisation: ships drawn from the covariance, all seas, all speeds."
        ),
    ] = False,
    engine: EngineName = "local",
    workers: Workers = 1,
    address: Address = None,
) -> None:
    """Search the settings with which an agent learns best. Uses Optuna; writes them for `train --settings`.

    Four trials are proposed at a time, so more than four workers are of no use. If it is killed, the same
    command continues with the trials that are not done.
    """
    from agents.cli.terminal import progress_bars
    from agents.engines.jobs import JobEngine
    from agents.training.plan import Given, make_plan
    from agents.training.settings import parsed_settings
    from agents.training.tuning import evaluated_evenly, tune

    fixed = parsed_settings(set_ or ())
    own = fixed | ({} if total_steps is None else {"total_steps": total_steps})
    options = parsed_settings(environment_options or (), "--option")
    where = JobEngine(engine, workers, address)
    where.check()
    plan = make_plan(
        Given(algorithm, env, model, sea, task, options, settings, own, seed, randomise, threads=1)
    )
    if "evaluate_every" not in fixed:
        plan = evaluated_evenly(plan)
    with progress_bars() as bars:
        tell = None if bars is None else (lambda done, total, _: bars("trials", done, total))
        found = tune(plan, out, trials, fixed=tuple(fixed), where=where, progress=tell)
    _print_result(found, out)


def _print_result(found: Tuning, out: Path) -> None:
    """Print trials and where the best settings are."""
    from dataclasses import asdict

    from agents.cli.terminal import answer, console, plain_table, say
    from agents.training.tuning import BEST

    trials = [asdict(trial) for trial in found.trials]
    answer({"trials": trials, "best": found.best.number, "settings": str(out / BEST)})
    title = "Trials by the mean cost of a held-out episode, best first"
    table = plain_table(title, ">trial", ">cost", "ended", "what was varied")
    for trial in sorted(found.trials, key=lambda one: (one.cost is None, one.cost or 0.0)):
        varied = ", ".join(f"{name} {_short(value)}" for name, value in trial.parameters.items())
        cost = "-" if trial.cost is None else f"{trial.cost:.3f}"
        table.add_row(str(trial.number), cost, trial.ended, varied or "nothing: as it was")
    console.print(table)
    say(f"\nwritten: {out / BEST}")


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
