"""Tuning: settings of an algorithm searched with Optuna, many trainings at once, resumable.

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
from typing import Any

import numpy as np

from agents.jobs import HERE, JobEngine, run_jobs
from agents.output import in_use, present
from agents.training.plan import Plan, check_same
from agents.training.settings import (
    OffPolicySettings,
    Settings,
    changed,
    settings_of,
)
from shipgym.checks import Shape, check_shape, check_whole
from shipgym.errors import InputError
from shipgym.files import (
    make_folder,
    read_json,
    shipped_toml,
    write_json,
    write_text,
)

try:
    import optuna
    from optuna import distributions
except ModuleNotFoundError:
    raise InputError(
        "optuna is not installed, tuning needs it: pip install 'shipgym[tune]'"
    ) from None

optuna.logging.set_verbosity(optuna.logging.WARNING)

#: Trials proposed at once: more workers are of no use.
BATCH = 4
#: Finished trials, and share of a training, before any is stopped early.
TRIALS_BEFORE_STOPPING, SHARE_BEFORE_STOPPING = 4, 0.25
EVALUATIONS = 10  # of a trial

CONFIGURATION, STUDY, KEPT, BEST = "study.json", "study.db", "trials", "best.toml"

#: Settings that stand behind parameters of other names.
STANDS_FOR = {"one_minus_gamma": "gamma", "minibatches": "batch_size"}

#: What a training returns.
TRIAL: Shape = {
    "cost": (int, float, NoneType),
    "curve": [[(int,), (int, float)]],
    "ended": (str,),
}


@dataclass(frozen=True)
class Trial:
    """One training with settings of its own."""

    number: int  # from 0 on, in the order in which they were proposed
    parameters: Mapping[
        str, Any
    ]  # what was varied; none for the first, which has the settings as they are
    settings: Mapping[str, Any]  # all settings
    #: mean cost of an episode held out of its best policy; None if it was stopped early
    #: or diverged
    cost: float | None
    curve: tuple[tuple[int, float], ...]  # cost of each evaluation, by its steps
    ended: str  # "finished", "stopped early", "diverged"


@dataclass(frozen=True)
class Tuning:
    """All trials of a study, and the best of them."""

    trials: tuple[Trial, ...]
    best: Trial


def tune(
    plan: Plan,
    out: str | Path,
    trials: int = 20,
    *,
    fixed: Sequence[str] = (),
    where: JobEngine = HERE,
    progress: Callable[[int, int, float | None], None] | None = None,
    training: Callable[[dict[str, Any]], dict[str, Any]] | None = None,
) -> Tuning:
    """Search the settings with which an agent learns a task best; a study that is there goes on.

    `plan`: what is learned, with the settings to begin from and the seed of every
    trial; `out`: folder of the study: `study.db` (Optuna's, SQLite), `trials/`,
    `study.json` and `best.toml`, which is there as soon as a trial has finished and is
    settings for training; `trials`: in all, those done before among them; `fixed`:
    settings that are left as they are; `where`: where trials are trained; the results
    are the same; `progress`: called with the trials done, their total and the best
    cost; `training`: used instead of `train_trial`: takes a job, returns cost, curve
    and how it ended.

    Raises InputError if Optuna is missing, another process uses the folder, it holds a
    study of something else or anything else, or every trial of the first batch
    diverges.
    """
    check_whole(trials, "trials", at_least=1)
    folder = Path(out)
    with in_use(folder):
        study = _opened(folder, plan, fixed)
        found: list[Trial] = []
        for first in range(0, trials, BATCH):
            proposed = _proposed(plan, found, min(BATCH, trials - first), fixed)
            best = min(
                (trial.cost for trial in found if trial.cost is not None), default=None
            )

            def tell(
                done: int, _: int, before: int = first, best: float | None = best
            ) -> None:
                if progress is not None:
                    progress(before + done, trials, best)

            bounds = limits(found, plan.settings.total_steps)
            run = plan.configuration()
            jobs = [
                {"configuration": run | {"settings": one}, "limits": bounds}
                for _, one in proposed
            ]
            kept = replace(where, keep=folder / KEPT)
            results = run_jobs(training or train_trial, jobs, kept, tell)
            for (parameters, settings), result in zip(proposed, results, strict=True):
                found.append(_trial(len(found), parameters, settings, result))
            _record(study, found, plan, fixed)
            if all(trial.ended == "diverged" for trial in found):
                raise InputError(
                    f"every trial diverged, the first: {results[0]['why']}"
                )
            _write_best(folder, plan, found)
        return Tuning(tuple(found), _best(found))


def evaluated_evenly(plan: Plan) -> Plan:
    """The plan with ten evaluations on the way, which early stopping needs."""
    every = max(1, plan.settings.total_steps // EVALUATIONS)
    return replace(plan, settings=changed(plan.settings, {"evaluate_every": every}))


def train_trial(job: dict[str, Any]) -> dict[str, Any]:
    """Train one trial; stop it when it is worse than finished ones were.

    What a base does before anything is learned says nothing about the settings: step 0
    does not count.
    """
    from agents.training.training import Progress, train

    plan = Plan.from_configuration(job["configuration"], threads=1)
    curve: list[tuple[int, float]] = []

    def tell(now: Progress) -> None:
        if now.evaluated and now.cost is not None and now.steps > 0:
            curve.append((now.steps, now.cost))
            if lowest(curve, now.steps) > lowest(job["limits"], now.steps):
                raise _StoppedEarlyError

    try:
        result = train(plan, tell=tell)
    except _StoppedEarlyError:
        return {"cost": None, "curve": curve, "ended": "stopped early"}
    except InputError as error:
        return {"cost": None, "curve": curve, "ended": "diverged", "why": str(error)}
    told = [(row["steps"], row["cost"]) for row in result.curve if row["steps"] > 0]
    return {"cost": min(cost for _, cost in told), "curve": told, "ended": "finished"}


class _StoppedEarlyError(Exception):
    """Ends the training of a trial."""


def limits(trials: Sequence[Trial], total_steps: int) -> list[tuple[int, float]]:
    """Steps, and the median over finished trials of their best cost by then."""
    finished = [trial.curve for trial in trials if trial.ended == "finished"]
    if len(finished) < TRIALS_BEFORE_STOPPING:
        return []
    first = SHARE_BEFORE_STOPPING * total_steps
    marks = sorted(
        {steps for curve in finished for steps, _ in curve if steps >= first}
    )
    return [
        (mark, float(np.median([lowest(curve, mark) for curve in finished])))
        for mark in marks
    ]


def lowest(curve: Sequence[tuple[int, float]], steps: float) -> float:
    """The lowest cost by some steps; of limits, the largest best cost with which a training goes on."""
    return min((cost for mark, cost in curve if mark <= steps), default=np.inf)


def _trial(
    number: int, parameters: Mapping[str, Any], settings: Mapping[str, Any], result: Any
) -> Trial:
    check_shape(result, TRIAL, f"trial {number}")
    curve = tuple((int(steps), float(cost)) for steps, cost in result["curve"])
    return Trial(number, parameters, settings, result["cost"], curve, result["ended"])


def _best(trials: Sequence[Trial]) -> Trial:
    """The finished trial of the lowest cost; one that was stopped early only where none has finished."""
    return min(
        trials, key=lambda trial: (trial.cost is None, lowest(trial.curve, np.inf))
    )


def _proposed(
    plan: Plan, found: Sequence[Trial], number: int, fixed: Sequence[str]
) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Parameters and settings of the next trials; they follow from the trials before and the seed."""
    space = search_space(plan.algorithm, fixed)
    sampler = optuna.samplers.TPESampler(
        seed=plan.seed + len(found), n_startup_trials=BATCH
    )
    study = optuna.create_study(sampler=sampler)
    study.add_trials([_frozen(trial, space) for trial in found])
    asked: list[dict[str, Any]] = [{}] if not found else []
    asked += [dict(study.ask(space).params) for _ in range(number - len(asked))]
    return [
        (parameters, with_parameters(plan.settings, parameters).to_dict())
        for parameters in asked
    ]


def _frozen(trial: Trial, space: Mapping[str, Any]) -> optuna.trial.FrozenTrial:
    """A trial as Optuna knows it."""
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


def _opened(folder: Path, plan: Plan, fixed: Sequence[str]) -> optuna.Study:
    """The study in the folder; a new one where there is none."""
    expected = {"configuration": plan.configuration(), "fixed": sorted(fixed)}
    note = folder / CONFIGURATION
    if note.is_file():
        check_same(expected, read_json(note, "study", "name another folder"), str(note))
    elif folder.exists() and (not folder.is_dir() or present(folder)):
        raise InputError(
            f"{folder}: exists and is not a tuning study; name another folder"
        )
    else:
        make_folder(folder)
        write_json(expected, note)
    try:
        storage = f"sqlite:///{folder / STUDY}"
        study = optuna.create_study(
            storage=storage, study_name="shipgym", load_if_exists=True
        )
        study.get_trials(
            deepcopy=False
        )  # of a damaged file this may be the first that fails
        return study
    except (
        Exception
    ) as error:  # what SQLAlchemy raises for a broken file is of many kinds
        raise InputError(
            f"{folder / STUDY}: not a study of Optuna ({error}); remove it, it is"
            f" written again from {folder / KEPT}"
        ) from None


def _record(
    study: optuna.Study, found: Sequence[Trial], plan: Plan, fixed: Sequence[str]
) -> None:
    """Add to the study what it does not have yet: an interruption may have left it incomplete."""
    there = {trial.user_attrs.get("number") for trial in study.trials}
    space = search_space(plan.algorithm, fixed)
    study.add_trials(
        [_frozen(trial, space) for trial in found if trial.number not in there]
    )


def _write_best(folder: Path, plan: Plan, found: Sequence[Trial]) -> None:
    """Settings of the best trial; how often it was evaluated was for tuning only."""
    best = _best(found)
    cost = (
        "no trial has finished"
        if best.cost is None
        else f"mean cost held out {best.cost:.6g}"
    )
    head = (
        f"# Trial {best.number} of {len(found)}: {cost}, seed {plan.seed},"
        f" {plan.algorithm} on {plan.task.name or plan.task.environment} with"
        f" {plan.task.model}.\n# shipgym train {plan.algorithm} --settings {BEST}"
        " ...\n\n"
    )
    lines = [
        f"{name} = {json.dumps(value)}\n" for name, value in best.settings.items()
    ]  # as TOML has them
    write_text(
        head + "".join(line for line in lines if not line.startswith("evaluate_every")),
        folder / BEST,
    )


def search_space(algorithm: str, fixed: Sequence[str] = ()) -> dict[str, Any]:
    """The parameters that are varied, without those whose setting is fixed."""
    tables = shipped_toml("agents.training", "hyperparameters/search.toml")
    shared = (
        tables["off-policy"]
        if issubclass(settings_of(algorithm), OffPolicySettings)
        else {}
    )
    space = {**tables["all"], **shared, **tables[algorithm]}
    varied = (name for name in space if STANDS_FOR.get(name, name) not in fixed)
    return {name: _distribution(space[name]) for name in varied}


def _distribution(given: Any) -> distributions.BaseDistribution:
    if isinstance(given, list):
        return distributions.CategoricalDistribution(given)
    whole = isinstance(given["high"], int)
    return (
        distributions.IntDistribution(**given)
        if whole
        else distributions.FloatDistribution(**given)
    )


def with_parameters(settings: Settings, parameters: Mapping[str, Any]) -> Settings:
    """The settings that parameters stand for; InputError if they conflict with those that are not varied."""
    given = {
        name: value for name, value in parameters.items() if name not in STANDS_FOR
    }
    if "one_minus_gamma" in parameters:
        given["gamma"] = 1.0 - parameters["one_minus_gamma"]
    for name in given.keys() & {"net_arch", "critic_arch"}:
        given[name] = [int(width) for width in parameters[name].split()]
    if "minibatches" in parameters:
        n_steps = given.get("n_steps", settings.to_dict()["n_steps"])
        given["batch_size"] = settings.ships * n_steps // parameters["minibatches"]
    return changed(settings, given)
