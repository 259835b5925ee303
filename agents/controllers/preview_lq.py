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
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import ANY_NUMBER, Bounds
from agents.controllers.guided import COURSE_ERROR, TURNS, Guided, with_path
from agents.controllers.interface import Policy
from agents.controllers.law import Law, Number, PathSignals, clipped, wrapped
from agents.controllers.lq import LQ
from agents.controllers.seen_current import (
    CurrentMemory,
    CurrentScales,
    seen_current,
    way_through_water,
)
from agents.controllers.wheel_over import own_lead
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.engine.records import Record
from shipgym.models.by_name import takes_name
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
    current = seen_current(seen, memory.current, current_scales(p))
    wanted = wanted_course(seen, current, p)
    course = wanted - p.crab_share * crab_angle(wanted, seen.surge, current, p)
    off = heading_error(seen, current, p)

    slowness = p.service_speed / np.maximum(seen.surge, 0.25 * p.service_speed)
    error = wrapped(off + course)
    quiet = error - clipped(error, -p.dead_band, p.dead_band)
    by_heading = quiet * np.exp(p.speed_power * np.log(slowness))
    turning = own_yaw_rate(seen, off, memory, current, p)
    yaw_rate = memory.yaw_rate + p.yaw_update * (turning - memory.yaw_rate)
    by_yaw_rate = p.yaw_gain * (yaw_rate - seen.yaw_rate)
    by_roll = p.roll_gain * seen.roll + p.roll_rate_gain * seen.roll_rate
    most = 3.0  # rad; wrapped, a larger one would turn the rudder to the other side
    asked = by_heading + by_yaw_rate + by_roll + p.sway_gain * seen.sway
    steered = clipped(asked, -most, most)
    return steered - seen.heading_error, PreviewMemory(current, off, yaw_rate)


def current_scales(p: PreviewGains) -> CurrentScales:
    """Parameters of the current that is seen."""
    return CurrentScales(
        update=p.current_update,
        path_radius=p.path_radius,
        sight=p.sight,
        interval=p.interval,
        slowest=0.2 * p.service_speed,
        fastest=2.0 * p.service_speed,
    )


def wanted_course(seen: PathSignals, current: CurrentMemory, p: PreviewGains) -> Number:
    """Course over ground, against the direction of the path beside the ship, rad."""
    over_ground = way_through_water(seen).ahead + current.ahead
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


class PreviewSettings(NamedTuple):
    """Settings of `PreviewLQ.from_model`.

    Attributes
    ----------
    lookahead_lengths : float
        Lookahead of the way back to the track, ship lengths; by default the task's.
    reach_lengths : float
        How far ahead the path's curvature counts, ship lengths; by default five
        times `own_lead`.
    weight_0, weight_1, weight_2, weight_3, weight_4 : float
        Of curvature beside the ship, and at 1, 2, 3 and 6 tenths of the reach, at whose
        end it is 0; by default 1, 1, 0.5, 0 and 0, which is the mean course of the path
        from half of `own_lead` ahead to one and a half.
    reach_power : float
        Power of speed over ground over service speed in the reach: 1 for a reach in
        time.
    crab_share : float
        Share of the crab angle that is steered against a current.
    course_share : float
        Share of heading and yaw rate that is reckoned from the course over ground,
        which waves move less; by default a half in waves, else 0.
    current_time, yaw_time : float
        Time constants of the low-passes on the current and on the yaw rate, in times to
        travel one ship length.
    sway_gain : float
        Change of course, rad, per sway over service speed.
    dead_band_deg : float
        Heading error that is left alone.
    speed_power : float
        Power of service speed over speed in the gain on the heading error.
    roll_gain : float
        Change of course per heel.
    roll_time : float
        Change of course per rate of heel, in times to travel one ship length.
    """

    lookahead_lengths: float
    reach_lengths: float
    weight_0: float
    weight_1: float
    weight_2: float
    weight_3: float
    weight_4: float
    reach_power: float
    crab_share: float
    course_share: float
    current_time: float
    yaw_time: float
    sway_gain: float
    dead_band_deg: float
    speed_power: float
    roll_gain: float
    roll_time: float

    def check(self) -> None:
        """Refuse numbers out of their range; InputError names the setting."""
        for name in ("lookahead_lengths", "reach_lengths"):
            check_number(getattr(self, name), name, at_least=1e-4, at_most=1e4)
        for name in ("weight_0", "weight_1", "weight_2", "weight_3", "weight_4"):
            check_number(getattr(self, name), name, at_least=-10.0, at_most=10.0)
        for name in ("current_time", "yaw_time"):
            check_number(getattr(self, name), name, at_least=0.0)
        check_number(self.crab_share, "crab_share", at_least=0.0, at_most=2.0)
        check_number(self.course_share, "course_share", at_least=0.0, at_most=1.0)
        check_number(self.dead_band_deg, "dead_band_deg", at_least=0.0, at_most=180.0)
        for name in ("speed_power", "reach_power"):
            check_number(getattr(self, name), name, at_least=-2.0, at_most=4.0)
        for name in ("sway_gain", "roll_gain", "roll_time"):
            check_number(getattr(self, name), name, at_least=-100.0, at_most=100.0)

    def check_heel(self, shown: bool) -> None:
        """Refuse gains on heel that a task does not show; InputError names them."""
        feels_heel = self.roll_gain != 0.0 or self.roll_time != 0.0
        if feels_heel and not shown:
            raise InputError(
                "roll_gain, roll_time: expected 0 for a task that does not show heel,"
                f" got {self.roll_gain:g} and {self.roll_time:g}; give"
                " path_following_task(roll=True), or leave them out"
            )

    def gains(self, model: ShipModel, task: Task, autopilot: LQ) -> dict[str, float]:
        """Gains in SI units on the paths of a task, around LQ."""
        dt = task.interval(model)
        inner = autopilot.gains
        length, speed = model.particulars["length"], model.particulars["speed"]
        travel_time = model.travel_time
        scales = {quantity.name: quantity.scale for quantity in task.observed(model)}
        return {
            "lookahead": length * self.lookahead_lengths,
            "reach": length * self.reach_lengths,
            "weight_0": float(self.weight_0),
            "weight_1": float(self.weight_1),
            "weight_2": float(self.weight_2),
            "weight_3": float(self.weight_3),
            "weight_4": float(self.weight_4),
            "reach_power": float(self.reach_power),
            "crab_share": float(self.crab_share),
            "course_share": float(self.course_share),
            "current_update": dt / (dt + self.current_time * travel_time),
            "yaw_update": dt / (dt + self.yaw_time * travel_time),
            "yaw_gain": inner["yaw_rate"] / inner["heading_error"],
            "sway_gain": self.sway_gain / speed,
            "roll_gain": float(self.roll_gain),
            "roll_rate_gain": self.roll_time * travel_time,
            "dead_band": float(np.radians(self.dead_band_deg)),
            "speed_power": float(self.speed_power),
            "path_radius": length * task.turn_radius,
            "sight": scales["next_turn_distance"],
            "service_speed": speed,
            "interval": dt,
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class PreviewLQ(Guided):
    """LQ around the course of the path ahead: track keeping by 22 numbers."""

    kind: ClassVar[str] = "preview-lq"
    law: ClassVar[Law] = staticmethod(preview_law)
    memory_record: ClassVar[Record] = PreviewMemory
    observes: ClassVar[tuple[str, ...]] = (*Guided.observes, *COURSE_ERROR, *TURNS)
    may_observe: ClassVar[tuple[str, ...]] = ("roll", "roll_rate")
    reads: ClassVar[tuple[str, ...]] = (
        "cross_track",
        "drift",
        "sway",
        "surge",
        "yaw_rate",
        *TURNS,
    )
    gain_names: ClassVar[tuple[str, ...]] = (
        "task_lookahead",
        *PreviewGains._fields,
    )
    bounds: ClassVar[Mapping[str, Bounds]] = {
        **Guided.bounds,
        "reach": Bounds(1e-6, ANY_NUMBER.largest),
        "reach_power": Bounds(-2.0, 4.0),
        "crab_share": Bounds(0.0, 2.0),
        "course_share": Bounds(0.0, 1.0),
        "current_update": Bounds(0.0, 1.0),
        "yaw_update": Bounds(0.0, 1.0),
        "dead_band": Bounds(0.0, np.pi),
        "speed_power": Bounds(-2.0, 4.0),
        "path_radius": Bounds(1e-6, ANY_NUMBER.largest),
        "sight": Bounds(1e-6, ANY_NUMBER.largest),
        "service_speed": Bounds(1e-6, ANY_NUMBER.largest),
        "interval": Bounds(1e-3, 1e4),
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
        weight_0: float = 1.0,
        weight_1: float = 1.0,
        weight_2: float = 0.5,
        weight_3: float = 0.0,
        weight_4: float = 0.0,
        reach_power: float = 0.0,
        crab_share: float = 1.0,
        course_share: float | None = None,
        current_time: float = 0.3,
        yaw_time: float = 0.0,
        sway_gain: float = 0.0,
        dead_band_deg: float = 0.0,
        speed_power: float = 0.0,
        roll_gain: float = 0.0,
        roll_time: float = 0.0,
    ) -> Self:
        """Design on a model, for the paths of a task.

        The defaults follow from the model: by the lead, the distance that her heading
        and her way lag behind in a steady turn (`own_lead`), the path's course is
        averaged from half a lead ahead to one and a half.

        Raises InputError if an argument is out of its range, the autopilot is not LQ,
        or it was designed for another ship, for a task without a path, and for gains
        on heel where the task does not show it.

        Parameters
        ----------
        model : ShipModel
            The ship.
        autopilot : LQ, optional
            By default `LQ.from_model(model)`.
        task : Task, optional
            Its lookahead, turns and control interval are used; by default the
            environment's own.
        lookahead_lengths, reach_lengths, ... : float, optional
            See `PreviewSettings`.
        """
        asked = with_path(task)
        led = led_lq(autopilot, model, asked)
        if lookahead_lengths is None:
            lookahead_lengths = asked.lookahead
        if reach_lengths is None:
            reach_lengths = own_reach(model, led)
        if course_share is None:
            course_share = own_course_share(asked)
        settings = PreviewSettings(
            lookahead_lengths=lookahead_lengths,
            reach_lengths=reach_lengths,
            weight_0=weight_0,
            weight_1=weight_1,
            weight_2=weight_2,
            weight_3=weight_3,
            weight_4=weight_4,
            reach_power=reach_power,
            crab_share=crab_share,
            course_share=course_share,
            current_time=current_time,
            yaw_time=yaw_time,
            sway_gain=sway_gain,
            dead_band_deg=dead_band_deg,
            speed_power=speed_power,
            roll_gain=roll_gain,
            roll_time=roll_time,
        )
        settings.check()
        settings.check_heel(shown="roll" in cls.observed_in(asked, model))
        gains = settings.gains(model, asked, led)
        return cls.leading(model, led, asked, gains, {})

    def turn_reach(self, angle: float) -> float:
        """See `Controller.turn_reach`: where weights of a tenth and more begin."""
        noticed = 0.1
        share = 0.1
        for number, ends in enumerate((0.1, 0.2, 0.3, 0.6, 1.0)):
            if self.gains[f"weight_{number}"] >= noticed:
                share = ends
        return share * self.gains["reach"]

    @property
    def needed_signals(self) -> tuple[str, ...]:
        """Signals that it reads, heel where it is observed."""
        heel = self.observation_names[len(self.observes) :]
        return (*self.reads, *heel)

    @cached_property
    def parameters(self) -> PreviewGains:
        """Parameters of its law."""
        own = {name: self.gains[name] for name in PreviewGains._fields}
        return PreviewGains(**own)


def led_lq(autopilot: Policy | None, model: ShipModel, task: Task) -> LQ:
    """LQ that is led, by default designed on the model; InputError for another kind."""
    if autopilot is None:
        return LQ.from_model(model, dt=task.interval(model))
    if not isinstance(autopilot, LQ):
        name = type(autopilot).__name__
        raise InputError(f"autopilot: expected LQ, got {name}")
    return autopilot


def own_course_share(task: Task) -> float:
    """Share of the heading by the course over ground by design: a half in waves."""
    in_waves = task.weather.waves is not None
    return 0.5 if in_waves else 0.0


def own_reach(model: ShipModel, autopilot: Policy | None) -> float:
    """How far ahead the path's curvature counts by design, ship lengths."""
    return 5.0 * own_lead(model, autopilot)
