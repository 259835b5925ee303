"""Classical controllers by name, designed for the ship and the path of a task."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from agents.controllers.controller import Controller
from agents.controllers.interface import model_hash
from agents.controllers.registry import controller_class
from agents.suites.suite import BenchmarkTask, load_tuned
from shipgym import InputError, ShipModel
from shipgym.checks import quoted
from shipgym.tasks.task import Task

#: Of these, no bases for policies unless asked for by name: MPC simulates, an action
#: takes it 97 us where wheel-over needs 2.
NO_BASES = ("mpc",)
INNER = "lq_"  # before settings of the LQ that guidance leads


@dataclass(frozen=True)
class _Ship:
    """A ship that equals another of the same numbers."""

    model: ShipModel = field(compare=False)
    sha256: str  # of its numbers


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
        `lq_`.
    """
    made: Any = controller_class(kind)
    given = dict(settings or {})
    if not made.has_autopilot:
        ship = _Ship(task.ship, model_hash(task.ship))
        interval = task.task.interval(task.ship)
        text = json.dumps(given, sort_keys=True)
        return _designed(made, ship, interval, text)
    if not task.task.follows_path:
        raise no_path(kind, task)

    own, of_autopilot = _divided(given)
    guide: Controller = made.from_model(
        task.ship,
        autopilot=design("lq", task, of_autopilot),
        task=task.task,
        **own,
    )
    return guide


def _divided(settings: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Settings of guidance and, by their own names, of the LQ that it leads."""
    own = {}
    inner = {}
    for name, value in settings.items():
        if name.startswith(INNER):
            inner[name.removeprefix(INNER)] = value
        else:
            own[name] = value
    return own, inner


@lru_cache(maxsize=256)
def _designed(kind: Any, ship: _Ship, dt: float, settings: str) -> Controller:
    made: Controller = kind.from_model(ship.model, dt=dt, **json.loads(settings))
    return made


def with_bandwidth(
    controller: Controller, model: ShipModel, share: float, task: Task | None = None
) -> Controller | None:
    """A design of the same kind with a share of the bandwidth, about that share.

    Guidance is given an autopilot of that bandwidth to lead, along the paths of `task`.
    None for a kind that has no bandwidth to set. Raises InputError if there is no such
    design, as `from_model`.
    """
    made: Any = type(controller)
    if controller.has_autopilot:
        autopilot = getattr(controller, "autopilot", None)
        if not isinstance(autopilot, Controller):
            return None
        led = with_bandwidth(autopilot, model, share)
        if led is None:
            return None
        guide: Controller = made.from_model(model, autopilot=led, task=task)
        return guide

    settings = bandwidth_settings(controller.design, share)
    if not settings:
        return None
    dt = controller.design["dt"]
    other: Controller = made.from_model(model, dt=dt, **settings)
    return other


def bandwidth_settings(design: Mapping[str, float], share: float) -> dict[str, float]:
    """Settings for a share of the bandwidth of a design; empty if it has none.

    Poles are moved in proportion. Of a regulator the weights rise: a heading follows a
    rudder rate as a triple integrator and a rudder as a double one, whose bandwidths
    fall with the sixth and the fourth root of their weights.
    """
    if "frequency" in design:
        return {"frequency": share * design["frequency"]}
    if "rate_weight_s2" in design:
        return {
            "rudder_weight": design["rudder_weight"] / share**4,
            "rate_weight_s2": design["rate_weight_s2"] / share**6,
        }
    return {}


def tuned(kind: str, task: BenchmarkTask, suite: str) -> Controller:
    """Design a classical controller with the settings found for a task of a suite.

    `kind`: of `registry.CLASSICAL`; "best" is that which cost least, "base" likewise
    without `NO_BASES`. Raises InputError if there are no such settings.
    """
    found = load_tuned(suite).get(task.name, {})
    if kind == "best":
        kind = _cheapest(found, kind)
    elif kind == "base":
        bases = {name: found[name] for name in found if name not in NO_BASES}
        kind = _cheapest(bases, kind)

    if not found:
        raise InputError(
            f"controller: expected a task of suite '{suite}' with tuned controllers,"
            f" got '{task.name}'"
        )
    if kind not in found:
        raise InputError(
            f"controller: expected one that was tuned for task '{task.name}' of suite"
            f" '{suite}', {quoted(found)}, got '{kind}'"
        )
    return design(kind, task, found[kind]["settings"])


def _cheapest(found: Mapping[str, Any], default: str) -> str:
    """Kind of controller that cost least."""
    return min(found, key=lambda kind: float(found[kind]["cost"]), default=default)


def no_path(kind: str, task: BenchmarkTask) -> InputError:
    """Error of guidance that has nothing to follow."""
    where = task.name or task.environment
    return InputError(
        f"controller: expected a path for '{kind}', got none in '{where}'"
    )
