"""Wheel-over: line of sight that looks ahead along the turns of the path.

The course is that of the path so far ahead as the ship runs on before she turns. The
angle between her course over ground and her way through the water, as observed,
counters a current.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3
(line of sight); IEC 62065 (track control: legs, arcs, wheel-over line).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import POSITIVE, Bounds, Controller
from agents.controllers.guided import (
    COURSE_ERROR,
    TURNS,
    GuidanceSettings,
    Guided,
    bend,
)
from agents.controllers.law import (
    Nothing,
    Number,
    PathSignals,
    wrapped,
)
from agents.controllers.lq import LQ
from agents.settings import Step, setting
from shipgym import ShipModel
from shipgym.models.linear import small_motions
from shipgym.tasks.task import Task

SHORTEST_LEAD, LONGEST_LEAD = 0.1, 10.0  # ship lengths


class WheelOverGains(NamedTuple):
    """Parameters of `wheel_over_law`."""

    lookahead: float  # m
    turn_reach: float  # m, how far ahead the path's course is taken
    path_radius: float  # m, of its arcs
    crab_share: float  # share of the angle of drift by the current that is countered


def wheel_over_law(
    seen: PathSignals, memory: Nothing, p: WheelOverGains
) -> tuple[Number, Nothing]:
    """Course that comes to the path and turns with it, against a current's drift."""
    leeway = np.arctan2(seen.sway, seen.surge)  # through the water
    crab = wrapped(seen.drift - leeway)
    ahead = bend(p.turn_reach, seen.turns, p.path_radius)
    course = ahead - np.arctan2(seen.cross_track, p.lookahead)
    return course - p.crab_share * crab, memory


@dataclass(frozen=True)
class WheelOverSettings(GuidanceSettings):
    """Settings of wheel-over."""

    reach_lengths: float | None = setting(
        "how far ahead the path's course is taken, ship lengths; by default `own_lead`",
        None,
        above=0.0,
        search=Step(0.4),
    )
    crab_share: float = setting(
        "share of the angle of drift by the current that is countered",
        1.0,
        at_least=0.0,
        at_most=2.0,
        search=Step(0.2, is_factor=False),
    )

    def completed(
        self, model: ShipModel, task: Task, autopilot: Controller | None = None
    ) -> Self:
        """See `GuidanceSettings.completed`."""
        own = super().completed(model, task)
        if own.reach_lengths is not None:
            return own
        return replace(own, reach_lengths=own_lead(model, autopilot))

    def gains(self, model: ShipModel, task: Task, autopilot: Any) -> dict[str, float]:
        """Gains in SI units; of whole settings."""
        own = self
        length = model.particulars["length"]
        return {
            "lookahead": length * own.lookahead_lengths,
            "turn_reach": length * own.reach_lengths,
            "crab_share": own.crab_share,
            "path_radius": length * task.turn_radius,
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class WheelOver(Guided):
    """Line of sight that begins turns where the ship needs to, against currents too."""

    kind = "wheel-over"
    settings_type = WheelOverSettings
    law = staticmethod(wheel_over_law)
    parameters_record = WheelOverGains
    observes = (*Guided.observes, *COURSE_ERROR, *TURNS)
    reads: ClassVar[tuple[str, ...]] = (
        "cross_track",
        "drift",
        "sway",
        "surge",
        *TURNS,
    )
    gain_names = (
        *Guided.gain_names,
        "turn_reach",
        "crab_share",
        "path_radius",
    )
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Guided.bounds,
        "path_radius": POSITIVE,
    }


def own_lead(model: ShipModel, autopilot: Controller | None) -> float:
    """Distance ahead at which LQ has to see an arc to keep to it, ship lengths.

    In a steady turn the heading lags by what makes the rudder for it, and the way over
    ground by the drift angle; both in proportion to the yaw rate as long as the ship is
    linear: 0 = A (v, r) + B delta. What she is slow to begin with comes to a
    quarter of a length more. `autopilot`: by default, and in place of others,
    `LQ.from_model(model)`.
    """
    if not isinstance(autopilot, LQ):
        autopilot = LQ.from_model(model)
    _, steering, by_rudder = small_motions(model)
    by_sway, by_yaw_rate = steering.T
    columns = np.column_stack([by_sway, by_rudder])
    sway, rudder = np.linalg.solve(columns, -by_yaw_rate)  # m and s, per yaw rate

    # the order is the angle: the heading error makes what the other gains do not
    gains = autopilot.gains
    unfed = rudder * (1.0 - gains["rudder"])
    missing = unfed - gains["yaw_rate"] - gains["sway"] * sway
    heading_lag = missing / gains["heading_error"]  # s

    lag_m = heading_lag * model.particulars["speed"] - sway
    late = 0.25  # measured on the reference ships as they begin to turn, ship lengths
    lead = lag_m / model.particulars["length"] + late
    return float(np.clip(lead, SHORTEST_LEAD, LONGEST_LEAD))
