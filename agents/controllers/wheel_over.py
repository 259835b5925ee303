"""Wheel-over: line of sight that looks ahead along the turns of the path.

The course is that of the path so far ahead as the ship runs on before she turns. The
angle between her course over ground and her way through the water, as observed,
counters a current.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3
(line of sight); IEC 62065 (track control: legs, arcs, wheel-over line).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import ANY_NUMBER, Bounds
from agents.controllers.guided import COURSE_ERROR, TURNS, Guided, bend, with_path
from agents.controllers.interface import Policy
from agents.controllers.law import (
    Law,
    Nothing,
    Number,
    PathSignals,
    Turns,
    wrapped,
)
from agents.controllers.linear_loop import small_motions
from agents.controllers.lq import LQ
from shipgym import ShipModel
from shipgym.checks import check_number
from shipgym.models.by_name import takes_name
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
    course = course_over_ground(seen.cross_track, seen.turns, p)
    return course - p.crab_share * crab, memory


def course_over_ground(cross_track: Number, turns: Turns, p: WheelOverGains) -> Number:
    """Course over ground that comes to the path and turns with it, rad."""
    ahead = bend(p.turn_reach, turns, p.path_radius)
    return ahead - np.arctan2(cross_track, p.lookahead)


@dataclass(frozen=True, eq=False, kw_only=True)
class WheelOver(Guided):
    """Line of sight that begins turns where the ship needs to, against currents too."""

    kind: ClassVar[str] = "wheel-over"
    law: ClassVar[Law] = staticmethod(wheel_over_law)
    observes: ClassVar[tuple[str, ...]] = (*Guided.observes, *COURSE_ERROR, *TURNS)
    reads: ClassVar[tuple[str, ...]] = (
        "cross_track",
        "drift",
        "sway",
        "surge",
        *TURNS,
    )
    gain_names: ClassVar[tuple[str, ...]] = (
        *Guided.gain_names,
        "turn_reach",
        "crab_share",
        "path_radius",
    )
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Guided.bounds,
        "turn_reach": Bounds(0.0, ANY_NUMBER.largest),
        "crab_share": Bounds(0.0, 2.0),
        "path_radius": Bounds(1e-6, ANY_NUMBER.largest),
    }

    @classmethod
    @takes_name
    def from_model(
        cls,
        model: ShipModel,
        *,
        autopilot: Policy | None = None,
        task: Task | None = None,
        lookahead_lengths: float | None = None,
        reach_lengths: float | None = None,
        crab_share: float = 1.0,
    ) -> Self:
        """Lead an autopilot along the paths of a task.

        Raises InputError if an argument is out of its range, or the autopilot was
        designed for another ship.

        Parameters
        ----------
        model, autopilot, task
            As in `IntegralLineOfSight.from_model`.
        lookahead_lengths : float, optional
            Lookahead on a leg, ship lengths; by default the task's.
        reach_lengths : float, optional
            How far ahead the path's course is taken, ship lengths; by default
            `own_lead`.
        crab_share : float
            Share of the angle of drift by the current that is countered.
        """
        asked = with_path(task)
        if lookahead_lengths is None:
            lookahead_lengths = asked.lookahead
        check_number(lookahead_lengths, "lookahead_lengths", above=0.0)
        if reach_lengths is None:
            reach_lengths = own_lead(model, autopilot)
        check_number(reach_lengths, "reach_lengths", above=0.0)
        check_number(crab_share, "crab_share", at_least=0.0, at_most=2.0)

        length = model.particulars["length"]
        gains = {
            "lookahead": length * lookahead_lengths,
            "turn_reach": length * reach_lengths,
            "crab_share": float(crab_share),
            "path_radius": length * asked.turn_radius,
        }
        return cls.leading(model, autopilot, asked, gains, {})

    @cached_property
    def parameters(self) -> WheelOverGains:
        """Parameters of its law."""
        gains = self.gains
        return WheelOverGains(
            lookahead=gains["lookahead"],
            turn_reach=gains["turn_reach"],
            path_radius=gains["path_radius"],
            crab_share=gains["crab_share"],
        )


def own_lead(model: ShipModel, autopilot: Policy | None) -> float:
    """Distance ahead at which LQ has to see an arc to keep to it, ship lengths.

    In a steady turn the heading lags by what makes the rudder for it, and the way over
    ground by the drift angle; both in proportion to the yaw rate as long as the ship is
    linear: 0 = A (v, r) + B delta. What she is slow to begin with comes to a
    quarter of a length more. `autopilot`: by default, and in place of others,
    `LQ.from_model(model)`.
    """
    if not isinstance(autopilot, LQ):
        autopilot = LQ.from_model(model)
    turn = steady_turn(model)

    # the order is the angle: the heading error makes what the other gains do not
    gains = autopilot.gains
    unfed = turn.rudder * (1.0 - gains["rudder"])
    missing = unfed - gains["yaw_rate"] - gains["sway"] * turn.sway
    heading_lag = missing / gains["heading_error"]  # s

    lag_m = heading_lag * model.particulars["speed"] - turn.sway
    late = 0.25  # measured on the reference ships as they begin to turn, ship lengths
    lead = lag_m / model.particulars["length"] + late
    return float(np.clip(lead, SHORTEST_LEAD, LONGEST_LEAD))


class SteadyTurn(NamedTuple):
    """Steady turn of a linear ship, per yaw rate."""

    sway: float  # m
    rudder: float  # s


def steady_turn(model: ShipModel) -> SteadyTurn:
    """Solve 0 = A (v, r) + B delta for sway and rudder."""
    _, steering, rudder = small_motions(model)
    by_sway, by_yaw_rate = steering.T
    by_sway_and_rudder = np.column_stack([by_sway, rudder])
    solution = np.linalg.solve(by_sway_and_rudder, -by_yaw_rate)
    return SteadyTurn(*solution)
