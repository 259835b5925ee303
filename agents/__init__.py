"""Autopilots for the ships of shipgym: classical designs, their flights, and the command line.

Everything is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from agents.adaptive_lq import AdaptiveLQ
    from agents.benchmarking.results import BenchmarkResult, load_results
    from agents.benchmarking.run import benchmark
    from agents.checker import check_controller
    from agents.controller import Controller, Policy
    from agents.controller_file import load_agent
    from agents.filtered_pid import FilteredPID
    from agents.flight import Flights, StepResponses, fly, step_response
    from agents.los_autopilot import AdaptiveLineOfSight, IntegralLineOfSight, LineOfSight
    from agents.lq import LQ
    from agents.lqg import LQG
    from agents.mpc import MPC
    from agents.pid import PID
    from agents.policy import LearnedPolicy
    from agents.robustness import MarginSpread, margin_spread
    from agents.scheduled_lq import ScheduledLQ
    from agents.shield import Shielded, interventions

_HOME = {
    "AdaptiveLineOfSight": "agents.los_autopilot",
    "IntegralLineOfSight": "agents.los_autopilot",
    "LQ": "agents.lq",
    "LQG": "agents.lqg",
    "LearnedPolicy": "agents.policy",
    "LineOfSight": "agents.los_autopilot",
    "MPC": "agents.mpc",
    "MarginSpread": "agents.robustness",
    "PID": "agents.pid",
    "AdaptiveLQ": "agents.adaptive_lq",
    "BenchmarkResult": "agents.benchmarking.results",
    "Controller": "agents.controller",
    "FilteredPID": "agents.filtered_pid",
    "Flights": "agents.flight",
    "Policy": "agents.controller",
    "ScheduledLQ": "agents.scheduled_lq",
    "Shielded": "agents.shield",
    "StepResponses": "agents.flight",
    "benchmark": "agents.benchmarking.run",
    "check_controller": "agents.checker",
    "fly": "agents.flight",
    "interventions": "agents.shield",
    "load_agent": "agents.controller_file",
    "load_results": "agents.benchmarking.results",
    "margin_spread": "agents.robustness",
    "step_response": "agents.flight",
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
    "FilteredPID",
    "Flights",
    "IntegralLineOfSight",
    "LearnedPolicy",
    "LineOfSight",
    "MarginSpread",
    "Policy",
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
    "step_response",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'agents' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
