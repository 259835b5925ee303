"""LQ path tracking with preview: the path's course is read ahead and averaged.

LQ steers heading and yaw rate around a course that is read from the path one lead
ahead, averaged over a window, with feed-forward of the path's curvature, a track to the
inside of turns, and the angle of drift by a current countered. Waves are kept from the
rudder by a low-pass on the yaw rate and by a dead-band on the heading error.

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
from agents.controllers.guided import COURSE_ERROR, TURNS, Guided, bend
from agents.controllers.interface import Policy
from agents.controllers.law import Law, Number, PathSignals, Turns, wrapped
from agents.controllers.lq import LQ
from agents.controllers.wheel_over import own_lead
from shipgym import InputError, ShipModel
from shipgym.checks import check_number
from shipgym.engine.records import Record
from shipgym.ships.by_name import takes_name
from shipgym.tasks.task import Task, path_following_task
from shipgym.wrong_types import typed


class PreviewGains(NamedTuple):
    """Parameters of `preview_law`."""

    lookahead: float  # m, of the line of sight back to the track
    lead: float  # m along the path, to the middle of the window
    window: float  # m, over which the path's course is averaged
    path_radius: float  # m, of its arcs
    inside: float  # m of track to the inside, per rad that the path turns in the window
    feed_forward: float  # m: change of course per curvature of the path
    crab_share: float  # share of the angle of drift by the current that is countered
    crab_update: float  # share of a new angle of drift in its low-pass
    yaw_update: float  # share of a new yaw rate in its low-pass
    yaw_gain: float  # s: gain of LQ on the yaw rate over that on the heading error
    dead_band: float  # rad, of the heading error
    speed_power: float  # of service speed over speed, on the heading error
    service_speed: float  # m/s


class PreviewMemory(NamedTuple):
    """Memory of `preview_law`."""

    crab: Number  # rad, filtered
    yaw_rate: Number  # rad/s, filtered


class PathCourse(NamedTuple):
    """Course of a path in a window ahead."""

    mean: Number  # rad, against the direction of the path beside the ship
    turned: Number  # rad, from one end of the window to the other


def preview_law(
    seen: PathSignals, memory: PreviewMemory, p: PreviewGains
) -> tuple[Number, PreviewMemory]:
    """Course that keeps to the path and turns with it."""
    ahead = course_ahead(seen.turns, p)
    track = seen.cross_track - p.inside * ahead.turned
    along = ahead.mean + p.feed_forward * ahead.turned / p.window
    over_ground = along - np.arctan2(track, p.lookahead)

    leeway = np.arctan2(seen.sway, seen.surge)  # through the water
    drift = wrapped(seen.drift - leeway)
    crab = memory.crab + p.crab_update * (drift - memory.crab)
    course = over_ground - p.crab_share * crab

    error = wrapped(seen.heading_error + course)
    quiet = error - np.clip(error, -p.dead_band, p.dead_band)
    slowness = p.service_speed / np.maximum(seen.surge, 0.25 * p.service_speed)
    steered = quiet * np.exp(p.speed_power * np.log(slowness))

    yaw_rate = memory.yaw_rate + p.yaw_update * (seen.yaw_rate - memory.yaw_rate)
    steered = steered + p.yaw_gain * (yaw_rate - seen.yaw_rate)
    return steered - seen.heading_error, PreviewMemory(crab, yaw_rate)


def course_ahead(turns: Turns, p: PreviewGains) -> PathCourse:
    """Course of the path in the window."""
    begins = p.lead - 0.5 * p.window
    ends = p.lead + 0.5 * p.window
    radius = p.path_radius
    summed = summed_bend(ends, turns, radius) - summed_bend(begins, turns, radius)
    return PathCourse(
        mean=summed / p.window,
        turned=bend(ends, turns, radius) - bend(begins, turns, radius),
    )


def summed_bend(distance: float, turns: Turns, radius: float) -> Number:
    """Integral of `bend` over the path from the ship to a distance ahead, rad m."""
    first = summed_arc(distance - turns.next_distance, turns.next_angle, radius)
    second = summed_arc(distance - turns.second_distance, turns.second_angle, radius)
    return first + second


def summed_arc(along_arc: Number, angle: Number, radius: float) -> Number:
    """Integral of `arc_turned` to a distance along an arc of an angle, rad m."""
    size = np.abs(angle)
    turned = np.clip(along_arc / radius, 0.0, size)
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
        Over which it is averaged, ship lengths: longer turns more gently.
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

    def check(self) -> None:
        """Refuse numbers out of their range; InputError names the setting."""
        for name in ("lookahead_lengths", "lead_lengths", "window_lengths"):
            check_number(getattr(self, name), name, above=0.0)
        for name in ("inside_lengths", "feed_forward_lengths"):
            check_number(getattr(self, name), name, at_least=-100.0, at_most=100.0)
        for name in ("crab_time", "yaw_time"):
            check_number(getattr(self, name), name, at_least=0.0)
        check_number(self.crab_share, "crab_share", at_least=0.0, at_most=2.0)
        check_number(self.dead_band_deg, "dead_band_deg", at_least=0.0, at_most=180.0)
        check_number(self.speed_power, "speed_power", at_least=-2.0, at_most=4.0)

    def gains(self, model: ShipModel, dt: float) -> dict[str, float]:
        """Gains in SI units for a ship and a control interval, s."""
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
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class PreviewLQ(Guided):
    """LQ around the course of the path ahead: track keeping by 14 numbers."""

    kind: ClassVar[str] = "preview-lq"
    law: ClassVar[Law] = staticmethod(preview_law)
    memory_record: ClassVar[Record] = PreviewMemory
    observes: ClassVar[tuple[str, ...]] = (*Guided.observes, *COURSE_ERROR, *TURNS)
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
        window_lengths: float = 0.5,
        inside_lengths: float = 0.0,
        feed_forward_lengths: float = 0.0,
        crab_share: float = 1.0,
        crab_time: float = 0.0,
        yaw_time: float = 0.0,
        dead_band_deg: float = 0.0,
        speed_power: float = 0.0,
    ) -> Self:
        """Design on a model, for the paths of a task.

        The defaults follow from the model: the lead is the distance that her heading
        and her way lag behind in a steady turn (`own_lead`), the window half a ship
        length, and nothing else is added.

        Raises InputError if an argument is out of its range, the autopilot is not LQ,
        or it was designed for another ship.

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
        asked = task or path_following_task()
        dt = asked.interval(model)
        if autopilot is None:
            autopilot = LQ.from_model(model, dt=dt)
        if not isinstance(autopilot, LQ):
            name = type(autopilot).__name__
            raise InputError(f"autopilot: expected LQ, got {name}")
        if lookahead_lengths is None:
            lookahead_lengths = asked.lookahead
        if lead_lengths is None:
            lead_lengths = own_lead(model, autopilot)
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
        )
        settings.check()
        own = settings.gains(model, dt)
        inner = autopilot.gains
        gains = {
            **own,
            "path_radius": model.particulars["length"] * asked.turn_radius,
            "yaw_gain": inner["yaw_rate"] / inner["heading_error"],
            "service_speed": model.particulars["speed"],
        }
        return cls.leading(model, autopilot, asked, gains, {})

    @cached_property
    def parameters(self) -> PreviewGains:
        """Parameters of its law."""
        own = {name: self.gains[name] for name in PreviewGains._fields}
        return PreviewGains(**own)
