"""Classical controllers by name, designed for the ship, the control interval and the path of a task."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from agents.agent_file import load_agent
from agents.controllers.controller import Controller, model_hash
from agents.controllers.registry import BUILT_IN, controller_class
from agents.suites.reference import load_tuned
from agents.suites.suite import BenchmarkTask
from shipgym import InputError, ShipModel

#: In an order in which those come first that others build on; the suites know no rate
#: of turn to steer.
CLASSICAL = tuple(kind for kind in BUILT_IN if kind != "turn-rate")
#: Of these, no bases for policies unless asked for by name: MPC simulates, an action
#: takes it 97 us where wheel-over needs 2.
NO_BASES = ("mpc",)
INNER = "lq_"  # before settings of the LQ that a guidance law leads


@dataclass(frozen=True)
class _Ship:
    """A ship that equals another of the same numbers."""

    model: ShipModel = field(compare=False)
    sha256: str  # of its numbers


def design(
    kind: str, task: BenchmarkTask, settings: Mapping[str, Any] | None = None
) -> Controller:
    """A classical controller for a task.

    `kind`: as registered (`agents.controllers.registry`); `task`: its ship and control
    interval; of a guidance law also its path's lookahead and corridor; `settings`:
    keywords of `from_model`; of a guidance law also those of the LQ that it leads,
    after `lq_`. Raises InputError if there is no such design for the ship, or guidance
    has no path to follow.
    """
    made: Any = controller_class(kind)
    given = settings or {}
    if not made.has_autopilot:
        written = json.dumps(dict(given), sort_keys=True)
        ship = _Ship(task.ship, model_hash(task.ship))
        return _designed(made, ship, task.task.interval(task.ship), written)
    if not task.task.follows_path:
        raise no_path(kind, task)
    inner = {
        key.removeprefix(INNER): value
        for key, value in given.items()
        if key.startswith(INNER)
    }
    own = {key: value for key, value in given.items() if not key.startswith(INNER)}
    guide: Controller = made.from_model(
        task.ship, autopilot=design("lq", task, inner), task=task.task, **own
    )
    return guide


def tuned(kind: str, task: BenchmarkTask, suite: str) -> Controller:
    """A classical controller with the settings found for a task of a suite.

    `kind`: of `CLASSICAL`; "best" is that which cost least, "base" likewise without
    `NO_BASES`; `suite`: its name. Raises InputError if there are no such settings.
    """
    found = load_tuned(suite).get(task.name, {})
    without = {"best": (), "base": NO_BASES}.get(kind)
    if without is not None:
        costs = {
            name: float(one["cost"])
            for name, one in found.items()
            if name not in without
        }
        kind = min(costs, key=costs.__getitem__, default=kind)
    if kind not in found:
        raise InputError(
            f"there are no tuned settings of '{kind}' for task '{task.name}' of suite"
            f" '{suite}', only of: {', '.join(found) or 'none'}"
        )
    return design(kind, task, found[kind]["settings"])


def no_path(kind: str, task: BenchmarkTask) -> InputError:
    """What is said where guidance has nothing to follow."""
    where = task.name or task.environment
    return InputError(
        f"controller: '{kind}' found, but '{where}' has no path to follow"
    )


@lru_cache(maxsize=256)
def _designed(kind: Any, ship: _Ship, dt: float, settings: str) -> Controller:
    made: Controller = kind.from_model(ship.model, dt=dt, **json.loads(settings))
    return made


def design_base(name: str, task: BenchmarkTask) -> Controller | None:
    """What a policy adds to: the controller of the setting `base`.

    `name`: "none"; a kind of controller, which is designed on the task's ship; "tuned",
    the best of those that were tuned for the task of a suite, without `NO_BASES`; or a
    controller's file. Raises InputError if the ship has no such controller, the file is
    not one for her, or guidance has no path to follow.
    """
    if name == "none":
        return None
    if name == "tuned":
        if task.suite:
            return tuned("base", task, task.suite)
        raise InputError(
            "base: 'tuned' found without a task of the suite, expected --task, or"
            " another base"
        )
    if name.endswith(".json"):
        agent = load_agent(name, task.ship)
        if not isinstance(agent, Controller):
            raise InputError(
                f"base: {name} holds a learned policy, expected a classical controller"
            )
        return agent
    return design(name, task)
