"""A ship's answer to her rudder, as far as an autopilot's file says it.

Source: Norrbin 1963, On the design and analysis of the zig-zag test (the turning that a
rudder gives per ship length); Fossen 2011, Handbook of Marine Craft Hydrodynamics and
Motion Control, 7.2 (Nomoto's form with nonlinear damping).
"""

from math import exp, sqrt
from typing import Any, NamedTuple

from agents.controllers.controller import Controller
from agents.controllers.guided import Guided


class ShipResponse(NamedTuple):
    """Answer of yaw to the rudder at service speed.

    dr/dt = effect * (rudder - neutral) - damping * r - drag * |r| r
    """

    effect: float  # yaw acceleration per rudder, 1/s^2
    damping: float  # 1/s; negative for a ship unstable on her course
    drag: float  # 1/rad
    neutral: float  # rudder of straight running, rad
    turning: float  # service speed over length, which no turn reaches, rad/s
    speed: float  # service speed, m/s

    def acceleration(self, rudder: float, rate: float, speed: float) -> float:
        """Yaw acceleration, rad/s^2, at a rudder, rad, rate, rad/s, and speed, m/s."""
        share = speed / self.speed
        by_rudder = self.effect * share**2 * (rudder - self.neutral)
        return by_rudder - share * self.damping * rate - self.drag * abs(rate) * rate


def response_of(agent: Any) -> ShipResponse:
    """Answer to the rudder by Nomoto's K and T of the design, or by the ship's size.

    Without a design the rudder is taken to turn the ship as that of the Mariner does,
    in ship lengths. The drag is such that 35 degrees of rudder turn her by half a
    radian in each ship length.
    """
    pilot = agent.autopilot if isinstance(agent, Guided) else agent
    scales = dict(zip(agent.observation_names, agent.observation_scales, strict=True))
    turning = float(scales.get("yaw_rate", 0.05))

    design = pilot.design if isinstance(pilot, Controller) else {}
    effect = 0.75 * turning**2
    damping = 0.2 * turning
    if "nomoto_K" in design:
        effect = design["nomoto_K"] / design["nomoto_T"]
        damping = 1.0 / design["nomoto_T"]

    hard_over = 0.61  # rad
    steady = 0.5 * turning
    left = effect * hard_over - damping * steady
    return ShipResponse(
        effect=effect,
        damping=damping,
        drag=max(left, 0.0) / steady**2,
        neutral=float(getattr(pilot, "neutral_rudder", 0.0)),
        turning=turning,
        speed=float(scales.get("surge", 7.0)),
    )


class HeadingObserver:
    """Heading that the rudder explains, corrected slowly by the measured one.

    Its states are the heading less the measured one, the yaw rate and the acceleration
    that wind and errors of the model add; all three poles come to `frequency`. Its
    `residual` is the measured heading less the expected one, rad; its `doubt`, rad, is
    how far the rudder may have moved the ship if its effect is off by six tenths.
    """

    def __init__(self, ship: ShipResponse) -> None:
        self.ship = ship
        self.frequency = 0.6 * ship.turning
        self.residual = 0.0
        self.rate = 0.0  # rad/s
        self.elapsed = 0.0  # s
        self.unexplained = 0.0  # rad/s^2
        self.usual = 0.0  # rudder of the last minutes, rad
        self.doubt_rate = 0.0  # rad/s
        self.doubt = 0.0

    def observe(self, turned: float, rudder: float, speed: float, step: float) -> float:
        """Take a step, s; the residual, rad.

        `turned`: change of the measured heading in the step, rad; `rudder`: rad;
        `speed`: m/s.
        """
        if self.elapsed == 0.0:
            self.usual = rudder

        modelled = self.ship.acceleration(rudder, self.rate, speed)
        acceleration = modelled + self.unexplained
        expected = self.rate * step + 0.5 * acceleration * step**2
        innovation = self.residual + turned - expected

        # it begins without a rate of turn, and learns that first
        self.elapsed += step
        pole = max(self.frequency, 1.0 / (5.0 + self.elapsed))
        self.residual = innovation * max(1.0 - 3.0 * pole * step, 0.0)
        self.rate += acceleration * step + 3.0 * pole**2 * step * innovation
        self.unexplained += self.frequency**3 * step * innovation
        self._doubt(rudder, speed, step)
        return self.residual

    def _doubt(self, rudder: float, speed: float, step: float) -> None:
        """Let a share of the rudder's effect act, which is forgotten."""
        forgotten = 2.0 * self.frequency
        share = 0.6
        slow = step * 0.1 * self.frequency
        off = rudder - self.usual
        self.usual += slow * off

        effect = self.ship.effect * (speed / self.ship.speed) ** 2
        change = share * effect * abs(off) - forgotten * self.doubt_rate
        self.doubt_rate += change * step
        self.doubt += (self.doubt_rate - forgotten * self.doubt) * step


class WaveYaw:
    """Standard deviation of the heading in waves, by two high-pass filters in series.

    A turn passes neither, a heading that begins to drift for a moment.
    """

    memory_s = 5.0  # of the filters
    mean_s = 60.0

    def __init__(self) -> None:
        self.elapsed = 0.0  # s
        self.fast = 0.0  # rad
        self.faster = 0.0
        self.mean_square = 0.0

    def observe(self, turned: float, step: float) -> float:
        """Take a change of the heading, rad, in a step, s; the deviation, rad."""
        kept = exp(-step / self.memory_s)
        before = self.fast
        self.fast = kept * self.fast + turned
        self.faster = kept * self.faster + self.fast - before

        self.elapsed += step
        share = step / min(max(self.elapsed, self.memory_s), self.mean_s)
        self.mean_square += share * (self.faster**2 - self.mean_square)
        return sqrt(self.mean_square)


class RudderAlone:
    """Angle that a ship should have turned while her measured heading stood still.

    She goes on from the rate of turn with which that began; only the change of her
    rudder since then changes it. It starts again where the heading moves by its last
    digit.
    """

    longest_s = 90.0

    def __init__(self, ship: ShipResponse) -> None:
        self.ship = ship
        self.reading: float | None = None
        self.lasted_s = 0.0
        self.rate = 0.0  # rad/s
        self.balance = 0.0  # yaw acceleration by wind and model where it began, rad/s^2
        self.turned = 0.0  # rad

    def observe(
        self, reading: float, rudder: float, speed: float, rate: float, step: float
    ) -> float:
        """Take a step, s; the angle, rad, to either side.

        `reading`: measured heading, rad; `rudder`: rad; `speed`: m/s; `rate`: yaw rate
        that is expected now, rad/s.
        """
        self.lasted_s += step
        if reading != self.reading or self.lasted_s > self.longest_s:
            self.reading = reading
            self.lasted_s = 0.0
            self.rate = rate
            self.balance = -self.ship.acceleration(rudder, rate, speed)
            self.turned = 0.0

        by_rudder = self.ship.acceleration(rudder, self.rate, speed)
        self.rate += (by_rudder + self.balance) * step
        self.turned += self.rate * step
        return abs(self.turned)
