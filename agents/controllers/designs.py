"""Classical controllers by name, designed for the ship and the path of a task."""

from collections.abc import Mapping
from typing import Any

from agents.controllers.controller import Controller
from agents.controllers.law import linear_law
from agents.controllers.registry import controller_class
from agents.suites.benchmark_task import BenchmarkTask
from agents.suites.suite import load_tuned
from shipgym import InputError
from shipgym.checks import quoted
from shipgym.tasks.task import Task

#: Of these, no bases for policies unless asked for by name: MPC simulates.
NO_BASES = ("mpc",)
INNER = "lq_"  # before settings of the LQ that guidance leads


def design(
    kind: str, task: BenchmarkTask, settings: Mapping[str, Any] | None = None
) -> Controller:
    """Design a classical controller for a task.

    Raises InputError if there is no such design for the ship, or guidance has no path
    to follow.

    Parameters
    ----------
    kind : str
        As registered (`agents.controllers.registry`).
    task : BenchmarkTask
        Its ship and control interval are used; for guidance its path too.
    settings : mapping, optional
        Keywords of `from_model`; for guidance also those of the LQ that it leads, after
        `lq_`. Without any the design's own, with a filter for the waves of the task.
    """
    made: Any = controller_class(kind)
    interval = task.task.interval(task.ship)
    given = dict(settings or for_sea(made, task.task, interval))
    if not made.has_autopilot:
        found: Controller = made.from_model(task.ship, dt=interval, **given)
        return found
    if not task.task.follows_path:
        raise no_path(kind, task)

    own = {}
    inner = {}
    for name, value in given.items():
        if name.startswith(INNER):
            inner[name.removeprefix(INNER)] = value
        else:
            own[name] = value
    guide: Controller = made.from_model(
        task.ship,
        autopilot=design("lq", task, inner),
        task=task.task,
        **own,
    )
    return guide


def for_sea(made: Any, task: Task, interval: float) -> dict[str, float]:
    """Settings of a class of controllers that follow from the sea of a task.

    None for waves that the control `interval`, s, cannot follow.
    """
    waves = task.weather.waves
    if waves is None or waves.peak_period <= 2.0 * interval:
        return {}
    if made.has_autopilot:
        return {f"{INNER}wave_period": waves.peak_period}
    # a Kalman filter takes most of the waves out already
    filters = made.law is linear_law and made.settings_type is not None
    return {"wave_period": waves.peak_period} if filters else {}


def tuned(kind: str, task: BenchmarkTask, suite: str, run: int = 0) -> Controller:
    """Design a classical controller with the settings found for a task of a suite.

    `kind`: of `registry.CLASSICAL`, or "base": that which cost least without
    `NO_BASES`; `run`: which of the searches. Raises InputError if there are no such
    settings.
    """
    if kind == "base":
        found = load_tuned(suite).get(task.name, {})
        bases = [name for name in found if name not in NO_BASES]
        kind = min(bases, key=lambda one: found[one][0]["cost"], default=kind)
    runs = tuned_runs(kind, task, suite)
    settings = runs[run]["settings"]
    return design(kind, task, settings)


def tuned_runs(kind: str, task: BenchmarkTask, suite: str) -> list[dict[str, Any]]:
    """What the searches of a controller found for a task of a suite, as `tuned`."""
    found = load_tuned(suite).get(task.name, {})
    if kind not in found:
        raise InputError(
            f"controller: expected one that was tuned for task '{task.name}' of suite"
            f" '{suite}', one of {quoted(found)}, got '{kind}'"
        )
    runs: list[dict[str, Any]] = found[kind]
    return runs


def no_path(kind: str, task: BenchmarkTask) -> InputError:
    """Error of guidance that has nothing to follow."""
    where = task.name or task.environment
    return InputError(
        f"controller: expected a path for '{kind}', got none in '{where}'"
    )
