"""Tests of the heading that an autopilot steers by: it is believed while it agrees.

It is compared with the rate of turn, with the answer of the ship to her rudder and with
the course over ground. Each residual has a threshold of six standard deviations in the
roughest sea (`false_alarms`).
"""

from __future__ import annotations

from cmath import rect
from math import radians, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

from agents.export.course_belief import CourseCheck
from agents.export.residuals import DEVIATIONS, Lasting, LeakySum, Stillness
from agents.export.ship_response import (
    HeadingObserver,
    RudderAlone,
    ShipResponse,
    WaveYaw,
    response_of,
)
from shipgym.tasks.guidance import wrapped

if TYPE_CHECKING:
    from agents.export.nmea import NmeaReading
    from agents.export.sensors import HelmSensors, Limits


class Motion(NamedTuple):
    """Measurements of one control tick, SI units."""

    heading: float
    turned: float  # sum of the changes of the heading
    rate: float | None  # None without a rate gyro
    rate_angle: float  # integral of the rate to the time of the heading
    rudder: float | None
    speed: float  # through the water, or the nearest to it that is known
    over_ground: complex | None  # velocity, north and east


class Heard:
    """Heading and rate of turn as they come in, reading by reading.

    `turned` is the sum of the changes of the heading, rad; `angle` the integral of the
    rate of turn; `jumps` and `rate_jumps` are the numbers of changes of heading and
    rate within some seconds that neither the ship nor noise can make.
    """

    def __init__(self, ship: ShipResponse, noise: float) -> None:
        self.ship = ship
        self.jump = sqrt(2.0) * DEVIATIONS * noise
        self.rate_jump = DEVIATIONS * noise  # in a second
        self.heading: tuple[float, float] | None = None  # rad, and when, s
        self.rate: tuple[float, float] | None = None
        self.turned = 0.0
        self.angle = 0.0
        self.angle_then = 0.0  # at the newest heading
        self.jumps = LeakySum(memory=10.0)
        self.rate_jumps = LeakySum(memory=10.0)

    def take_heading(self, heading: float, now: float) -> None:
        """Take in a heading, rad."""
        angle = self.angle_at(now)
        if self.heading is not None:
            before, then = self.heading
            step = now - then
            change = float(wrapped(heading - before))
            self.turned += change
            is_jump = self._is_jump(change, angle - self.angle_then, step)
            self.jumps.add(float(is_jump), step)
        self.heading = heading, now
        self.angle_then = angle

    def _is_jump(self, change: float, by_rate: float, step: float) -> bool:
        """Compare the change of the heading with what the rate makes in a step, s."""
        uncertain = self.ship.turning * step
        if self.rate is not None:
            uncertain = 0.5 * abs(by_rate)
        return abs(change - by_rate) > self.jump + uncertain

    def take_rate(self, rate: float, now: float) -> None:
        """Take in a rate of turn, rad/s."""
        if self.rate is not None:
            before, then = self.rate
            step = now - then
            self._place_heading(rate, now)
            self.angle += 0.5 * (before + rate) * step
            largest = self.rate_jump + self.ship.turning * step
            self.rate_jumps.add(float(abs(rate - before) > largest), step)
        self.rate = rate, now

    def _place_heading(self, rate: float, now: float) -> None:
        """Find the angle at the newest heading between two rates, the later one now."""
        if self.rate is None or self.heading is None:
            return
        before, begin = self.rate
        _, then = self.heading
        if begin < then < now:
            share = (then - begin) / (now - begin)
            mean = before + 0.5 * share * (rate - before)
            self.angle_then = self.angle + mean * (then - begin)

    def angle_at(self, now: float) -> float:
        """Integral of the rate of turn until a time, s, with its newest value."""
        if self.rate is None:
            return self.angle
        rate, then = self.rate
        return self.angle + rate * (now - then)


class HeadingBelief:
    """Decides whether a heading is to be believed.

    `take` is called with each reading that is steered by, `doubt` once a control tick.
    It keeps a few numbers, however long it runs.

    Parameters
    ----------
    agent : Controller or LearnedPolicy
        The autopilot; the ship's answer to her rudder is that of its design.
    limits : Limits
        Noise and motion in waves that are allowed for.
    """

    def __init__(self, agent: Any, limits: Limits) -> None:
        self.ship = response_of(agent)
        noise = radians(limits.heading_noise_deg)
        self.noise = noise
        self.yaw = radians(limits.wave_yaw_deg)
        self.heard = Heard(self.ship, noise)

        self.divergences = []
        for slower in (1.0, 3.0, 9.0):
            # white noise of the rate adds up with the root of the time
            limit = sqrt(slower) * DEVIATIONS * noise
            one = Divergence(10.0 * slower, limit, limits.persistence_s)
            self.divergences.append(one)
        self.still_heading = Stillness(20.0)
        self.still_rate = Stillness(20.0)
        self.swing = LeakySum(60.0)  # of the rate about its mean, rad
        self.bias = 0.0  # mean rate of turn of the last minute, rad/s
        self.off_rate = 0.0
        self.observer = HeadingObserver(self.ship)
        self.waves = WaveYaw()
        self.unanswered = Lasting(limits.persistence_s)
        self.rudder_alone = RudderAlone(self.ship)
        self.course = CourseCheck(self.ship, limits.course_deg, limits.persistence_s)
        self.before: Motion | None = None
        self.then = 0.0

    def take(self, reading: NmeaReading, now: float) -> None:
        """Take in a reading of the instrument that is steered by."""
        if reading.quantity == "heading":
            self.heard.take_heading(reading.value, now)
        elif reading.quantity == "yaw_rate":
            self.heard.take_rate(reading.value, now)

    def doubt(self, sensors: HelmSensors, now: float) -> str:
        """Describe why the heading is not to be believed; empty while it agrees."""
        motion = self._motion(sensors, now)
        if motion is None:
            return ""
        before = self.before or motion
        step = now - self.then if self.before else 0.0
        self.before = motion
        self.then = now
        return (
            self._noise()
            or self._against_rate(motion, before, now, step)
            or self._against_rudder(motion, before, now, step)
            or self._against_course(motion, now, step)
        )

    def _motion(self, sensors: HelmSensors, now: float) -> Motion | None:
        """Measurements at a time, s; None without a heading."""
        heard = self.heard
        if heard.heading is None or sensors.value("heading", now) is None:
            return None
        heading, _ = heard.heading
        over_ground = _velocity(sensors, now)
        speed = self._speed(sensors.value("surge", now), over_ground)
        return Motion(
            heading=heading,
            turned=heard.turned,
            rate=sensors.value("yaw_rate", now),
            rate_angle=heard.angle_then,
            rudder=sensors.value("rudder", now),
            speed=speed,
            over_ground=over_ground,
        )

    def _speed(self, log: float | None, over_ground: complex | None) -> float:
        """Speed through the water, m/s, of a log that GNSS does not contradict."""
        if over_ground is None:
            speed = self.ship.speed if log is None else log
        elif log is None or abs(log - abs(over_ground)) > self.course.largest:
            speed = abs(over_ground)
        else:
            speed = log
        most = 1.5 * self.ship.speed
        return min(max(speed, 0.0), most)

    def _noise(self) -> str:
        """Describe a compass that jumps again and again."""
        most = 2.5  # of the sum that forgets: the third within ten seconds
        if self.heard.jumps.value > most:
            return "the heading jumps to and fro"
        if self.heard.rate_jumps.value > most:
            return "the rate of turn jumps to and fro"
        return ""

    def _against_rate(
        self, motion: Motion, before: Motion, now: float, step: float
    ) -> str:
        """Compare the change of the heading with the rate of turn."""
        if motion.rate is None or before.rate is None:
            return ""
        change = motion.turned - before.turned
        by_rate = motion.rate_angle - before.rate_angle
        for divergence in self.divergences:
            if divergence.observe(change, by_rate, now, step):
                return "heading and rate of turn disagree"
        return self._stands_still(motion, change, by_rate, now, step)

    def _stands_still(
        self, motion: Motion, change: float, by_rate: float, now: float, step: float
    ) -> str:
        """Compare a heading and a rate that keep their last digit with each other."""
        if motion.rate is None:
            return ""
        of_bias = self.bias * step
        swing = self.swing.add(by_rate - of_bias, step)
        self.bias += (motion.rate - self.bias) * step / self.swing.memory
        by_gyro = self.still_heading.observe(motion.heading, swing, now)
        if by_gyro > 1.5 * self.noise + 3.0 * self.still_heading.resolution:
            return "the heading stands still while the ship turns"

        self.off_rate += change - motion.rate * step
        by_compass = self.still_rate.observe(motion.rate, self.off_rate, now)
        of_digits = self.still_rate.resolution * self.still_rate.longest_s
        if by_compass > 4.0 * self.noise + of_digits:
            return "the rate of turn stands still while the heading changes"
        return ""

    def _against_rudder(
        self, motion: Motion, before: Motion, now: float, step: float
    ) -> str:
        """Compare the heading with the ship's answer to her rudder."""
        if motion.rudder is None:
            return ""
        change = motion.turned - before.turned
        residual = self.observer.observe(
            turned=change,
            rudder=motion.rudder,
            speed=motion.speed,
            step=step,
        )
        alone = self.rudder_alone.observe(
            reading=motion.heading,
            rudder=motion.rudder,
            speed=motion.speed,
            rate=self.observer.rate,
            step=step,
        )
        if alone > DEVIATIONS * self.noise:
            return "the heading does not move under rudder"
        swing = max(self.yaw, self.waves.observe(change, step))
        is_off = abs(residual) > DEVIATIONS * swing + self.observer.doubt
        if self.unanswered.observe(is_off, now):
            return "the heading does not answer to the rudder"
        return ""

    def _against_course(self, motion: Motion, now: float, step: float) -> str:
        """Compare the heading with the course over ground."""
        if motion.over_ground is None:
            return ""
        disagrees = self.course.observe(
            heading=motion.heading,
            rate=motion.rate or 0.0,
            over_ground=motion.over_ground,
            speed=motion.speed,
            now=now,
            step=step,
        )
        return "heading and course over ground disagree" if disagrees else ""


class Divergence:
    """Change of the heading less the integral of the rate of turn, forgotten slowly."""

    #: Share of the angle turned by which a rate gyro may be wrong.
    scale_error = 0.1

    def __init__(self, memory: float, limit: float, persistence_s: float) -> None:
        self.limit = limit
        self.off = LeakySum(memory)
        self.turn = LeakySum(memory)
        self.lasting = Lasting(persistence_s)

    def observe(self, change: float, by_rate: float, now: float, step: float) -> bool:
        """Return True if the two angles, rad, of a step, s, disagree for too long."""
        off = self.off.add(change - by_rate, step)
        turn = self.turn.add(by_rate, step)
        allowed = self.limit + self.scale_error * abs(turn)
        return self.lasting.observe(abs(off) > allowed, now)


def _velocity(sensors: HelmSensors, now: float) -> complex | None:
    """Velocity over ground, north and east, m/s; None if it is not known."""
    course = sensors.value("course", now)
    speed = sensors.value("speed", now)
    if course is None or speed is None:
        return None
    return rect(speed, course)
