"""The commands that train and tune: `train` and `tune`."""

from __future__ import annotations

import shlex
import sys
from dataclasses import asdict
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from agents.cli.command import (
    INTERRUPTED,
    Address,
    AllowCode,
    EngineName,
    Workers,
    fail,
)
from agents.cli.parameters import with_options

if TYPE_CHECKING:
    from collections.abc import Mapping

    from agents.controllers.interface import Policy
    from agents.training.evaluation import TrainingResult
    from agents.training.plan import TrainingPlan
    from agents.training.tuning import TuningResult, TuningTrial

Algorithm = Annotated[str, Argument(metavar="ALGORITHM", help="ppo, sac, td3 or tqc.")]
Environment = Annotated[
    str | None,
    Option(
        help=(
            "course-keeping (default), path-following, encounter, an environment id,"
            " module:id, or the file of your own task."
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
    str | None,
    Option(help="Suite of the task, a name or your TOML file; default: shipgym-v1."),
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
        help=(
            "A setting, never varied by `tune`; repeatable. base=none learns from"
            " scratch."
        ),
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


def learning_options(
    algorithm: Algorithm,
    env: Environment = None,
    model: Model = None,
    sea: Sea = None,
    task: TaskName = None,
    suite: SuiteName = None,
    allow_code: AllowCode = None,
    environment_options: EnvironmentOptions = None,
    total_steps: TotalSteps = None,
    settings: Settings = None,
    set_: Setting = None,
    randomise: Randomise = None,
) -> dict[str, Any]:
    """Fields of a `TrainingRequest` that `train` and `tune` are given."""
    overrides = _named(set_, "--set")
    if total_steps is not None:
        overrides["total_steps"] = total_steps
    fields = {
        "algorithm": algorithm,
        "environment": env,
        "model": model,
        "sea": sea,
        "task": task,
        "suite": suite,
        "options": _named(environment_options, "--option"),
        "settings_file": settings,
        "settings": overrides,
        "randomise": randomise,
        "allow_code": allow_code,
    }
    return {name: value for name, value in fields.items() if value is not None}


with_learning_options = with_options(learning_options, "fields")


@with_learning_options
def train_command(
    out: Annotated[Path, Option(metavar="FOLDER", help="Folder of the run.")],
    *,
    fields: dict[str, Any],
    seed: Annotated[
        int | None, Option(min=0, max=799, help="Random seed; default: 0.")
    ] = None,
    threads: Annotated[
        int | None, Option(min=1, help="Threads for torch and the ships; default: 1.")
    ] = None,
    resume: Annotated[
        bool, Option("--resume", help="Continue the run in the folder.")
    ] = False,
    compare: Annotated[
        str | None,
        Option(
            metavar="CONTROLLERS",
            help=(
                "Yardsticks beside no action, random ones, the rule of the task and LQ:"
                " rule, or as `benchmark --controllers` takes them."
            ),
        ),
    ] = None,
) -> None:
    """Train an autopilot by reinforcement learning.

    Writes policy, learning curve and checkpoints. Prints what an episode cost before
    and after, and what it costs with other controllers.

    A run killed at any moment resumes with --resume from its last save, about a minute
    old at most. With --resume, options that are not given keep their values; others
    must be the same.
    """
    more = {"seed": seed, "threads": threads}
    fields |= {name: value for name, value in more.items() if value is not None}
    plan = _checked_plan(fields, out, resume)
    compared = _compared(plan, compare)
    _print_result(_train(plan, out, resume, compared), out)


def _named(texts: list[str] | None, option: str) -> dict[str, Any]:
    """Values of a repeatable option NAME=VALUE by name."""
    from shipgym.files import named_values

    return named_values(texts or (), option, "gamma=0.98")


def _checked_plan(fields: dict[str, Any], out: Path, resume: bool) -> TrainingPlan:
    """Plan of a new or a resumed run, before anything is written."""
    from agents.cli.terminal import warn
    from agents.training import run_folder
    from agents.training.plan import TrainingRequest, make_plan

    if resume:
        plan = make_plan(run_folder.resumed(out, fields))
        run_folder.check_resumable(out, plan)
    else:
        run_folder.check_new(out)
        plan = make_plan(TrainingRequest(**fields))

    steps = fields["settings"].get("total_steps", 0)
    if steps % plan.settings.rollout:
        warn(
            f"total_steps: {steps:,} is rounded up to {plan.settings.all_decisions:,}:"
            f" a rollout of all ships has {plan.settings.rollout:,} steps"
        )
    return plan


def _compared(plan: TrainingPlan, names: str | None) -> dict[str, Policy]:
    """Further yardsticks by name, before anything is trained."""
    if names is None:
        return {}
    from agents.benchmarking.entries import read_entries

    policies = {}
    for entry in read_entries(names):
        policies[entry.name], *_ = entry.policies(plan.task)
    return policies


def _train(
    plan: TrainingPlan, out: Path, resume: bool, compared: Mapping[str, Policy]
) -> TrainingResult:
    from agents.cli.terminal import training_bar
    from agents.training.run_folder import CHECKPOINT
    from agents.training.training import train

    try:
        with training_bar() as on_progress:
            return train(
                plan,
                out,
                resume=resume,
                on_progress=on_progress,
                compared=compared,
                command=shlex.join(["shipgym", *sys.argv[1:]]),
            )
    except KeyboardInterrupt:
        message = "interrupted"
        if (out / CHECKPOINT).is_file():
            message += f"; continue with --resume --out {out}"
        fail(message, INTERRUPTED)


def _print_result(result: TrainingResult, out: Path) -> None:
    """Print costs beside those of yardsticks, and where the agent was written."""
    from agents.cli.tables import plain_table
    from agents.cli.terminal import answer, console, say

    agent = out / "agent.json"
    answer({**result.to_dict(), "agent": str(agent)})
    if result.resumed_from is not None:
        say(f"resumed at step {result.resumed_from:,}")
    table = plain_table("Mean cost of an episode held out", "", ">cost")
    best = f"trained: best policy, step {result.best_steps:,} of {result.steps:,}"
    costs = {"before training": result.first_cost, best: result.best_cost}
    for name, cost in {**costs, **result.yardsticks}.items():
        table.add_row(name, f"{cost:.6g}")
    console.print(table)
    reached = result.lq_reached
    if reached is not None:
        steps = reached["steps"]
        seconds = reached["seconds"]
        say(f"LQ's cost reached at step {steps:,}, after {seconds:.0f} s")
    say(f"written: {agent}")


@with_learning_options
def tune_command(
    out: Annotated[
        Path,
        Option(metavar="FOLDER", help="Folder of the study; resumed if it exists."),
    ],
    *,
    fields: dict[str, Any],
    trials: Annotated[
        int, Option(min=1, help="Trials in all, with those already done.")
    ] = 20,
    seed: Annotated[
        int, Option(min=0, max=799, help="Random seed of trainings and search.")
    ] = 0,
    engine: EngineName = "local",
    workers: Workers = 1,
    address: Address = None,
) -> None:
    """Search the settings with which an agent learns best.

    Uses Optuna; writes them for `train --settings`.

    If it is killed, the same command continues with the trials that are not done.
    """
    from agents.cli.terminal import progress_bars
    from agents.jobs import JobEngine
    from agents.training.plan import TrainingRequest, make_plan
    from agents.training.tuning import tune

    fixed = sorted(fields["settings"].keys() - {"total_steps"})
    plan = make_plan(TrainingRequest(**fields, seed=seed))
    if "evaluate_every" not in fixed:
        # ten evaluations on the way, which early stopping needs
        every = max(1, plan.settings.total_steps // 10)
        fields["settings"]["evaluate_every"] = every
        plan = make_plan(TrainingRequest(**fields, seed=seed))

    try:
        with progress_bars() as bars:

            def on_progress(done: int, total: int) -> None:
                if bars is not None:
                    bars("trials", done, total)

            tuning = tune(
                plan,
                out,
                trials,
                fixed=fixed,
                where=JobEngine(engine, workers, address),
                on_progress=on_progress,
            )
    except KeyboardInterrupt:
        fail(
            "interrupted; the same command continues with the trials that are not done",
            INTERRUPTED,
        )
    print_tuning(tuning, out)


def print_tuning(tuning: TuningResult, out: Path) -> None:
    """Print trials and where the best settings are."""
    from agents.cli.tables import number, plain_table
    from agents.cli.terminal import answer, console, say
    from agents.training.tuning import BEST

    best = out / BEST
    trials = [asdict(trial) for trial in tuning.trials]
    answer({"trials": trials, "best": tuning.best.number, "settings": str(best)})

    title = "Trials by the mean cost of a held-out episode, best first"
    table = plain_table(title, ">trial", ">cost", "ended", "what was varied")
    for trial in sorted(tuning.trials, key=_rank):
        table.add_row(
            str(trial.number),
            number(trial.cost, 3),
            trial.ended,
            _varied(trial.parameters),
        )
    console.print(table)
    say(f"\nwritten: {best}")


def _rank(trial: TuningTrial) -> float:
    """Cost of a trial; those without one come last."""
    return inf if trial.cost is None else trial.cost


def _varied(parameters: Mapping[str, Any]) -> str:
    varied = []
    for name, value in parameters.items():
        text = f"{value:.3g}" if isinstance(value, float) else str(value)
        varied.append(f"{name} {text}")
    return ", ".join(varied) or "nothing: as it was"
