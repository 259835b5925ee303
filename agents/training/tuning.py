"""Tuning: settings of an algorithm searched with Optuna; a study can be resumed.

Trials are proposed in batches of four by a tree-structured Parzen estimator (Bergstra
et al. 2011) that knows the batches before, so that what is found does not depend on how
many trials are trained at once or where. The first trial has the settings as they are.
A trial stops early by the median rule (Golovin et al. 2017, Google Vizier, section
3.1): when its best cost so far is above the median of what finished trials had by then.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import NoneType
from typing import Any, NamedTuple

import numpy as np

from agents.jobs import HERE, JobEngine, run_jobs
from agents.output import in_use, present
from agents.training.plan import TrainingPlan, check_same
from agents.training.search_space import search_space, with_parameters
from agents.training.settings import changed
from shipgym.checks import Shape, check_shape, check_whole
from shipgym.errors import InputError
from shipgym.extras import library
from shipgym.files import make_folder, read_json, write_json, write_text

optuna: Any = library("optuna", "tune", "tuning needs it")
optuna.logging.set_verbosity(optuna.logging.WARNING)

#: Trials proposed at once: more workers are of no use.
BATCH = 4
BEST = "best.toml"  # file of the best settings

#: Points of a learning curve: steps, and the cost held out.
Curve = Sequence[tuple[int, float]]


@dataclass(frozen=True)
class TuningTrial:
    """One training with settings of its own.

    Attributes
    ----------
    number : int
        From 0 on, in the order in which they were proposed.
    parameters : mapping
        Varied parameters; none for the first, which has the settings as they are.
    settings : mapping
        All settings.
    cost : float or None
        Mean cost of an episode held out of its best policy; None if it was stopped
        early or diverged.
    curve : tuple of (int, float)
        Cost of each evaluation, by its steps.
    ended : {"finished", "stopped early", "diverged"}
    """

    number: int
    parameters: Mapping[str, Any]
    settings: Mapping[str, Any]
    cost: float | None
    curve: tuple[tuple[int, float], ...]
    ended: str


@dataclass(frozen=True)
class TuningResult:
    """All trials of a study, and the best of them."""

    trials: tuple[TuningTrial, ...]
    best: TuningTrial


class TuningProposal(NamedTuple):
    """Parameters of the next trial, and all its settings."""

    parameters: dict[str, Any]
    settings: dict[str, Any]


def tune(
    plan: TrainingPlan,
    out: str | Path,
    trials: int = 20,
    *,
    fixed: Sequence[str] = (),
    where: JobEngine = HERE,
    on_progress: Callable[[int, int, float | None], None] | None = None,
    training: Callable[[dict[str, Any]], dict[str, Any]] | None = None,
) -> TuningResult:
    """Search the settings with which an agent learns a task best, or go on with it.

    Raises InputError if Optuna is missing, another process uses the folder, it holds a
    study of something else or anything else, or every trial of the first batch
    diverges.

    Parameters
    ----------
    plan : TrainingPlan
        What is learned, with the settings to begin from and the seed of every trial.
    out : str or Path
        Folder of the study: `study.db` (Optuna's, SQLite), `trials/`, `study.json` and
        `best.toml`, which is there as soon as a trial has finished and is settings for
        training.
    trials : int
        In all, with those done before.
    fixed : sequence of str
        Settings that are left as they are.
    where : JobEngine
        Where trials are trained; the results are the same.
    on_progress : callable, optional
        Called with the trials done, their total and the best cost.
    training : callable, optional
        Used instead of `train_trial`: takes a job, returns cost, curve and how it
        ended.
    """
    check_whole(trials, "trials", at_least=1)
    folder = Path(out)
    kept = replace(where, keep=folder / "trials")
    with in_use(folder):
        study = open_study(folder, plan, fixed)
        done: list[TuningTrial] = []
        while len(done) < trials:
            number = min(BATCH, trials - len(done))
            proposals = propose(plan, done, number, fixed)
            results = run_jobs(
                training or train_trial,
                _jobs(plan, done, proposals),
                kept,
                _report_of_batch(done, trials, on_progress),
            )
            for proposal, result in zip(proposals, results, strict=True):
                done.append(_as_trial(len(done), proposal, result))

            _record(study, done, plan, fixed)
            _check_progress(done, results)
            write_best(folder, plan, done)
        return TuningResult(tuple(done), best_trial(done))


def _check_progress(
    done: Sequence[TuningTrial], results: Sequence[Mapping[str, Any]]
) -> None:
    """Refuse to continue if every trial so far has diverged."""
    if all(trial.ended == "diverged" for trial in done):
        why = results[0]["why"]
        raise InputError(f"every trial diverged, the first: {why}")


def _jobs(
    plan: TrainingPlan, done: Sequence[TuningTrial], proposals: Sequence[TuningProposal]
) -> list[dict[str, Any]]:
    bounds = limits(done, plan.settings.total_steps)
    jobs = []
    for proposal in proposals:
        configuration = plan.configuration()
        configuration["settings"] = proposal.settings
        jobs.append({"configuration": configuration, "limits": bounds})
    return jobs


def _report_of_batch(
    done: Sequence[TuningTrial],
    trials: int,
    on_progress: Callable[[int, int, float | None], None] | None,
) -> Callable[[int, int], None]:
    """Return a function that counts the trials of a batch on from those before."""
    before = len(done)
    costs = [trial.cost for trial in done if trial.cost is not None]
    best = min(costs, default=None)

    def report(in_batch: int, _: int) -> None:
        if on_progress is not None:
            on_progress(before + in_batch, trials, best)

    return report


def evaluated_evenly(plan: TrainingPlan) -> TrainingPlan:
    """Return the plan with ten evaluations on the way, which early stopping needs."""
    every = max(1, plan.settings.total_steps // 10)
    return replace(plan, settings=changed(plan.settings, {"evaluate_every": every}))


def train_trial(job: dict[str, Any]) -> dict[str, Any]:
    """Train one trial; stop it when it is worse than finished ones were.

    What a base does before anything is learned says nothing about the settings: step 0
    does not count.
    """
    from agents.training.result import TrainingProgress
    from agents.training.training import train

    plan = TrainingPlan.from_configuration(job["configuration"], threads=1)
    curve: list[tuple[int, float]] = []

    def stop_early(now: TrainingProgress) -> None:
        if not now.evaluated or now.cost is None or now.steps == 0:
            return
        curve.append((now.steps, now.cost))
        limit = lowest(job["limits"], now.steps)
        if lowest(curve, now.steps) > limit:
            raise _StoppedEarlyError

    try:
        result = train(plan, on_progress=stop_early)
    except _StoppedEarlyError:
        return {"cost": None, "curve": curve, "ended": "stopped early"}
    except InputError as error:
        return {"cost": None, "curve": curve, "ended": "diverged", "why": str(error)}

    whole = []
    for evaluation in result.curve:
        if evaluation["steps"] > 0:
            whole.append((evaluation["steps"], evaluation["cost"]))
    return {"cost": lowest(whole, np.inf), "curve": whole, "ended": "finished"}


class _StoppedEarlyError(Exception):
    """Ends the training of a trial."""


def limits(trials: Sequence[TuningTrial], total_steps: int) -> list[tuple[int, float]]:
    """Steps, and the median over finished trials of their best cost by then.

    There are none before a quarter of a training, and before four trials have finished.
    """
    finished = [trial.curve for trial in trials if trial.ended == "finished"]
    if len(finished) < 4:
        return []
    marks = set()
    for curve in finished:
        for steps, _ in curve:
            if steps >= 0.25 * total_steps:
                marks.add(steps)

    found = []
    for mark in sorted(marks):
        best_so_far = [lowest(curve, mark) for curve in finished]
        found.append((mark, float(np.median(best_so_far))))
    return found


def lowest(curve: Curve, steps: float) -> float:
    """Lowest cost by some steps; of limits, the largest cost that is not stopped."""
    return min((cost for mark, cost in curve if mark <= steps), default=np.inf)


def _as_trial(number: int, proposal: TuningProposal, result: Any) -> TuningTrial:
    expected: Shape = {
        "cost": (int, float, NoneType),
        "curve": [[(int,), (int, float)]],
        "ended": (str,),
    }
    check_shape(result, expected, f"trial {number}")
    curve = [(int(steps), float(cost)) for steps, cost in result["curve"]]
    return TuningTrial(
        number=number,
        parameters=proposal.parameters,
        settings=proposal.settings,
        cost=result["cost"],
        curve=tuple(curve),
        ended=result["ended"],
    )


def best_trial(trials: Sequence[TuningTrial]) -> TuningTrial:
    """Finished trial of the lowest cost; one stopped early where none has finished."""

    def rank(trial: TuningTrial) -> tuple[bool, float]:
        return trial.cost is None, lowest(trial.curve, np.inf)

    return min(trials, key=rank)


def propose(
    plan: TrainingPlan,
    done: Sequence[TuningTrial],
    number: int,
    fixed: Sequence[str] = (),
) -> list[TuningProposal]:
    """Propose trials; they follow from those before and the seed."""
    space = search_space(plan.algorithm, fixed)
    sampler = optuna.samplers.TPESampler(
        seed=plan.seed + len(done), n_startup_trials=BATCH
    )
    study = optuna.create_study(sampler=sampler)
    study.add_trials([_frozen(trial, space) for trial in done])

    proposals: list[TuningProposal] = []
    for _ in range(number):
        parameters: dict[str, Any] = {}
        if done or proposals:  # the first has the settings as they are
            asked = study.ask(space)
            parameters = dict(asked.params)
        settings = with_parameters(plan.settings, parameters)
        proposals.append(TuningProposal(parameters, settings.to_dict()))
    return proposals


def _frozen(trial: TuningTrial, space: Mapping[str, Any]) -> Any:
    """Return a trial as Optuna knows it."""
    states = optuna.trial.TrialState
    return optuna.trial.create_trial(
        state=states.PRUNED if trial.cost is None else states.COMPLETE,
        value=trial.cost,
        params=dict(trial.parameters),
        distributions={name: space[name] for name in trial.parameters},
        user_attrs={
            "number": trial.number,
            "ended": trial.ended,
            "settings": dict(trial.settings),
        },
        intermediate_values=dict(trial.curve),
    )


def open_study(folder: Path, plan: TrainingPlan, fixed: Sequence[str]) -> Any:
    """Open the study in a folder, or begin one."""
    configuration = {"configuration": plan.configuration(), "fixed": sorted(fixed)}
    note = folder / "study.json"
    if note.is_file():
        stored = read_json(note, "study", "name another folder")
        check_same(configuration, stored, str(note))
    elif folder.exists() and (not folder.is_dir() or present(folder)):
        raise InputError(
            f"{folder}: exists and is not a tuning study; name another folder"
        )
    else:
        make_folder(folder)
        write_json(configuration, note)
    return open_database(folder / "study.db")


def open_database(path: Path) -> Any:
    """Open Optuna's study in a file, or begin one; InputError for a broken file."""
    try:
        study = optuna.create_study(
            storage=f"sqlite:///{path}", study_name="shipgym", load_if_exists=True
        )
        # of a damaged file this may be the first that fails
        study.get_trials(deepcopy=False)
    except Exception as error:  # what SQLAlchemy raises for one is of many kinds
        raise InputError(
            f"{path}: not a study of Optuna ({error}); remove it, it is written again"
            f" from {path.parent / 'trials'}"
        ) from None
    return study


def _record(
    study: Any, done: Sequence[TuningTrial], plan: TrainingPlan, fixed: Sequence[str]
) -> None:
    """Add to the study what it lacks: an interruption may have left it incomplete."""
    recorded = {trial.user_attrs.get("number") for trial in study.trials}
    space = search_space(plan.algorithm, fixed)
    for trial in done:
        if trial.number not in recorded:
            study.add_trial(_frozen(trial, space))


def write_best(folder: Path, plan: TrainingPlan, trials: Sequence[TuningTrial]) -> None:
    """Write the settings of the best trial; evaluations were for tuning only."""
    best = best_trial(trials)
    cost = "no trial has finished"
    if best.cost is not None:
        cost = f"mean cost held out {best.cost:.6g}"
    algorithm = plan.algorithm
    task = plan.task
    lines = [
        f"# Trial {best.number} of {len(trials)}: {cost}, seed {plan.seed},"
        f" {algorithm} on {task.name or task.environment} with {task.model}.",
        f"# shipgym train {algorithm} --settings {BEST} ...",
        "",
    ]
    for name, value in best.settings.items():
        if name != "evaluate_every":
            lines.append(f"{name} = {json.dumps(value)}")  # as TOML has them
    write_text("\n".join(lines) + "\n", folder / BEST)
