"""Wheel-over: line of sight that begins each turn where the ship's own turn needs her to.

As far before a waypoint as the tangent of her turning circle and the distance that she
runs on before she turns, the larger course of this leg and the next is steered, for a
turn to port the smaller. On a path with arcs between its legs the course is that of the
path so far ahead as she runs on. The angle between her way over ground and her way
through the water, as observed, counters a current.

Sources: Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, 10.3
(line of sight); IEC 62065 (track control: wheel-over line); Crane, Eda & Landsburg
1989, Principles of Naval Architecture III, chapter IX, 5 (advance, transfer, tactical
diameter).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Self

import numpy as np

from agents.controllers.controller import NUMBERS, Policy, Range
from agents.controllers.los_autopilot import Guided
from agents.controllers.lq import LQ
from agents.controllers.memory import Floats
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.manoeuvres.turning import turning_circle, turning_indices
from shipgym.ships.linear import linearise, straight_running
from shipgym.tasks.guidance import wrapped
from shipgym.tasks.task import Task, path_following_task

TURN_LENGTHS, TURN_STEP = (
    60.0,
    0.02,
)  # of the simulated turn, ship lengths at service speed
TURN_RUDDER = (
    0.3  # share of the rudder limit that a turn is planned with: 10.5 degrees of 35
)
STEEPEST = np.radians(70.0)  # angle to a leg up to which a ship comes forward on it
LATE = 0.25  # ship lengths
COURSE_ERROR = ("course_error_sin", "course_error_cos")


@dataclass(frozen=True, eq=False, kw_only=True)
class WheelOver(Guided):
    """Line of sight that begins turns by the ship's own turning circle, and counters the current."""

    kind: ClassVar[str] = "wheel-over"
    observes: ClassVar[tuple[str, ...]] = (
        *Guided.observes,
        *COURSE_ERROR,
        "next_turn_distance",
        "next_turn_angle",
        "second_turn_distance",
        "second_turn_angle",
    )
    reads: ClassVar[tuple[str, ...]] = ("cross_track", "course", "sway", "surge")
    gain_names: ClassVar[tuple[str, ...]] = (
        "lookahead",
        "task_lookahead",
        "turn_lookahead",
        "turn_radius",
        "turn_reach",
        "crab_share",
        "path_radius",
    )
    ranges: ClassVar[Mapping[str, Range]] = {
        **Guided.ranges,
        "turn_lookahead": Range(1e-6, NUMBERS.largest),
        "crab_share": Range(0.0, 2.0),
        **dict.fromkeys(
            ("turn_radius", "turn_reach", "path_radius"), Range(0.0, NUMBERS.largest)
        ),
    }

    @classmethod
    def from_model(
        cls,
        model: ShipModel,
        *,
        autopilot: Policy | None = None,
        task: Task | None = None,
        lookahead_lengths: float | None = None,
        turn_lookahead_lengths: float | None = None,
        radius_lengths: float | None = None,
        reach_lengths: float | None = None,
        crab_share: float = 1.0,
    ) -> Self:
        """Lead an autopilot along the paths of a task.

        Raises InputError if an argument is out of its range, the autopilot was designed
        for another ship, or the model does not turn.

        Parameters
        ----------
        model, autopilot, task
            As in `LineOfSight.from_model`.
        lookahead_lengths, turn_lookahead_lengths : float, optional
            Lookahead on a leg, and towards the next leg in a turn, ship lengths; by
            default the task's.
        radius_lengths, reach_lengths : float, optional
            Radius of the turn and what she runs on before it, ship lengths; by default
            those of the model with three tenths of the rudder's limit (`own_turn`). On
            a path with arcs the reach is how far ahead its course is taken, by default
            `own_lead`.
        crab_share : float
            Share of the angle of drift by the current that is countered.
        """
        asked, length = task or path_following_task(), model.particulars["length"]
        arcs = float(getattr(asked.settings, "turn_radius", 0.0))
        radius, reach = (arcs, own_lead(model, autopilot)) if arcs else (0.0, 0.0)
        if not arcs and None in (radius_lengths, reach_lengths):
            radius, reach = own_turn(model)
        given = {
            "lookahead": ("lookahead_lengths", lookahead_lengths, asked.lookahead),
            "turn_lookahead": (
                "turn_lookahead_lengths",
                turn_lookahead_lengths,
                asked.lookahead,
            ),
            "turn_radius": ("radius_lengths", radius_lengths, radius),
            "turn_reach": ("reach_lengths", reach_lengths, reach),
        }
        gains = {
            name: (
                length
                * check_number(own if value is None else value, argument, above=0.0)
            )
            for name, (argument, value, own) in given.items()
        }
        gains["crab_share"] = check_number(
            crab_share, "crab_share", at_least=0.0, at_most=2.0
        )
        gains["path_radius"] = length * arcs
        return cls.leading(model, autopilot, asked, gains, {})

    @property
    def turns_ahead(self) -> tuple[str, ...]:
        """See `Guided.turns_ahead`."""
        return self.observation_names[-4:]

    def course(
        self, seen: Mapping[str, Floats], memory: Floats
    ) -> tuple[Floats, Floats]:
        """See `Guided.course`; nothing is remembered."""
        turns = [seen[name] for name in self.turns_ahead]
        crab = wrapped(self.over_ground(seen) - np.arctan2(seen["sway"], seen["surge"]))
        wanted = self.course_along(seen["cross_track"], turns) - self.shift(turns)
        return wanted - self.gains["crab_share"] * crab, memory

    def over_ground(self, seen: Mapping[str, Floats]) -> Floats:
        """Angle from the heading to the course over ground, rad."""
        return seen["heading_error"] - np.arctan2(
            *(seen[name] for name in COURSE_ERROR)
        )

    def shift(self, turns: Sequence[Floats]) -> Floats | float:
        """See `Guided.shift`: on a path with arcs half a lookahead ahead."""
        radius, half = self.gains["path_radius"], 0.5 * self.gains["task_lookahead"]
        return bend(half, turns, radius) if radius > 0.0 else 0.0

    def heading(self, seen: Mapping[str, Floats], turns: Sequence[Floats]) -> Floats:
        """Heading against the course of the path beside the ship, rad."""
        to_path = np.arctan2(seen["cross_track"], self.gains["task_lookahead"])
        return self.shift(turns) - to_path - seen["heading_error"]

    def course_along(self, cross: Floats, turns: Sequence[Floats]) -> Floats:
        """Course over ground to steer, against that of the path beside the ship, rad.

        `cross`: distance from the path, m, positive to starboard; `turns`: distance and
        angle of each turn to come, m and rad.
        """
        gains = self.gains
        own: Floats = -np.arctan2(cross, gains["lookahead"])
        if gains["path_radius"] > 0.0:
            return own + bend(gains["turn_reach"], turns, gains["path_radius"])
        to_go, turn = turns[:2]
        side, beside = (
            np.sign(turn),
            to_go * np.sin(turn) + cross * np.cos(turn),
        )  # of the next leg
        following = side * (turn - np.arctan2(beside, gains["turn_lookahead"]))
        # beyond 90 degrees she would turn back before the leg ends: not earlier, and
        # not steeper
        tangent = gains["turn_radius"] * np.minimum(np.abs(np.tan(0.5 * turn)), 1.0)
        near = (to_go < tangent + gains["turn_reach"]) & (side != 0.0)
        return np.where(
            near, side * np.maximum(side * own, np.minimum(following, STEEPEST)), own
        )


def bend(distance: float, turns: Sequence[Floats], radius: float) -> Floats:
    """Change of a path's course over a distance ahead, rad; its turns are arcs of one radius, m."""
    course: Floats = np.zeros_like(turns[0])
    for begin, turn in zip(turns[::2], turns[1::2], strict=True):
        course = course + np.sign(turn) * np.clip(
            (distance - begin) / radius, 0.0, np.abs(turn)
        )
    return course


@lru_cache(maxsize=64)
def own_turn(model: ShipModel, share: float = TURN_RUDDER) -> tuple[float, float]:
    """Radius of a ship's turn and how far she runs on before it, ship lengths.

    Half the tactical diameter, and the advance less that, means of both sides. `share`:
    of the rudder limit. Raises InputError if the ship does not turn round.
    """
    length, speed = model.particulars["length"], model.particulars["speed"]
    time, step = TURN_LENGTHS * length / speed, TURN_STEP * length / speed
    rudder = np.degrees(share * model.steering.limit)
    turns = [turning_circle(model, side * rudder, time, step) for side in (1.0, -1.0)]
    found = [turning_indices(turn, length) for turn in turns]
    across = [one.tactical_diameter_lengths for one in found]
    ahead = [one.advance_lengths for one in found]
    if None in (*across, *ahead):
        raise InputError(
            f"model {model.name!r} does not turn round within {TURN_LENGTHS:g} lengths"
            f" with {rudder:.1f} degrees of rudder; give radius_lengths and"
            " reach_lengths"
        )
    radius = 0.5 * float(np.mean(np.abs(np.array(across, dtype=np.float64))))
    return radius, max(float(np.mean(np.array(ahead, dtype=np.float64))) - radius, 0.01)


def own_lead(model: ShipModel, autopilot: Policy | None) -> float:
    """How far ahead of her LQ (or its default) has to see the course of an arc to keep to it, ship lengths.

    In a steady turn the heading lags by what makes the rudder for it, and her way by
    the drift angle; both in proportion to the rate of turn as long as she is linear.
    What she is slow to begin with comes to a quarter of a length more, as measured on
    the reference ships.
    """
    gains = (autopilot if isinstance(autopilot, LQ) else LQ.from_model(model)).gains
    steering, rudder = linearise(model, straight_running(model))
    sway, angle = np.linalg.solve(
        np.column_stack([steering[:, 0], np.ravel(rudder)]), -steering[:, 1]
    )
    lag = angle * (1.0 - gains["rudder"]) - gains["yaw_rate"] - gains["sway"] * sway
    length, speed = model.particulars["length"], model.particulars["speed"]
    return float(
        np.clip(
            (lag / gains["heading_error"] * speed - sway) / length + LATE, 0.1, 10.0
        )
    )
