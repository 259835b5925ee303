"""Training that a user asks for, and the plan built from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from agents.policies.weights_file import as_json
from agents.suites.environments import read_environment
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, find_task
from agents.training.plan import TrainingPlan
from agents.training.settings import (
    LearningSettings,
    changed,
    load_settings,
    read_settings_file,
    settings_of,
)
from shipgym.errors import InputError


@dataclass(frozen=True)
class TrainingRequest:
    """Training that a user asks for.

    What is None or empty is left to the defaults, or to the run that is resumed.

    Attributes
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    environment : str
        As `read_environment` takes it.
    model : str
        Name or file of a model.
    sea : str
        Sea state.
    task : str
        Task of a suite, which sets environment, model, sea and options.
    options : mapping
        Further keywords of the environment.
    settings_file : Path
        TOML.
    settings : mapping
        Settings by name; they go before the file.
    seed, randomise, threads
        As in `TrainingPlan`.
    suite : str
        Shipped suite, or the path of one of the user's own.
    allow_code : sequence of str
        Code that the suite may name.
    """

    algorithm: str
    environment: str | None = None
    model: str | None = None
    sea: str | None = None
    task: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    settings_file: Path | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    seed: int | None = None
    randomise: bool | None = None
    threads: int | None = None
    suite: str = DEFAULT_SUITE
    allow_code: Sequence[str] = ()


def make_plan(
    request: TrainingRequest, stored: TrainingPlan | None = None
) -> TrainingPlan:
    """Make the plan that a user asks for.

    Raises InputError for an unknown algorithm, environment, task, model, option or
    setting, with the nearest known one, or a value out of its range.

    Parameters
    ----------
    request : TrainingRequest
    stored : TrainingPlan, optional
        Plan of the run that is resumed: what is not asked for is as it was.
    """
    settings_of(request.algorithm)  # its error goes before those of the task
    task = _task(request, stored)
    others = {} if stored is None else _others(stored)
    others |= _others(request)
    return TrainingPlan(
        algorithm=request.algorithm,
        task=task,
        settings=_settings(request, stored, task),
        **others,
    )


def _others(source: TrainingRequest | TrainingPlan) -> dict[str, Any]:
    """Return what belongs to a run, whatever is learned, where it is given."""
    values = {
        "seed": source.seed,
        "randomise": source.randomise,
        "threads": source.threads,
    }
    return {name: value for name, value in values.items() if value is not None}


def _settings(
    request: TrainingRequest, stored: TrainingPlan | None, task: BenchmarkTask
) -> LearningSettings:
    given: dict[str, Any] = {}
    if request.settings_file:
        given = read_settings_file(request.settings_file, request.algorithm)
    given |= request.settings
    if stored is not None and stored.algorithm == request.algorithm:
        return changed(stored.settings, given)
    return load_settings(
        request.algorithm,
        environment=task.environment,
        task=task.name,
        given=given,
        action=task.task.action,
        suite=task.suite,
    )


def _task(request: TrainingRequest, stored: TrainingPlan | None) -> BenchmarkTask:
    """Return environment, model and options."""
    given = {
        "--env": request.environment,
        "--model": request.model,
        "--sea": request.sea,
        "--option": request.options or None,
    }
    options = [name for name, value in given.items() if value is not None]
    if request.task is not None:
        if options:
            raise InputError(
                f"--task: expected alone, got {options[0]} too, which the task sets;"
                " leave one of them out"
            )
        return find_task(request.task, request.suite, request.allow_code)
    if request.suite != DEFAULT_SUITE:
        raise InputError(
            f"--suite: expected together with --task, got {request.suite!r} alone; name"
            " one of its tasks"
        )
    if stored is not None:
        return _changed_task(request, stored.task) if options else stored.task
    return _changed_task(request, BenchmarkTask("", "course-keeping", "mariner"))


def _changed_task(request: TrainingRequest, before: BenchmarkTask) -> BenchmarkTask:
    """Return a task with what is asked for replaced."""
    environment = read_environment(request.environment or before.environment)
    options = {**before.options, **environment.options}
    if request.sea is not None:
        options["sea"] = request.sea
    options |= request.options
    model = options.pop("model", before.model)
    return BenchmarkTask(
        name=before.name,
        environment=environment.name,
        model=request.model or model,
        options=options,
        suite=before.suite,
    )


def code_in(request: TrainingRequest) -> dict[str, Any]:
    """Return what a user names that may be code: environment, model and options."""
    if request.task is not None:
        task = find_task(request.task, request.suite, request.allow_code)
        return {
            "environment": task.environment,
            "model": task.model,
            "options": as_json(task.options),
        }
    name: str | None = None
    options: dict[str, Any] = {}
    if request.environment is not None:
        name, options = read_environment(request.environment)
    return {
        "environment": name,
        "model": request.model,
        "options": {**options, **request.options},
    }
