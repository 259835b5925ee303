"""LQ path tracking with preview: the path's turns are read ahead and weighed.

LQ steers heading and yaw rate around a course over ground. That is the sum of the
path's curvature ahead, each metre of it weighed by how far ahead it is: positive
weights turn with the path in good time, negative ones far ahead put the ship outside of
a turn before it. Line of sight leads back to the path. The heading for the course
counters the current that is seen, as a vector. Sway, heel and its rate change it where
they are seen. Waves are kept from the rudder by low-passes and dead-bands.

Sources: Tomizuka 1975, Optimal continuous finite preview problem, IEEE Transactions on
Automatic Control 20 (weights on what lies ahead); Fossen 2011, Handbook of Marine Craft
Hydrodynamics and Motion Control, 10.3 (line of sight), 2.4 (crab angle), 13.2
(dead-band and filters of autopilots); van Amerongen 1982, Adaptive steering of ships
(gain by speed).
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
)
from agents.controllers.law import (
    Number,
    PathSignals,
    clipped,
    rotated,
    slowness_of,
    wrapped,
)
from agents.controllers.lq import LQ
from agents.controllers.seen_current import (
    CurrentMemory,
    seen_current,
)
from agents.controllers.wheel_over import own_lead
from agents.settings import Step, setting
from shipgym import InputError, ShipModel
from shipgym.tasks.task import Task


class PreviewGains(NamedTuple):
    """Parameters of `preview_law`."""

    lookahead: float  # m, of the line of sight back to the track
    reach: float  # m, how far ahead the path's curvature counts
    weight_0: float  # of curvature beside the ship
    weight_1: float  # at a tenth of the reach
    weight_2: float  # at two tenths
    weight_3: float  # at three tenths
    weight_4: float  # at six tenths; at the reach it is 0
    reach_power: float  # of speed over ground over service speed, on the reach
    crab_share: float  # share of the crab angle that is steered
    course_share: float  # share of heading and yaw rate by the course over ground
    current_update: float  # share of a new current in its low-pass
    yaw_update: float  # share of a new yaw rate in its low-pass
    yaw_gain: float  # s: gain of LQ on the yaw rate over that on the heading error
    schedule: float  # of LQ's gain on the yaw rate by the speed
    sway_gain: float  # s/m: rad of course per m/s of sway
    roll_gain: float  # rad of course per rad of heel
    roll_rate_gain: float  # s: rad of course per rad/s of heel
    dead_band: float  # rad, of the heading error
    speed_power: float  # of service speed over speed, on the heading error
    path_radius: float  # m, of its arcs
    sight: float  # m, beyond which turns are not seen
    service_speed: float  # m/s
    interval: float  # s, between two commands


class PreviewMemory(NamedTuple):
    """Memory of `preview_law`."""

    current: CurrentMemory
    off: Number  # rad, direction of the path less heading
    yaw_rate: Number  # rad/s, filtered


def preview_law(
    seen: PathSignals, memory: PreviewMemory, p: PreviewGains
) -> tuple[Number, PreviewMemory]:
    """Heading that keeps to the path and turns with it, against the path beside her."""
    current = seen_current(seen, memory.current, p)
    wanted = wanted_course(seen, current, p)
    course = wanted - p.crab_share * crab_angle(wanted, seen.surge, current, p)
    off = heading_error(seen, current, p)

    slowness = p.service_speed / np.maximum(seen.surge, 0.25 * p.service_speed)
    error = wrapped(off + course)
    quiet = error - clipped(error, -p.dead_band, p.dead_band)
    by_heading = quiet * np.exp(p.speed_power * np.log(slowness))
    turning = own_yaw_rate(seen, off, memory, current, p)
    yaw_rate = memory.yaw_rate + p.yaw_update * (turning - memory.yaw_rate)
    by_schedule = slowness_of(seen.surge, p.service_speed, p.schedule)
    by_yaw_rate = p.yaw_gain * by_schedule * (yaw_rate - seen.yaw_rate)
    by_roll = p.roll_gain * seen.roll + p.roll_rate_gain * seen.roll_rate
    most = 3.0  # rad; wrapped, a larger one would turn the rudder to the other side
    asked = by_heading + by_yaw_rate + by_roll + p.sway_gain * seen.sway
    steered = clipped(asked, -most, most)
    return steered - seen.heading_error, PreviewMemory(current, off, yaw_rate)


def wanted_course(seen: PathSignals, current: CurrentMemory, p: PreviewGains) -> Number:
    """Course over ground, against the direction of the path beside the ship, rad."""
    through_water, _ = rotated(seen.surge, seen.sway, seen.heading_error)
    over_ground = through_water + current.ahead
    pace = clipped(over_ground / p.service_speed, 0.3, 3.0)
    nearness = np.exp(-p.reach_power * np.log(pace))
    turns = seen.turns
    first = weighed_turn(turns.next_distance, turns.next_angle, nearness, p)
    second = weighed_turn(turns.second_distance, turns.second_angle, nearness, p)
    back = np.arctan2(seen.cross_track, p.lookahead)
    return first + second - back


def crab_angle(
    course: Number, surge: Number, current: CurrentMemory, p: PreviewGains
) -> Number:
    """Angle by which the current sets the ship off a course over ground, rad."""
    across = current.aside * np.cos(course) - current.ahead * np.sin(course)
    speed = np.maximum(surge, 0.25 * p.service_speed)
    return np.arcsin(clipped(across / speed, -0.8, 0.8))


def heading_error(seen: PathSignals, current: CurrentMemory, p: PreviewGains) -> Number:
    """Direction of the path less heading, as seen and by the course over ground, rad.

    Course over ground less leeway and crab angle is the heading without her yawing in
    waves; what the current is slow to see of it is left to the compass.
    """
    over_ground = wrapped(seen.drift - seen.heading_error)  # against the path
    leeway = np.arctan2(seen.sway, seen.surge)
    crab = crab_angle(over_ground, seen.surge, current, p)
    reckoned = leeway + crab - over_ground
    return seen.heading_error + p.course_share * wrapped(reckoned - seen.heading_error)


def own_yaw_rate(
    seen: PathSignals,
    off: Number,
    memory: PreviewMemory,
    current: CurrentMemory,
    p: PreviewGains,
) -> Number:
    """Yaw rate as seen, and by the change of the heading error, rad/s."""
    turned = current.turned - wrapped(off - memory.off)
    more = turned / p.interval - seen.yaw_rate
    likely = 0.05  # rad, in an interval: beyond, the path has changed
    has_started = memory.current.started > 0.0
    is_likely = has_started & (np.abs(more) * p.interval < likely)
    return seen.yaw_rate + np.where(is_likely, p.course_share * more, 0.0)


def weighed_turn(
    distance: Number, angle: Number, nearness: Number, p: PreviewGains
) -> Number:
    """Weighed curvature of an arc ahead, or of what is left of it, rad.

    Distances count `nearness` times.
    """
    begins = np.maximum(distance, 0.0)
    ends = begins + p.path_radius * np.abs(angle)
    summed = summed_weight(nearness * ends, p) - summed_weight(nearness * begins, p)
    return np.sign(angle) * summed / (nearness * p.path_radius)


def summed_weight(distance: Number, p: PreviewGains) -> Number:
    """Integral of the weights from the ship to a distance ahead, m.

    Between those given they are interpolated; at the reach and beyond they are 0.
    """
    share = np.minimum(distance / p.reach, 1.0)
    slope_1 = (p.weight_1 - p.weight_0) / 0.1
    slope_2 = (p.weight_2 - p.weight_1) / 0.1
    slope_3 = (p.weight_3 - p.weight_2) / 0.1
    slope_4 = (p.weight_4 - p.weight_3) / 0.3
    slope_5 = -p.weight_4 / 0.4
    return p.reach * (
        p.weight_0 * share
        + slope_1 * half_square(share)
        + (slope_2 - slope_1) * half_square(share - 0.1)
        + (slope_3 - slope_2) * half_square(share - 0.2)
        + (slope_4 - slope_3) * half_square(share - 0.3)
        + (slope_5 - slope_4) * half_square(share - 0.6)
    )


def half_square(distance: Number) -> Number:
    """Twofold integral of a step at 0."""
    ahead = np.maximum(distance, 0.0)
    return 0.5 * ahead * ahead


def curvature_weight(place: str, default: float) -> Any:
    """Setting of the weight of the path's curvature at a place."""
    return setting(
        f"weight of the path's curvature {place}; at the end of the reach it is 0",
        default,
        search=Step(0.15, is_factor=False),
    )


@dataclass(frozen=True)
class PreviewSettings(GuidanceSettings):
    """Settings of LQ with preview.

    The weights are by default those of the mean course of the path from half of
    `own_lead` ahead to one and a half.
    """

    reach_lengths: float | None = setting(
        "how far ahead the path's curvature counts, ship lengths; by default five times"
        " `own_lead`",
        None,
        above=0.0,
        search=Step(0.4),
    )
    weight_0: float = curvature_weight("beside the ship", 1.0)
    weight_1: float = curvature_weight("at a tenth of the reach", 1.0)
    weight_2: float = curvature_weight("at two tenths", 0.5)
    weight_3: float = curvature_weight("at three tenths", 0.0)
    weight_4: float = curvature_weight("at six tenths", 0.0)
    reach_power: float = setting(
        "power of speed over ground over service speed in the reach: 1 for a reach in"
        " time",
        0.0,
        search=Step(0.5, is_factor=False),
    )
    crab_share: float = setting(
        "share of the crab angle that is steered against a current",
        1.0,
        at_least=0.0,
        at_most=2.0,
        search=Step(0.2, is_factor=False),
    )
    course_share: float | None = setting(
        "share of heading and yaw rate that is reckoned from the course over ground,"
        " which waves move less; by default a half in waves, else 0",
        None,
        at_least=0.0,
        at_most=1.0,
        search=Step(0.3, is_factor=False),
    )
    current_time: float = setting(
        "time constant of a low-pass on the current, in times to travel a ship length",
        0.3,
        at_least=0.0,
        search=Step(1.0),
    )
    yaw_time: float = setting(
        "the same of the yaw rate", 0.0, at_least=0.0, search=Step(1.2, start=0.01)
    )
    sway_gain: float = setting(
        "change of course, rad, per sway over service speed",
        0.0,
        search=Step(0.5, is_factor=False),
    )
    dead_band_deg: float = setting(
        "heading error that is left alone, degrees",
        0.0,
        at_least=0.0,
        search=Step(1.2, start=0.05),
    )
    speed_power: float = setting(
        "power of service speed over speed in the gain on the heading error",
        0.0,
        search=Step(0.5, is_factor=False),
    )
    roll_gain: float = setting(
        "change of course per heel, where the task shows it",
        0.0,
        search=Step(0.4, is_factor=False),
    )
    roll_time: float = setting(
        "change of course per rate of heel, in times to travel one ship length",
        0.0,
        search=Step(0.4, is_factor=False),
    )

    def completed(
        self, model: ShipModel, task: Task, autopilot: Controller | None = None
    ) -> Self:
        """See `GuidanceSettings.completed`."""
        own = super().completed(model, task)
        reach, share = own.reach_lengths, own.course_share
        if reach is None:
            reach = 5.0 * own_lead(model, autopilot)
        if share is None:
            share = 0.0 if task.weather.waves is None else 0.5
        return replace(
            own,
            reach_lengths=reach,
            course_share=share,
        )

    def gains(self, model: ShipModel, task: Task, autopilot: LQ) -> dict[str, float]:
        """Gains in SI units, around LQ; of whole settings.

        Raises InputError for gains on heel where the task does not show it.
        """
        own = self
        dt = task.interval(model)
        inner = autopilot.gains
        length, speed = model.particulars["length"], model.particulars["speed"]
        travel_time = model.travel_time
        scales = {quantity.name: quantity.scale for quantity in task.observed(model)}
        feels_heel = self.roll_gain != 0.0 or self.roll_time != 0.0
        if feels_heel and "roll" not in scales:
            raise InputError(
                "roll_gain, roll_time: expected 0 for a task that does not show heel,"
                f" got {self.roll_gain:g} and {self.roll_time:g}; give"
                " path_following_task(roll=True), or leave them out"
            )
        in_si = {
            "lookahead": length * own.lookahead_lengths,
            "reach": length * own.reach_lengths,
            "current_update": dt / (dt + self.current_time * travel_time),
            "yaw_update": dt / (dt + self.yaw_time * travel_time),
            "yaw_gain": inner["yaw_rate"] / inner["heading_error"],
            "schedule": inner["schedule"],
            "sway_gain": self.sway_gain / speed,
            "roll_rate_gain": self.roll_time * travel_time,
            "dead_band": float(np.radians(self.dead_band_deg)),
            "path_radius": length * task.turn_radius,
            "sight": scales["next_turn_distance"],
            "service_speed": speed,
            "interval": dt,
        }
        return {
            name: in_si[name] if name in in_si else getattr(self, name)
            for name in PreviewGains._fields
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class PreviewLQ(Guided):
    """LQ around the course of the path ahead: track keeping by 23 numbers.

    The defaults follow from the model: by the lead, the distance that her heading and
    her way lag behind in a steady turn (`own_lead`), the path's course is averaged from
    half a lead ahead to one and a half.
    """

    kind = "preview-lq"
    settings_type = PreviewSettings
    law = staticmethod(preview_law)
    parameters_record = PreviewGains
    memory_record = PreviewMemory
    leads = LQ
    observes = (*Guided.observes, *COURSE_ERROR, *TURNS)
    may_observe = ("roll", "roll_rate")
    reads = (
        "cross_track",
        "drift",
        "sway",
        "surge",
        "yaw_rate",
        *TURNS,
    )
    gain_names = (
        "task_lookahead",
        *PreviewGains._fields,
    )
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Guided.bounds,
        **dict.fromkeys(
            ("reach", "path_radius", "service_speed", "interval"), POSITIVE
        ),
    }

    @property
    def needed_signals(self) -> tuple[str, ...]:
        """Signals that it reads, heel where it is observed."""
        heel = self.observation_names[len(self.observes) :]
        return (*self.reads, *heel)
