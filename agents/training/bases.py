"""What policies add to: a classical controller by name, as tuned for the task, or from a file."""

from __future__ import annotations

from agents.agent_file import load_agent
from agents.controllers.controller import Controller
from agents.controllers.designs import design, tuned
from agents.suites.suite import BenchmarkTask, suite_of
from shipgym.errors import InputError


def design_base(name: str, task: BenchmarkTask) -> Controller | None:
    """The controller of the setting `base`.

    `name`: "none"; a kind of controller, which is designed on the task's ship; "tuned", the best of those
    that were tuned for the task of a suite, without `NO_BASES`; or a controller's file; `task`: the ship, the
    control interval and the path. Raises InputError if the ship has no such controller, the file is not one
    for her, or guidance has no path to follow.
    """
    if name == "none":
        return None
    if name == "tuned":
        suite = suite_of(task.name)
        if suite is None:
            raise InputError(
                "base: 'tuned' found without a task of the suite, expected --task, or another base"
            )
        return tuned("base", task, suite)
    if name.endswith(".json"):
        agent = load_agent(name, task.ship)
        if not isinstance(agent, Controller):
            raise InputError(f"base: {name} holds a learned policy, expected a classical controller")
        return agent
    return design(name, task)
