"""`shipgym steer`: an autopilot live on NMEA 0183, which hands over as soon as it cannot trust what it is told."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, cos, degrees, inf, radians, sin
from typing import Any

from agents.controllers.los_autopilot import Guided
from agents.deployment.autopilot import Autopilot
from agents.deployment.nmea import Line, Link, Reading, heading_deg, readings, sentence
from shipgym.checks import check_number
from shipgym.errors import InputError
from shipgym.tasks.guidance import wrapped

TALKER = "AG"  # of autopilots
STANDBY, STEERING, MANUAL = "standby", "steering", "manual"
LONGEST_TICK = 1.0  # s, between two looks at the sensors
ANGLES = ("heading", "course", "leg", "to_steer")
OVER_GROUND = ("course", "speed")


@dataclass(frozen=True)
class Limits:
    """When an autopilot hands over to the helmsman.

    Attributes
    ----------
    silence_s : float
        Without a valid reading of anything that it steers by.
    disagreement_deg : float
        Between the headings, or rudder angles, of two instruments, for longer than `persistence_s`.
    disagreement_kn : float
        Between the speeds of two instruments; yaw rates may differ by a tenth of `disagreement_deg` a second.
    rudder_deg : float
        Between the rudder and where its order should have brought it, for longer than `persistence_s`.
    rudder_rate_deg_s : float
        Slowest rate of the steering gear; 2.3 degrees per second are SOLAS II-1/29's.
    persistence_s : float
        How long a disagreement may last.
    late_s : float
        How late a step may be: then the computer cannot keep up.
    """

    silence_s: float = 3.0
    disagreement_deg: float = 5.0
    disagreement_kn: float = 4.0
    rudder_deg: float = 5.0
    rudder_rate_deg_s: float = 2.3
    persistence_s: float = 2.0
    late_s: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            check_number(value, name, above=0.0)

    def between(self, quantity: str) -> float:
        """How much two instruments may differ, SI units."""
        speeds = {"surge", "sway", "speed"}
        if quantity == "cross_track":
            return inf  # of one plotter only
        if quantity in speeds:
            return self.disagreement_kn * 1852.0 / 3600.0
        return radians(self.disagreement_deg) * (0.1 if quantity == "yaw_rate" else 1.0)


class Sensors:
    """The newest readings, and what is wrong with them."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.newest: dict[str, dict[str, tuple[float, float]]] = {}  # value and time by quantity and talker
        self.since: dict[str, float] = {}  # when something wrong was first seen
        self.expected: float | None = None  # where the rudder should be by now, at the slowest

    def take(self, reading: Reading, now: float) -> None:
        """Keep a reading; the first talker of a quantity is the one that is steered by."""
        self.newest.setdefault(reading.quantity, {})[reading.talker] = reading.value, now

    def value(self, quantity: str, now: float) -> float | None:
        """What the first talker of a quantity said last; None if that is too long ago."""
        value, at = next(iter(self.newest.get(quantity, {}).values()), (0.0, -inf))
        return value if now - at <= self.limits.silence_s else None

    def numbers(self, needed: list[str], now: float) -> dict[str, float | None]:
        """What an autopilot reads; speeds through the water, or else over ground."""
        found = {quantity: self.value(quantity, now) for quantity in needed}
        course, speed, heading = (self.value(one, now) for one in (*OVER_GROUND, "heading"))
        for quantity, part in (("surge", cos), ("sway", sin)):
            if quantity not in self.newest and quantity in found and None not in (course, speed, heading):
                found[quantity] = speed * part(course - heading)  # type: ignore[operator]
        return found

    def disagreement(self, now: float) -> str | None:
        """Two talkers of one quantity that have differed too much for too long."""
        for quantity, talkers in self.newest.items():
            fresh = [(name, v) for name, (v, at) in talkers.items() if now - at <= self.limits.silence_s]
            for name, value in fresh[1:]:
                apart = value - fresh[0][1]
                apart = abs(float(wrapped(apart)) if quantity in ANGLES else apart)
                if self._lasts(f"{quantity} {name}", apart > self.limits.between(quantity), now):
                    return f"{quantity.replace('_', ' ')} of {fresh[0][0]} and {name} disagree"
        return None

    def rudder_fault(self, order: float, step: float, now: float) -> str | None:
        """A rudder that is not between where its order should have brought it by now and the order."""
        rudder = self.value("rudder", now)
        if rudder is None:
            return None
        expected, reach = (
            rudder if self.expected is None else self.expected,
            radians(self.limits.rudder_rate_deg_s) * step,
        )
        self.expected = expected + min(max(order - expected, -reach), reach)
        low, high = sorted((self.expected, order))
        off = max(low - rudder, rudder - high) > radians(self.limits.rudder_deg)
        return "the rudder does not follow its order" if self._lasts("rudder order", off, now) else None

    def _lasts(self, what: str, wrong: bool, now: float) -> bool:
        if not wrong:
            self.since.pop(what, None)
        return wrong and now - self.since.setdefault(what, now) > self.limits.persistence_s


class Helm:
    """The autopilot between sensors and rudder: `standby`, `steering`, and, after a fault, `manual` for good.

    Parameters
    ----------
    agent : Controller or Policy
        Any that reads what instruments tell.
    heading : float, optional
        Set-point, rad; of guidance the direction of the leg. By default the plotter's (APB).
    limits : Limits
    """

    def __init__(self, agent: Any, heading: float | None, limits: Limits) -> None:
        self.pilot, self.limits, self.sensors = Autopilot(agent), limits, Sensors(limits)
        self.heading, self.state, self.alarm, self.order = heading, STANDBY, "", 0.0
        self.from_plotter = "leg" if isinstance(agent, Guided) else "to_steer"
        known = {"set_point", "heading", "yaw_rate", "sway", "surge", "rudder", "cross_track"}
        if unknown := sorted(self.pilot.inputs.keys() - known):
            raise InputError(
                f"autopilot: it reads {', '.join(unknown)}, which no sentence of NMEA 0183 tells it"
            )
        self.needed = [one for one in (*self.pilot.inputs, "rudder") if one != "set_point"]
        self.counts = {"sentences": 0, "damaged": 0}

    def hear(self, line: str, now: float) -> None:
        """Take in a line that was received."""
        found = readings(line)
        self.counts["damaged" if found is None else "sentences"] += 1
        for reading in found or ():
            self.sensors.take(reading, now)

    def hand_over(self, reason: str) -> None:
        """Stop steering for good, and say why."""
        self.state, self.alarm = MANUAL, self.alarm or reason

    def watch(self, step: float, now: float) -> None:
        """Look at the sensors: begin when all are there, hand over when one is not to be trusted."""
        given = self._given(now)
        silent = [name.replace("_", " ") for name, value in given.items() if value is None]
        if self.state == STANDBY and not silent:
            self.state = STEERING
        elif self.state == STEERING:
            fault = f"no {' and no '.join(silent)} for {self.limits.silence_s:g} s" if silent else None
            fault = (
                fault or self.sensors.disagreement(now) or self.sensors.rudder_fault(self.order, step, now)
            )
            if fault:
                self.hand_over(fault)

    def steer(self, now: float) -> None:
        """One control interval."""
        if self.state == STEERING:
            self.order = self.pilot.step({name: value or 0.0 for name, value in self._given(now).items()})

    def _given(self, now: float) -> dict[str, float | None]:
        given = self.sensors.numbers(self.needed, now)
        plotted = self.sensors.value(self.from_plotter, now) if self.heading is None else self.heading
        return {**given, "set_point": plotted}

    def sentences(self) -> str:
        """Rudder order and status, and the alarm if there is one."""
        valid = "A" if self.state == STEERING else "V"
        texts = sentence(TALKER, "ROR", degrees(self.order), valid, "", "V", "B")
        side, angle = "R" if self.order >= 0.0 else "L", abs(degrees(self.order))
        set_point = "" if self.heading is None else heading_deg(self.heading)
        mode = "S" if self.state == STEERING else "M"
        texts += sentence(
            TALKER, "HTD", "V", angle, side, mode, "R", degrees(self.pilot.limit), "", "", "", set_point, "",
            "", valid, "", "", "", "T",
        )  # fmt: skip
        if self.alarm:
            texts += sentence(TALKER, "ALR", "", "001", "A", "V", self.alarm.upper()[:40])
        return texts


async def steer(
    agent: Any, address: str, *, heading: float | None = None, limits: Limits | None = None,
    duration: float = inf, speed_up: float = 1.0, told: Callable[[str], None] = print,
) -> Helm:  # fmt: skip
    """Steer a ship over NMEA 0183 until interrupted.

    Parameters
    ----------
    agent, heading, limits
        As of `Helm`.
    address : str
        As of `Link`: `tcp:HOST:PORT`, `udp:HOST:PORT`, `serial:DEVICE@BAUD`.
    duration : float
        s, after which it ends.
    speed_up : float
        For simulated ships: how many seconds pass in one.
    told : callable
        Given a line for each change of state.

    Returns
    -------
    Helm
        As it was at the end: `state`, `alarm`, `counts`.

    Raises
    ------
    InputError
        For an address that cannot be opened, or an autopilot that reads what no sentence tells.
    """
    helm, loop = Helm(agent, heading, limits or Limits()), asyncio.get_running_loop()

    def clock() -> float:
        return loop.time() * speed_up

    link = Link(lambda line: helm.hear(line, clock()))
    await link.open(address)
    try:
        await _steer(helm, link, clock, duration, speed_up, told)
    finally:
        link.close()
    return helm


async def _steer(
    helm: Helm, link: Link, clock: Callable[[], float], duration: float, speed_up: float,
    told: Callable[[str], None],
) -> None:  # fmt: skip
    parts = ceil(helm.pilot.dt / LONGEST_TICK - 1e-9)
    tick, begin, state, number = helm.pilot.dt / parts, clock(), "", 0
    while number * tick < duration:
        await asyncio.sleep(max(0.0, (begin + number * tick - clock()) / speed_up))
        late = clock() - begin - number * tick
        if helm.state == STEERING and (late > helm.limits.late_s * speed_up or not link.ends):
            helm.hand_over("the connection was closed" if not link.ends else f"a step came {late:.1f} s late")
        helm.watch(tick, clock())
        if number % parts == 0:
            helm.steer(clock())
        link.send(helm.sentences())
        if helm.state != state:
            state = helm.state
            told(
                f"{number * tick:.1f} s: {state}{f': ALARM, {helm.alarm}: take the wheel' if helm.alarm else ''}"
            )
        number += 1
