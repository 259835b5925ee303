"""Integral line of sight over any heading autopilot.

Source: Borhaug, Pavlov & Pettersen 2008, Integral LOS control for path following of
underactuated marine surface vessels in the presence of constant ocean currents, 47th
IEEE Conference on Decision and Control.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from agents.controllers.controller import Controller
from agents.controllers.guided import GuidanceSettings, Guided
from agents.controllers.law import Number, PathSignals
from agents.settings import Step, setting
from shipgym import ShipModel
from shipgym.tasks.task import Task

# integral time over lookahead time with which s^2 + s / T + 1 / (T Ti) has a double
# root
CRITICAL = 4.0


class LineOfSightGains(NamedTuple):
    """Parameters of `integral_line_of_sight`."""

    lookahead: float  # m
    integral: float  # 1/s
    dt: float  # s


class DriftMemory(NamedTuple):
    """Memory of `integral_line_of_sight`."""

    drift: Number  # m


def integral_line_of_sight(
    seen: PathSignals, memory: DriftMemory, p: LineOfSightGains
) -> tuple[Number, DriftMemory]:
    """Course with integral of the cross-track error (Borhaug et al. 2008, eq. 12)."""
    cross_track = seen.cross_track
    offset = cross_track + memory.drift
    squared = p.lookahead * p.lookahead
    rate = p.integral * squared * cross_track / (offset * offset + squared)
    drift = memory.drift + p.dt * rate
    course = -np.arctan2(offset, p.lookahead)
    return course, DriftMemory(drift)


@dataclass(frozen=True)
class LineOfSightSettings(GuidanceSettings):
    """Settings of integral line of sight."""

    integral_lengths: float | None = setting(
        "time over which a steady cross-track error is integrated to as much again, in"
        " times to travel one ship length; by default 4 times `lookahead_lengths`, with"
        " which the way back to the path is critically damped; less swings, more is"
        " slower",
        None,
        above=0.0,
        search=Step(0.5),
    )

    def completed(
        self, model: ShipModel, task: Task, autopilot: Controller | None = None
    ) -> Self:
        """See `GuidanceSettings.completed`."""
        own = super().completed(model, task)
        if own.integral_lengths is not None:
            return own
        lookahead: Any = own.lookahead_lengths
        return replace(own, integral_lengths=CRITICAL * lookahead)

    def gains(self, model: ShipModel, task: Task, autopilot: Any) -> dict[str, float]:
        """Gains in SI units; of whole settings."""
        own: Any = self
        return {
            "lookahead": own.lookahead_lengths * model.particulars["length"],
            "integral": 1.0 / (own.integral_lengths * model.travel_time),
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class IntegralLineOfSight(Guided):
    """Line of sight with an integral of the cross-track error.

    The error goes to 0 in a steady current.
    """

    kind = "ilos"
    settings_type = LineOfSightSettings
    law = staticmethod(integral_line_of_sight)
    parameters_record = LineOfSightGains
    memory_record = DriftMemory
    gain_names = (*Guided.gain_names, "integral")
