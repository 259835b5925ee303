"""Tuning: settings of an algorithm searched with Optuna; a study can be resumed.

Optuna keeps the study in SQLite. As many trials are proposed at a time as are trained
at a time, by a tree-structured Parzen estimator (Bergstra et al. 2011). The first has
the settings as they are. A trial stops early by the median rule (Golovin et al. 2017,
Google Vizier, section 3.1): when its best cost so far is above the median of what
finished trials had by then.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import cpu_count

from agents.jobs import HERE, JobEngine, run_jobs
from agents.output import in_use, present
from agents.training.plan import TrainingPlan, TrainingRequest, check_same, make_plan
from agents.training.settings import search_space, with_parameters
from shipgym.checks import check_whole
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import make_folder, write_text

optuna: Any = library("optuna", "tune", "tuning needs it")
optuna.logging.set_verbosity(optuna.logging.WARNING)

STUDY = "study.db"
BEST = "best.toml"  # file of the best settings

#: Points of a learning curve: steps, and the cost held out.
Curve = Iterable[tuple[int, float]]


@dataclass(frozen=True)
class TuningTrial:
    """One training with settings of its own.

    Attributes
    ----------
    number : int
        In the order in which they were proposed.
    parameters : mapping
        Varied settings; none for the first, which has the settings as they are.
    cost : float or None
        Mean cost of an episode held out of its best policy; None if it was stopped
        early or diverged.
    ended : {"finished", "stopped early", "diverged"}
    """

    number: int
    parameters: Mapping[str, Any]
    cost: float | None
    ended: str


@dataclass(frozen=True)
class TuningResult:
    """All trials of a study that have ended, and the best of them."""

    trials: tuple[TuningTrial, ...]
    best: TuningTrial


def tune(
    plan: TrainingPlan,
    out: str | Path,
    trials: int = 20,
    *,
    fixed: Sequence[str] = (),
    where: JobEngine = HERE,
    on_progress: Callable[[int, int], None] | None = None,
) -> TuningResult:
    """Search the settings with which an agent learns a task best, or go on with it.

    Raises InputError if Optuna is missing, another process uses the folder, it holds a
    study of something else or anything else, or every trial diverges.

    Parameters
    ----------
    plan : TrainingPlan
        What is learned, with the settings to begin from and the seed of every trial.
    out : str or Path
        Folder of the study: `study.db`, Optuna's, and `best.toml`, settings for
        training, which is there as soon as a trial has ended.
    trials : int
        In all, with those done before.
    fixed : sequence of str
        Settings that are left as they are.
    where : JobEngine
        Where trials are trained.
    on_progress : callable, optional
        Called with the trials done and their total.
    """
    check_whole(trials, "trials", at_least=1)
    folder = Path(out)
    with in_use(folder):
        study = open_study(folder, plan, fixed)
        space = search_space(plan.algorithm, fixed)
        while (before := len(ended(study))) < trials:
            at_once = min(where.workers or cpu_count(), trials - before)
            asked = [study.ask(space if study.trials else {}) for _ in range(at_once)]

            def report(done: int, _: int, before: int = before) -> None:
                if on_progress is not None:
                    on_progress(before + done, trials)

            jobs = [_job(plan, study, trial) for trial in asked]
            for trial, result in zip(
                asked, run_jobs(train_trial, jobs, where, report), strict=True
            ):
                _tell(study, trial, result)
            _write_best(folder, plan, study)
        return TuningResult(tuple(map(_as_trial, ended(study))), _as_trial(best(study)))


def open_study(folder: Path, plan: TrainingPlan, fixed: Sequence[str] = ()) -> Any:
    """Open the study in a folder, or begin one; InputError if it is another."""
    path = folder / STUDY
    if not path.is_file():
        if folder.exists() and (not folder.is_dir() or present(folder)):
            raise InputError(
                f"{folder}: exists and is not a tuning study; name another folder"
            )
        make_folder(folder)
    configuration = {**plan.configuration(), "fixed": sorted(fixed)}
    try:
        study = optuna.create_study(
            storage=f"sqlite:///{path}", study_name="shipgym", load_if_exists=True
        )
        # of a damaged file this may be the first that fails
        begun = study.get_trials(deepcopy=False)
        stored = study.user_attrs.get("configuration", configuration)
    except Exception as error:  # what SQLAlchemy raises for one is of many kinds
        raise InputError(
            f"{path}: not a study of Optuna ({error}); name another folder"
        ) from None
    check_same(configuration, stored, str(path))
    study.set_user_attr("configuration", configuration)
    for trial in begun:
        if not trial.state.is_finished():  # an interruption has ended it
            study.tell(trial.number, state=optuna.trial.TrialState.FAIL)
    study.sampler = optuna.samplers.TPESampler(
        seed=plan.request.seed + len(begun), n_startup_trials=4, constant_liar=True
    )
    return study


def ended(study: Any) -> list[Any]:
    """Trials that have ended, without those that an interruption has."""
    return [trial for trial in study.trials if "ended" in trial.user_attrs]


def _job(plan: TrainingPlan, study: Any, trial: Any) -> dict[str, Any]:
    """One trial as a job: what to train, and the costs with which it stops early."""
    settings = with_parameters(plan.settings, trial.params).to_dict()
    request = replace(plan.request, settings=settings)
    curves = [
        tuple(one.intermediate_values.items())
        for one in ended(study)
        if one.user_attrs["ended"] == "finished"
    ]
    limits = median_costs(curves, plan.settings.total_steps)
    return {
        "request": request.to_dict(),
        "allow_code": list(plan.request.allow_code),
        "limits": limits,
    }


def median_costs(curves: Sequence[Curve], total_steps: int) -> list[tuple[int, float]]:
    """Steps, and the median over finished trials of their best cost by then.

    There are none before a quarter of a training, and before four trials have finished.
    """
    if len(curves) < 4:
        return []
    marks = {steps for curve in curves for steps, _ in curve}
    found = []
    for mark in sorted(marks):
        if mark >= 0.25 * total_steps:
            best_so_far = [lowest(curve, mark) for curve in curves]
            found.append((mark, float(np.median(best_so_far))))
    return found


def lowest(curve: Curve, steps: float = np.inf) -> float:
    """Lowest cost by some steps; of limits, the largest cost that is not stopped."""
    return min((cost for mark, cost in curve if mark <= steps), default=np.inf)


def train_trial(job: dict[str, Any]) -> dict[str, Any]:
    """Train one trial; stop it when it is worse than finished ones were.

    What a base does before anything is learned says nothing about the settings: step 0
    does not count.
    """
    from agents.training.evaluation import TrainingProgress
    from agents.training.training import train

    request = TrainingRequest.from_dict(job["request"], "trial")
    plan = make_plan(replace(request, allow_code=job["allow_code"]))
    curve: list[tuple[int, float]] = []

    def stop_early(now: TrainingProgress) -> None:
        if not now.evaluated or now.cost is None or now.steps == 0:
            return
        curve.append((now.steps, now.cost))
        if lowest(curve) > lowest(job["limits"], now.steps):
            raise _StoppedEarlyError

    try:
        result = train(plan, on_progress=stop_early)
    except _StoppedEarlyError:
        return {"curve": curve, "ended": "stopped early"}
    except InputError as error:
        return {"curve": curve, "ended": "diverged", "why": str(error)}
    whole = [(one["steps"], one["cost"]) for one in result.curve if one["steps"] > 0]
    return {"curve": whole, "ended": "finished"}


class _StoppedEarlyError(Exception):
    """Ends the training of a trial."""


def _tell(study: Any, trial: Any, result: Mapping[str, Any]) -> None:
    """Record how a trial has ended; InputError if all so far have diverged."""
    for steps, cost in result["curve"]:
        trial.report(cost, steps)
    trial.set_user_attr("ended", result["ended"])
    states = optuna.trial.TrialState
    if result["ended"] == "finished":
        study.tell(trial, lowest(result["curve"]))
    elif result["ended"] == "stopped early":
        study.tell(trial, state=states.PRUNED)
    else:
        study.tell(trial, state=states.FAIL)
        if all(one.user_attrs["ended"] == "diverged" for one in ended(study)):
            raise InputError(f"every trial diverged, the last: {result['why']}")


def best(study: Any) -> Any:
    """Finished trial of the lowest cost; the best of the others where there is none."""

    def rank(trial: Any) -> tuple[bool, float]:
        is_finished = trial.user_attrs["ended"] == "finished"
        return not is_finished, lowest(trial.intermediate_values.items())

    return min(ended(study), key=rank)


def _as_trial(trial: Any) -> TuningTrial:
    how = trial.user_attrs["ended"]
    cost = lowest(trial.intermediate_values.items()) if how == "finished" else None
    return TuningTrial(trial.number, trial.params, cost, how)


def _write_best(folder: Path, plan: TrainingPlan, study: Any) -> None:
    """Write the settings of the best trial; evaluations were for tuning only."""
    trial = _as_trial(best(study))
    cost = "no trial has finished"
    if trial.cost is not None:
        cost = f"mean cost held out {trial.cost:.6g}"
    task = plan.task
    lines = [
        f"# Trial {trial.number} of {len(ended(study))}: {cost}, {plan.algorithm} on"
        f" {task.name or task.environment} with {task.model}.",
        f"# shipgym train {plan.algorithm} --settings {BEST} ...",
        "",
    ]
    settings = with_parameters(plan.settings, trial.parameters).to_dict()
    del settings["evaluate_every"]
    for name, value in settings.items():
        lines.append(f"{name} = {json.dumps(value)}")  # as TOML has them
    write_text("\n".join(lines) + "\n", folder / BEST)
