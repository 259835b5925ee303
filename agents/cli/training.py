"""The commands that train and tune: `train` and `tune`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from agents.cli.command import interrupted
from agents.cli.parameters import with_options
from agents.cli.terminal import answer, console, progress_bars, say, training_bar

if TYPE_CHECKING:
    from agents.training.evaluation import TrainingResult

Seed = Annotated[int, Option(min=0, max=799, help="Random seed.")]


def learning_options(
    algorithm: Annotated[str, Argument(metavar="ALGORITHM", help="ppo or sac.")],
    env: Annotated[
        str | None,
        Option(
            help=(
                "course-keeping (default), path-following, encounter, an environment"
                " id, module:id, or the file of your own task."
            )
        ),
    ] = None,
    model: Annotated[
        str | None,
        Option(
            help=(
                "A model file, or the name of a shipped model; default: that of the"
                " environment."
            )
        ),
    ] = None,
    sea: Annotated[
        str | None, Option(help="calm (default), slight, moderate or rough.")
    ] = None,
    task: Annotated[
        str | None,
        Option(help="A benchmark task, instead of --env, --model and --sea."),
    ] = None,
    environment_options: Annotated[
        list[str] | None,
        Option(
            "--option",
            metavar="NAME=VALUE",
            help="Any other argument of the environment; repeatable.",
        ),
    ] = None,
    total_steps: Annotated[
        int | None,
        Option(
            min=1,
            help="Decisions that an agent learns from; default: as in the settings.",
        ),
    ] = None,
    settings: Annotated[
        Path | None,
        Option(metavar="FILE.TOML", help="Settings that override the tuned ones."),
    ] = None,
    set_: Annotated[
        list[str] | None,
        Option(
            "--set",
            metavar="SETTING=VALUE",
            help=(
                "A setting, never varied by `tune`; repeatable. base=none learns from"
                " scratch."
            ),
        ),
    ] = None,
) -> dict[str, Any]:
    """Arguments of `make_plan` that `train` and `tune` are given."""
    from shipgym.files import named_values

    own = named_values(set_ or (), "--set", "gamma=0.98")
    if total_steps is not None:
        own["total_steps"] = total_steps
    return {
        "algorithm": algorithm,
        "environment": env,
        "model": model,
        "sea": sea,
        "task": task,
        "options": named_values(environment_options or (), "--option", "noise=1"),
        "settings_file": settings,
        "settings": own,
    }


with_learning_options = with_options(learning_options, "asked")


@with_learning_options
def train_command(
    out: Annotated[Path, Option(metavar="FOLDER", help="Folder of the run.")],
    *,
    asked: dict[str, Any],
    seed: Seed = 0,
    resume: Annotated[
        bool, Option("--resume", help="Continue the run in the folder.")
    ] = False,
) -> None:
    """Train an autopilot by reinforcement learning.

    Writes policy, learning curve and checkpoints. Prints what an episode cost before
    and after, and what it costs with other controllers.

    A run killed at any moment continues with the same command and --resume from its
    last save, about a minute old at most.
    """
    from agents.training.plan import make_plan
    from agents.training.run_folder import RUN
    from agents.training.training import train

    plan = make_plan(**asked, seed=seed)
    try:
        with training_bar() as on_progress:
            result = train(plan, out, resume=resume, on_progress=on_progress)
    except KeyboardInterrupt:
        if not (out / RUN).is_file():
            raise
        interrupted(f"what was learned is kept in {out}; go on with", "--resume")
    _print_result(result, out)


def _print_result(result: TrainingResult, out: Path) -> None:
    """Print costs beside those of yardsticks, and where the agent was written."""
    from agents.cli.tables import plain_table

    agent = out / "agent.json"
    answer({**result.to_dict(), "agent": str(agent)})
    if result.resumed_from is not None:
        say(f"resumed at step {result.resumed_from:,}")
    table = plain_table(
        "Mean cost of an episode held out, the lower the better", "", ">cost"
    )
    first, last, best = result.curve[0], result.curve[-1], result.best
    policy = f"best policy, step {best['steps']:,} of {last['steps']:,}"
    costs = {"before training": first["cost"], policy: best["cost"]}
    costs |= result.yardsticks
    for name, cost in costs.items():
        table.add_row(name, f"{cost:.6g}")
    console.print(table)
    least = costs.pop(policy)
    name = min(costs, key=costs.__getitem__)
    if least >= costs[name]:
        say(
            f"the agent is no better than {name}: train it for more steps"
            " (--total-steps), or with other settings (--set)"
        )
    say(f"written: {agent}")


@with_learning_options
def tune_command(
    out: Annotated[
        Path,
        Option(metavar="FOLDER", help="Folder of the study; resumed if it exists."),
    ],
    *,
    asked: dict[str, Any],
    trials: Annotated[
        int, Option(min=1, help="Trials in all, with those already done.")
    ] = 20,
    seed: Seed = 0,
) -> None:
    """Search the settings with which an agent learns best.

    Uses Optuna; writes them for `train --settings`.

    If it is killed, the same command continues with the trials that are not done.
    """
    from agents.training.plan import make_plan
    from agents.training.tuning import STUDY, tune

    plan = make_plan(**asked, seed=seed)
    try:
        with progress_bars():
            study = tune(
                plan,
                out,
                trials,
                fixed=asked["settings"],
            )
    except KeyboardInterrupt:
        if not (out / STUDY).is_file():
            raise
        interrupted(f"trials that have ended are kept in {out}; go on with")
    print_tuning(study, out)


def print_tuning(study: Any, out: Path) -> None:
    """Print the best trial of a study and where its settings are."""
    from agents.cli.tables import number
    from agents.training.tuning import BEST

    path, best = out / BEST, study.best_trial
    trials = study.trials
    found = {"trials": len(trials), "best": best.number, "cost": best.value}
    answer({**found, "parameters": best.params, "settings": str(path)})
    costs = [number(trial.value, 3) for trial in (best, trials[0])]
    say(
        f"lowest mean cost of a held-out episode: {costs[0]}, trial {best.number} of"
        f" {len(trials)}; {costs[1]} with the settings as they were"
    )
    say(f"written: {path}")
