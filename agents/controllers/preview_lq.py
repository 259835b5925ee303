"""LQ path tracking with preview: the path's course is read ahead and averaged.

LQ steers heading and yaw rate around a course that is read from the path one lead
ahead, averaged over a window, with feed-forward of the path's curvature and the angle
of drift by a current countered. The path may be her own, on wider arcs inside the
planned ones. Heel and its rate change the course where they are seen. Waves are kept
from the rudder by low-passes and dead-bands on yaw rate, heading error and order.

Sources: Tomizuka 1975, Optimal continuous finite preview problem, IEEE Transactions on
Automatic Control 20 (preview in LQ tracking); Fossen 2011, Handbook of Marine Craft
Hydrodynamics and Motion Control, 10.3 (line of sight), 13.2 (dead-band and filters of
autopilots); van Amerongen 1982, Adaptive steering of ships (gain by speed).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np

from agents.controllers.controller import ANY_NUMBER, Bounds
from agents.controllers.guided import COURSE_ERROR, TURNS, Guided, arc_turned, with_path
from agents.controllers.interface import Policy
from agents.controllers.law import Law, Number, PathSignals, clipped, wrapped
from agents.controllers.lq import LQ
from agents.controllers.own_path import (
    OwnPath,
    Radii,
    TurnMemory,
    own_path,
    remembered,
    tangent,
)
from agents.controllers.wheel_over import own_lead
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.engine.records import Record
from shipgym.ships.by_name import takes_name
from shipgym.tasks.task import Task
from shipgym.wrong_types import typed


class PreviewGains(NamedTuple):
    """Parameters of `preview_law`."""

    lookahead: float  # m, of the line of sight back to the track
    lead: float  # m along the path, to the middle of the window
    window: float  # m, over which the path's course is averaged
    path_radius: float  # m, of its arcs
    own_radius: float  # m, of the arcs of the own path, which is inside of it
    inside: float  # m of track to the inside, per rad that the path turns in the window
    feed_forward: float  # m: change of course per curvature of the path
    crab_share: float  # share of the angle of drift by the current that is countered
    crab_update: float  # share of a new angle of drift in its low-pass
    yaw_update: float  # share of a new yaw rate in its low-pass
    yaw_gain: float  # s: gain of LQ on the yaw rate over that on the heading error
    roll_gain: float  # rad of course per rad of heel
    roll_rate_gain: float  # s: rad of course per rad/s of heel
    dead_band: float  # rad, of the heading error
    speed_power: float  # of service speed over speed, on the heading error
    lead_power: float  # of speed over service speed, on the lead
    service_speed: float  # m/s
    interval: float  # s, between two commands


class PreviewMemory(NamedTuple):
    """Memory of `preview_law`."""

    crab: Number  # rad, filtered
    yaw_rate: Number  # rad/s, filtered
    turns: TurnMemory


class Window(NamedTuple):
    """Stretch of the path ahead."""

    begins: Number  # m
    ends: Number  # m


class PathCourse(NamedTuple):
    """Course of a path in a window ahead."""

    mean: Number  # rad, against the direction of the path beside the ship
    turned: Number  # rad, from one end of the window to the other


def preview_law(
    seen: PathSignals, memory: PreviewMemory, p: PreviewGains
) -> tuple[Number, PreviewMemory]:
    """Course that keeps to the path and turns with it."""
    advance = seen.surge * p.interval
    turns = remembered(seen.turns, memory.turns, advance, p.path_radius)
    slowness = p.service_speed / np.maximum(seen.surge, 0.25 * p.service_speed)

    leeway = np.arctan2(seen.sway, seen.surge)  # through the water
    drift = wrapped(seen.drift - leeway)
    crab = memory.crab + p.crab_update * (drift - memory.crab)
    course = along_path(seen, turns, slowness, p) - p.crab_share * crab

    error = wrapped(seen.heading_error + course)
    quiet = error - clipped(error, -p.dead_band, p.dead_band)
    by_heading = quiet * np.exp(p.speed_power * np.log(slowness))
    yaw_rate = memory.yaw_rate + p.yaw_update * (seen.yaw_rate - memory.yaw_rate)
    by_yaw_rate = p.yaw_gain * (yaw_rate - seen.yaw_rate)
    by_roll = p.roll_gain * seen.roll + p.roll_rate_gain * seen.roll_rate
    most = 3.0  # rad; wrapped, a larger one would turn the rudder to the other side
    steered = clipped(by_heading + by_yaw_rate + by_roll, -most, most)
    return steered - seen.heading_error, PreviewMemory(crab, yaw_rate, turns)


def along_path(
    seen: PathSignals, turns: TurnMemory, slowness: Number, p: PreviewGains
) -> Number:
    """Course over ground along the own path, and back to it, rad.

    It is against the direction of the planned path beside the ship.
    """
    path = own_path(seen.turns, turns, Radii(planned=p.path_radius, own=p.own_radius))
    lead = p.lead * np.exp(-p.lead_power * np.log(slowness))
    half = 0.5 * p.window
    ahead = course_ahead(path, Window(lead - half, lead + half), p.own_radius)

    here = path.leaving.course + path.first.course
    by_turn = p.feed_forward * ahead.turned / p.window
    aside = path.leaving.aside + path.first.aside + p.inside * ahead.turned
    back = np.arctan2(seen.cross_track - aside, p.lookahead)
    return here + ahead.mean + by_turn - back


def course_ahead(path: OwnPath, window: Window, radius: float) -> PathCourse:
    """Course of the own path in a window."""
    begins, ends = window
    summed = summed_turn(ends, path, radius) - summed_turn(begins, path, radius)
    return PathCourse(
        mean=summed / (ends - begins),
        turned=turned_by(ends, path, radius) - turned_by(begins, path, radius),
    )


def turned_by(distance: Number, path: OwnPath, radius: float) -> Number:
    """Change of the own path's course over a distance ahead, rad."""
    leaving, first, second = path
    return (
        arc_turned(distance - leaving.distance, leaving.angle, radius)
        + arc_turned(distance - first.distance, first.angle, radius)
        + arc_turned(distance - second.distance, second.angle, radius)
    )


def summed_turn(distance: Number, path: OwnPath, radius: float) -> Number:
    """Integral of `turned_by` from the ship to a distance ahead, rad m."""
    leaving, first, second = path
    return (
        summed_arc(distance - leaving.distance, leaving.angle, radius)
        + summed_arc(distance - first.distance, first.angle, radius)
        + summed_arc(distance - second.distance, second.angle, radius)
    )


def summed_arc(along_arc: Number, angle: Number, radius: float) -> Number:
    """Integral of `arc_turned` to a distance along an arc of an angle, rad m."""
    size = np.abs(angle)
    turned = clipped(along_arc / radius, 0.0, size)
    on_arc = 0.5 * radius * turned * turned
    behind = size * np.maximum(along_arc - radius * size, 0.0)
    return np.sign(angle) * (on_arc + behind)


class PreviewSettings(NamedTuple):
    """Settings of `PreviewLQ.from_model`.

    Attributes
    ----------
    lookahead_lengths : float
        Lookahead of the way back to the track, ship lengths; by default the task's.
    lead_lengths : float
        How far ahead the path's course is read, ship lengths; by default `own_lead`.
    window_lengths : float
        Over which it is averaged, ship lengths: longer turns more gently; by default
        the lead.
    inside_lengths : float
        How far inside a turn the ship is to be, ship lengths per radian that the path
        turns in the window.
    feed_forward_lengths : float
        Change of course per curvature of the path, ship lengths.
    crab_share : float
        Share of the angle of drift by the current that is countered.
    crab_time, yaw_time : float
        Time constants of the low-passes on that angle and on the yaw rate, in times to
        travel one ship length.
    dead_band_deg : float
        Heading error that is left alone.
    speed_power : float
        Power of service speed over speed in the gain on the heading error.
    lead_power : float
        Power of speed over service speed in the lead: 1 for a lead in time.
    arc_factor : float
        Radius of the own path's arcs over that of the planned ones, at least 1.
    roll_gain : float
        Change of course per heel.
    roll_time : float
        Change of course per rate of heel, in times to travel one ship length.
    """

    lookahead_lengths: float
    lead_lengths: float
    window_lengths: float
    inside_lengths: float
    feed_forward_lengths: float
    crab_share: float
    crab_time: float
    yaw_time: float
    dead_band_deg: float
    speed_power: float
    lead_power: float
    arc_factor: float
    roll_gain: float
    roll_time: float

    def check(self) -> None:
        """Refuse numbers out of their range; InputError names the setting."""
        for name in ("lookahead_lengths", "lead_lengths", "window_lengths"):
            check_number(getattr(self, name), name, at_least=1e-4, at_most=1e4)
        for name in ("inside_lengths", "feed_forward_lengths"):
            check_number(getattr(self, name), name, at_least=-100.0, at_most=100.0)
        for name in ("crab_time", "yaw_time"):
            check_number(getattr(self, name), name, at_least=0.0)
        check_number(self.crab_share, "crab_share", at_least=0.0, at_most=2.0)
        check_number(self.dead_band_deg, "dead_band_deg", at_least=0.0, at_most=180.0)
        for name in ("speed_power", "lead_power"):
            check_number(getattr(self, name), name, at_least=-2.0, at_most=4.0)
        check_number(self.arc_factor, "arc_factor", at_least=1.0, at_most=100.0)
        for name in ("roll_gain", "roll_time"):
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
        radius = model.particulars["length"] * task.turn_radius
        length = model.particulars["length"]
        travel_time = model.travel_time
        return {
            "lookahead": length * self.lookahead_lengths,
            "lead": length * self.lead_lengths,
            "window": length * self.window_lengths,
            "inside": length * self.inside_lengths,
            "feed_forward": length * self.feed_forward_lengths,
            "crab_share": float(self.crab_share),
            "crab_update": dt / (dt + self.crab_time * travel_time),
            "yaw_update": dt / (dt + self.yaw_time * travel_time),
            "dead_band": float(np.radians(self.dead_band_deg)),
            "speed_power": float(self.speed_power),
            "lead_power": float(self.lead_power),
            "roll_gain": float(self.roll_gain),
            "roll_rate_gain": self.roll_time * travel_time,
            "interval": dt,
            "path_radius": radius,
            "own_radius": radius * self.arc_factor,
            "yaw_gain": inner["yaw_rate"] / inner["heading_error"],
            "service_speed": model.particulars["speed"],
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class PreviewLQ(Guided):
    """LQ around the course of the path ahead: track keeping by 19 numbers."""

    kind: ClassVar[str] = "preview-lq"
    leads: ClassVar[str] = "quiet-lq"
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
        "lead": Bounds(0.0, ANY_NUMBER.largest),
        "window": Bounds(1e-6, ANY_NUMBER.largest),
        "path_radius": Bounds(1e-6, ANY_NUMBER.largest),
        "crab_share": Bounds(0.0, 2.0),
        "crab_update": Bounds(0.0, 1.0),
        "yaw_update": Bounds(0.0, 1.0),
        "dead_band": Bounds(0.0, np.pi),
        "speed_power": Bounds(-2.0, 4.0),
        "lead_power": Bounds(-2.0, 4.0),
        "own_radius": Bounds(1e-6, ANY_NUMBER.largest),
        "interval": Bounds(1e-3, 1e4),
        "service_speed": Bounds(1e-6, ANY_NUMBER.largest),
    }

    @classmethod
    @takes_name
    @typed
    def from_model(
        cls,
        model: ShipModel,
        *,
        autopilot: Policy | None = None,
        task: Task | None = None,
        lookahead_lengths: float | None = None,
        lead_lengths: float | None = None,
        window_lengths: float | None = None,
        inside_lengths: float = 0.0,
        feed_forward_lengths: float = 0.0,
        crab_share: float = 1.0,
        crab_time: float = 0.0,
        yaw_time: float = 0.0,
        dead_band_deg: float = 0.0,
        speed_power: float = 0.0,
        lead_power: float = 0.0,
        arc_factor: float = 1.0,
        roll_gain: float = 0.0,
        roll_time: float = 0.0,
    ) -> Self:
        """Design on a model, for the paths of a task.

        The defaults follow from the model: the lead is the distance that her heading
        and her way lag behind in a steady turn (`own_lead`), the window is as long as
        the lead, from half of it to one and a half, and nothing else is added.

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
        lookahead_lengths, lead_lengths, ... : float, optional
            See `PreviewSettings`.
        """
        asked = with_path(task)
        if autopilot is None:
            autopilot = LQ.from_model(model, dt=asked.interval(model))
        if not isinstance(autopilot, LQ):
            name = type(autopilot).__name__
            raise InputError(f"autopilot: expected LQ, got {name}")
        if lookahead_lengths is None:
            lookahead_lengths = asked.lookahead
        if lead_lengths is None:
            lead_lengths = own_lead(model, autopilot)
        if window_lengths is None:
            window_lengths = lead_lengths
        settings = PreviewSettings(
            lookahead_lengths=lookahead_lengths,
            lead_lengths=lead_lengths,
            window_lengths=window_lengths,
            inside_lengths=inside_lengths,
            feed_forward_lengths=feed_forward_lengths,
            crab_share=crab_share,
            crab_time=crab_time,
            yaw_time=yaw_time,
            dead_band_deg=dead_band_deg,
            speed_power=speed_power,
            lead_power=lead_power,
            arc_factor=arc_factor,
            roll_gain=roll_gain,
            roll_time=roll_time,
        )
        settings.check()
        settings.check_heel(shown="roll" in cls.observed_in(asked, model))
        gains = settings.gains(model, asked, autopilot)
        return cls.leading(model, autopilot, asked, gains, {})

    def turn_reach(self, angle: float) -> float:
        """See `Controller.turn_reach`: where the window comes to her own arc."""
        gains = self.gains
        radii = Radii(planned=gains["path_radius"], own=gains["own_radius"])
        earlier = float(tangent(angle, radii))
        return gains["lead"] + 0.5 * gains["window"] + earlier

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
