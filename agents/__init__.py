"""Autopilots for the ships of shipgym: classical designs, learning, the benchmark, and the command line.

Everything is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from agents.agent_file import load_agent
    from agents.benchmarking.results import BenchmarkResult, load_results
    from agents.benchmarking.run import benchmark
    from agents.controllers.adaptive_lq import AdaptiveLQ
    from agents.controllers.checker import check_controller
    from agents.controllers.controller import Controller, Policy
    from agents.controllers.filtered_pid import FilteredPID
    from agents.controllers.los_autopilot import AdaptiveLineOfSight, IntegralLineOfSight, LineOfSight
    from agents.controllers.lq import LQ
    from agents.controllers.lqg import LQG
    from agents.controllers.mpc import MPC
    from agents.controllers.pid import PID
    from agents.controllers.robustness import MarginSpread, margin_spread
    from agents.controllers.scheduled_lq import ScheduledLQ
    from agents.policies.policy import LearnedPolicy
    from agents.policies.shield import Shielded, interventions
    from agents.rollouts.course_keeping import Episodes, Flights, StepResponses, fly, sail, step_response
    from agents.rollouts.rollout import Rollout, rollout

_HOME = {
    "AdaptiveLineOfSight": "agents.controllers.los_autopilot",
    "IntegralLineOfSight": "agents.controllers.los_autopilot",
    "LQ": "agents.controllers.lq",
    "LQG": "agents.controllers.lqg",
    "LearnedPolicy": "agents.policies.policy",
    "LineOfSight": "agents.controllers.los_autopilot",
    "MPC": "agents.controllers.mpc",
    "MarginSpread": "agents.controllers.robustness",
    "PID": "agents.controllers.pid",
    "AdaptiveLQ": "agents.controllers.adaptive_lq",
    "BenchmarkResult": "agents.benchmarking.results",
    "Controller": "agents.controllers.controller",
    "FilteredPID": "agents.controllers.filtered_pid",
    "Episodes": "agents.rollouts.course_keeping",
    "Flights": "agents.rollouts.course_keeping",
    "Policy": "agents.controllers.controller",
    "Rollout": "agents.rollouts.rollout",
    "ScheduledLQ": "agents.controllers.scheduled_lq",
    "Shielded": "agents.policies.shield",
    "StepResponses": "agents.rollouts.course_keeping",
    "benchmark": "agents.benchmarking.run",
    "check_controller": "agents.controllers.checker",
    "fly": "agents.rollouts.course_keeping",
    "interventions": "agents.policies.shield",
    "load_agent": "agents.agent_file",
    "load_results": "agents.benchmarking.results",
    "margin_spread": "agents.controllers.robustness",
    "rollout": "agents.rollouts.rollout",
    "sail": "agents.rollouts.course_keeping",
    "step_response": "agents.rollouts.course_keeping",
}

__all__ = [
    "LQ",
    "LQG",
    "MPC",
    "PID",
    "AdaptiveLQ",
    "AdaptiveLineOfSight",
    "BenchmarkResult",
    "Controller",
    "Episodes",
    "FilteredPID",
    "Flights",
    "IntegralLineOfSight",
    "LearnedPolicy",
    "LineOfSight",
    "MarginSpread",
    "Policy",
    "Rollout",
    "ScheduledLQ",
    "Shielded",
    "StepResponses",
    "benchmark",
    "check_controller",
    "fly",
    "interventions",
    "load_agent",
    "load_results",
    "margin_spread",
    "rollout",
    "sail",
    "step_response",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'agents' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
