"""The commands that train and tune: `train` and `tune`."""

from __future__ import annotations

import shlex
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from agents.cli.command import (
    INTERRUPTED,
    Address,
    AllowCode,
    EngineName,
    Workers,
    answered,
    fail,
)

if TYPE_CHECKING:
    from agents.training.plan import Given
    from agents.training.training import TrainingResult
    from agents.training.tuning import Tuning

EXAMPLE = "gamma=0.98"
Algorithm = Annotated[str, Argument(metavar="ALGORITHM", help="ppo, sac, td3 or tqc.")]
Environment = Annotated[
    str | None,
    Option(
        help=(
            "course-keeping (default), path-following, an environment id, module:id, or"
            " the file of your own task."
        )
    ),
]
Model = Annotated[
    str | None,
    Option(help="A model file, or the name of a shipped model; default: mariner."),
]
Sea = Annotated[str | None, Option(help="calm (default), slight, moderate or rough.")]
TaskName = Annotated[
    str | None, Option(help="A benchmark task, instead of --env, --model and --sea.")
]
SuiteName = Annotated[
    str, Option(help="Suite of the task: a name, or the TOML file of your own.")
]
EnvironmentOptions = Annotated[
    list[str] | None,
    Option(
        "--option",
        metavar="NAME=VALUE",
        help="Any other argument of the environment; repeatable.",
    ),
]
TotalSteps = Annotated[
    int | None,
    Option(
        min=1, help="Decisions that an agent learns from; default: as in the settings."
    ),
]
Settings = Annotated[
    Path | None,
    Option(metavar="FILE.TOML", help="Settings that override the tuned ones."),
]
Setting = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="SETTING=VALUE",
        help="A setting, never varied by `tune`; repeatable.",
    ),
]
Randomise = Annotated[
    bool | None,
    Option(
        "--randomise",
        help=(
            "Domain randomisation: ships drawn from the covariance, all seas, all"
            " speeds."
        ),
    ),
]


@answered
def train_command(
    algorithm: Algorithm,
    out: Annotated[Path, Option(metavar="FOLDER", help="Folder of the run.")],
    env: Environment = None,
    model: Model = None,
    sea: Sea = None,
    task: TaskName = None,
    suite: SuiteName = "shipgym-v1",
    allow_code: AllowCode = None,
    environment_options: EnvironmentOptions = None,
    total_steps: TotalSteps = None,
    settings: Settings = None,
    set_: Setting = None,
    from_nothing: Annotated[
        bool, Option("--from-nothing", help="Without a base: --set base=none.")
    ] = False,
    seed: Annotated[
        int | None, Option(min=0, max=799, help="Random seed; default: 0.")
    ] = None,
    randomise: Randomise = None,
    threads: Annotated[
        int | None, Option(min=1, help="Threads for torch and the ships; default: 1.")
    ] = None,
    max_seconds: Annotated[
        float | None, Option(min=0.0, help="Time limit; --resume continues.")
    ] = None,
    resume: Annotated[
        bool, Option("--resume", help="Continue the run in the folder.")
    ] = False,
) -> None:
    """Train an autopilot by reinforcement learning. Writes policy, learning curve and checkpoints.

    A run killed at any moment resumes with --resume from its last checkpoint, at most a
    minute old, and ends as if it had never stopped. With --resume, options not given
    keep their values; others must be the same.
    """
    from agents.training.plan import Given
    from shipgym.files import named_values

    own = named_values(set_ or (), "--set", EXAMPLE)
    own |= {} if total_steps is None else {"total_steps": total_steps}
    own |= {"base": "none"} if from_nothing else {}
    given = Given(
        algorithm,
        env,
        model,
        sea,
        task,
        named_values(environment_options or (), "--option", EXAMPLE),
        settings,
        own,
        seed,
        randomise,
        threads,
        suite,
        allow_code or (),
    )
    _print_result(_train(given, out, resume, max_seconds), out)


def _train(
    given: Given, out: Path, resume: bool, max_seconds: float | None
) -> TrainingResult:
    """Check what is given before anything heavy is imported or written, then train."""
    from agents.cli.terminal import training_bar, warn
    from agents.training import run_folder
    from agents.training.plan import make_plan

    if not resume:
        run_folder.check_new(out)
    plan = make_plan(given, run_folder.read_plan(out, given) if resume else None)
    if resume:
        run_folder.check_resumable(out, plan)
        for line in run_folder.other_versions(out):
            warn(
                f"the run began with other versions: {line}; the result may differ in"
                " the last digits"
            )
    asked, rollout = given.settings.get("total_steps", 0), plan.settings.rollout
    if asked % rollout:
        whole = (
            f"{-(-asked // rollout) * rollout:,}: rollouts of {plan.settings.ships}"
            " ships"
        )
        warn(f"total_steps: {asked:,} is rounded up to {whole} have {rollout:,} steps")
    from agents.training.training import train

    command = shlex.join(["shipgym", *sys.argv[1:]])
    try:
        with training_bar() as tell:
            return train(
                plan,
                out,
                resume=resume,
                max_seconds=max_seconds,
                tell=tell,
                command=command,
            )
    except KeyboardInterrupt:
        kept = (out / run_folder.CHECKPOINT).is_file()
        fail(
            (
                f"interrupted; continue with --resume --out {out}"
                if kept
                else "interrupted"
            ),
            INTERRUPTED,
        )


def _print_result(result: TrainingResult, out: Path) -> None:
    """Print costs, and where the agent was written."""
    from agents.cli.terminal import answer, console, say

    answer({**result.to_dict(), "agent": str(out / "agent.json")})
    if result.resumed_from is not None:
        console.print(f"resumed at step {result.resumed_from:,}")
    lq = "" if result.lq_cost is None else f"; LQ's: {result.lq_cost:.2f}"
    found = f"cost of a held-out episode: {result.best_cost:.2f}{lq}"
    say(f"{found} (step {result.best_steps:,} of {result.steps:,})")
    if (reached := result.lq_reached) is not None:
        console.print(
            f"LQ's cost reached at step {reached['steps']:,}, after"
            f" {reached['seconds']:.0f} s"
        )
    if not result.finished:
        total = result.plan.settings.total_steps
        say(
            f"stopped at step {result.steps:,} of {total:,}: continue with --resume"
            f" --out {out}"
        )
    say(f"written: {out / 'agent.json'}")


@answered
def tune_command(
    algorithm: Algorithm,
    out: Annotated[
        Path,
        Option(metavar="FOLDER", help="Folder of the study; resumed if it exists."),
    ],
    env: Environment = None,
    model: Model = None,
    sea: Sea = None,
    task: TaskName = None,
    suite: SuiteName = "shipgym-v1",
    allow_code: AllowCode = None,
    environment_options: EnvironmentOptions = None,
    trials: Annotated[
        int, Option(min=1, help="Trials in all, with those already done.")
    ] = 20,
    total_steps: TotalSteps = None,
    settings: Settings = None,
    set_: Setting = None,
    seed: Annotated[
        int, Option(min=0, max=799, help="Random seed of trainings and search.")
    ] = 0,
    randomise: Randomise = False,
    engine: EngineName = "local",
    workers: Workers = 1,
    address: Address = None,
) -> None:
    """Search the settings with which an agent learns best. Uses Optuna; writes them for `train --settings`.

    Four trials are proposed at a time, so more than four workers are of no use. If it
    is killed, the same command continues with the trials that are not done.
    """
    from agents.cli.terminal import progress_bars
    from agents.jobs import JobEngine
    from agents.training.plan import Given, make_plan
    from agents.training.tuning import evaluated_evenly, tune
    from shipgym.files import named_values

    fixed = named_values(set_ or (), "--set", EXAMPLE)
    own = fixed | ({} if total_steps is None else {"total_steps": total_steps})
    options = named_values(environment_options or (), "--option", EXAMPLE)
    where = JobEngine(engine, workers, address)
    given = Given(
        algorithm,
        env,
        model,
        sea,
        task,
        options,
        settings,
        own,
        seed,
        randomise,
        threads=1,
        suite=suite,
        allow_code=allow_code or (),
    )
    plan = make_plan(given)
    if "evaluate_every" not in fixed:
        plan = evaluated_evenly(plan)
    try:
        with progress_bars() as bars:
            tell = (
                None
                if bars is None
                else (lambda done, total, _: bars("trials", done, total))
            )
            found = tune(
                plan, out, trials, fixed=tuple(fixed), where=where, progress=tell
            )
    except KeyboardInterrupt:
        fail(
            "interrupted; the same command continues with the trials that are not done",
            INTERRUPTED,
        )
    _print_tuning(found, out)


def _print_tuning(found: Tuning, out: Path) -> None:
    """Print trials and where the best settings are."""
    from agents.cli.terminal import answer, console, plain_table, say
    from agents.training.tuning import BEST

    trials = [asdict(trial) for trial in found.trials]
    answer({"trials": trials, "best": found.best.number, "settings": str(out / BEST)})
    title = "Trials by the mean cost of a held-out episode, best first"
    table = plain_table(title, ">trial", ">cost", "ended", "what was varied")
    for trial in sorted(
        found.trials, key=lambda one: (one.cost is None, one.cost or 0.0)
    ):
        varied = ", ".join(
            f"{name} {_short(value)}" for name, value in trial.parameters.items()
        )
        cost = "-" if trial.cost is None else f"{trial.cost:.3f}"
        table.add_row(
            str(trial.number), cost, trial.ended, varied or "nothing: as it was"
        )
    console.print(table)
    say(f"\nwritten: {out / BEST}")


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
