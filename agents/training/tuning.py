"""Tuning: settings of an algorithm searched with Optuna; a study can be resumed.

Optuna keeps the study in SQLite and proposes trials by a tree-structured Parzen
estimator (Bergstra et al. 2011). The first has the settings as they are. A trial stops
early by the median rule (Golovin et al. 2017, Google Vizier, section 3.1).
"""

import json
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from agents.output import check_results, in_use
from agents.training.evaluation import TrainingProgress
from agents.training.plan import TrainingPlan, check_same
from agents.training.settings import suggested
from identification.progress import PROGRESS
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import make_folder, write_text

optuna: Any = library("optuna", "tune", "tuning needs it")
optuna.logging.set_verbosity(optuna.logging.ERROR)

STUDY = "study.db"
BEST = "best.toml"  # file of the best settings
EVALUATIONS = 10  # of a trial


def tune(
    plan: TrainingPlan,
    out: str | Path,
    trials: int = 20,
    *,
    fixed: Collection[str] = (),
) -> Any:
    """Search the settings with which an agent learns a task best, or go on with it.

    Returns Optuna's study. Raises InputError if Optuna is missing, another process uses
    the folder, it holds a study of something else or anything else, or no trial has
    finished.

    Parameters
    ----------
    plan : TrainingPlan
        What is learned, with the settings to begin from and the seed of every trial.
    out : str or Path
        Folder of the study: `study.db`, Optuna's, and `best.toml`, settings for
        training, which is there as soon as a trial has finished.
    trials : int
        In all, with those done before.
    fixed : collection of str
        Settings that are left as they are.
    """
    check_whole(trials, "trials", at_least=1)
    every = max(1, plan.settings.total_steps // EVALUATIONS)
    plan = replace(plan, settings=plan.settings.changed({"evaluate_every": every}))
    folder = Path(out)

    def objective(trial: Any) -> float:
        settings = plan.settings
        if trial.number > 0:
            settings = suggested(settings, trial, fixed)
        trial.set_user_attr("settings", settings.to_dict())
        return lowest_cost(
            replace(plan, settings=settings),
            trial,
        )

    def after(study: Any, trial: Any) -> None:
        finished = trial.state is optuna.trial.TrialState.COMPLETE
        if finished and study.best_trial.number == trial.number:
            _write_best(folder, plan, trial)
        PROGRESS.get()("trials", _ended(study), trials)

    with in_use(folder):
        study = open_study(folder, plan, fixed)
        left = max(0, trials - _ended(study))
        study.optimize(objective, left, catch=InputError, callbacks=[after])
    if not (folder / BEST).is_file():
        raise InputError(
            "tune: expected a trial that does not diverge, got none; lower"
            " learning_rate, or raise reward_scale"
        )
    return study


def open_study(folder: Path, plan: TrainingPlan, fixed: Collection[str] = ()) -> Any:
    """Open the study in a folder, or begin one; InputError if it is another."""
    path = folder / STUDY
    check_results(folder, [STUDY], resume=True)
    make_folder(folder)
    study = optuna.create_study(
        storage=f"sqlite:///{path}",
        study_name="shipgym",
        load_if_exists=True,
        pruner=optuna.pruners.MedianPruner(4, n_warmup_steps=EVALUATIONS // 4),
    )
    configuration = {**plan.configuration(), "fixed": sorted(fixed)}
    check_same(configuration, study.user_attrs.get("plan", configuration), str(path))
    study.set_user_attr("plan", configuration)
    seed = plan.seed + len(study.trials)
    study.sampler = optuna.samplers.TPESampler(n_startup_trials=4, seed=seed)
    return study


def lowest_cost(plan: TrainingPlan, trial: Any) -> float:
    """Train a trial; return its lowest cost held out, or stop it as Optuna says.

    What a base does before anything is learned says nothing about the settings: step 0
    does not count.
    """
    from agents.training.training import train

    def report(now: TrainingProgress) -> None:
        if now.evaluated and now.steps > 0:
            trial.report(
                now.cost,
                now.steps // plan.settings.evaluate_every,
            )
            if trial.should_prune():
                raise optuna.TrialPruned

    curve = train(plan, on_progress=report).curve
    return min(float(one["cost"]) for one in curve if one["steps"] > 0)


def _ended(study: Any) -> int:
    """Trials that have ended, without those that an interruption has."""
    return sum(trial.state.is_finished() for trial in study.trials)


def _write_best(folder: Path, plan: TrainingPlan, trial: Any) -> None:
    """Write the settings of the best trial; evaluations were for tuning only."""
    task = plan.task.name or plan.task.environment
    lines = [
        f"# Trial {trial.number}: mean cost held out {trial.value:.6g},"
        f" {plan.algorithm} on {task} with {plan.task.model}.",
        f"# shipgym train {plan.algorithm} --settings {BEST} ...",
        "",
    ]
    for name, value in trial.user_attrs["settings"].items():
        if name != "evaluate_every":
            lines.append(f"{name} = {json.dumps(value)}")  # as TOML has them
    write_text("\n".join(lines) + "\n", folder / BEST)
