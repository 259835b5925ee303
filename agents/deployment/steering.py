"""`shipgym steer`: an autopilot on NMEA 0183, which hands over when it cannot trust what it is told."""

import asyncio
import gc
from collections.abc import Callable, Iterable
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from math import ceil, cos, inf, radians, sin
from time import perf_counter
from typing import Any

from agents.controllers.guided import Guided
from agents.controllers.turn_rate import TurnRate
from agents.deployment.autopilot import Autopilot
from agents.deployment.c99 import render
from agents.deployment.nmea import TABLES, Link, Reading, readings, sentences
from agents.deployment.route import Route
from agents.deployment.scheduling import short_slice
from shipgym import InputError
from shipgym.checks import check_number
from shipgym.tasks.guidance import wrapped
from shipgym.trials.units import KNOT

STANDBY, STEERING, MANUAL = "standby", "steering", "manual"
LONGEST_TICK = 1.0  # s, between two looks at the sensors
EARLY_S = 1e-3  # before a step it sleeps no more: who sleeps wakes late
RETRY_S, CONNECT_S = 1.0, 5.0  # between two attempts to connect, and the longest of one
ANGLES = ("heading", "course", "leg", "to_steer", "rudder", "waypoint_bearing")
PLACES = ("latitude", "longitude")
EARTH_M = 6.371e6  # radius


@dataclass(frozen=True)
class Limits:
    """When an autopilot hands over to the helmsman, or warns him, and its largest rudder."""

    silence_s: float = 3.0  # without a valid reading of anything that it steers by
    disagreement_deg: float = (
        5.0  # between angles of two instruments; of yaw rates a tenth of it a second
    )
    disagreement_kn: float = 4.0  # between their speeds
    rudder_deg: float = (
        5.0  # between the rudder and where its order should have brought it
    )
    rudder_rate_deg_s: float = (
        2.3  # slowest of the steering gear; this is that of SOLAS II-1/29
    )
    persistence_s: float = 2.0  # how long a disagreement may last
    late_s: float = 1.0  # how late a step may be; then the computer cannot keep up
    position_m: float = 100.0  # between positions of two receivers
    order_deg: float = (
        90.0  # largest rudder that is ordered, if it is less than the ship's limit
    )
    off_heading_deg: float = 10.0  # of the heading from its set-point: a warning
    off_track_m: float = 200.0  # of the ship from her track: a warning
    early_s: float = 60.0  # before a course change, in which it is announced

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            check_number(value, name, above=0.0)

    def between(self, quantity: str) -> float:
        """How much two instruments may differ, SI units."""
        if quantity in ANGLES or quantity == "yaw_rate":
            return radians(self.disagreement_deg) * (
                0.1 if quantity == "yaw_rate" else 1.0
            )
        if quantity in PLACES:
            return self.position_m / EARTH_M
        if quantity in ("cross_track", "waypoint_distance"):
            return inf
        return self.disagreement_kn * KNOT


@dataclass
class Sensors:
    """The newest readings, and what is wrong with them."""

    limits: Limits
    newest: dict[str, dict[str, tuple[float, float]]] = field(
        default_factory=dict
    )  # by quantity and talker
    since: dict[str, float] = field(
        default_factory=dict
    )  # when something wrong was first seen, s
    expected: float | None = (
        None  # where the rudder should be by now, at the slowest, rad
    )

    def take(self, reading: Reading, now: float) -> None:
        """Keep a reading; the first talker of a quantity is the one that is steered by."""
        self.newest.setdefault(reading.quantity, {})[reading.talker] = (
            reading.value,
            now,
        )

    def value(self, quantity: str, now: float) -> float | None:
        """What the first talker of a quantity said last; None if that is too long ago."""
        value, at = next(iter(self.newest.get(quantity, {}).values()), (0.0, -inf))
        return value if now - at <= self.limits.silence_s else None

    def numbers(self, needed: Iterable[str], now: float) -> dict[str, float | None]:
        """What an autopilot reads; speeds over ground where no log tells those through the water."""
        found = {quantity: self.value(quantity, now) for quantity in needed}
        course, speed, heading = (
            self.value(one, now) for one in ("course", "speed", "heading")
        )
        for quantity, part in (("surge", cos), ("sway", sin)):
            if (
                quantity in found
                and quantity not in self.newest
                and None not in (course, speed, heading)
            ):
                found[quantity] = speed * part(course - heading)  # type: ignore[operator]
        return found

    def fault(self, order: float, step: float, now: float) -> str | None:
        """Two talkers that differ, or a rudder that does not follow its order, for too long."""
        for quantity, talkers in self.newest.items():
            fresh = [
                (name, v)
                for name, (v, at) in talkers.items()
                if now - at <= self.limits.silence_s
            ]
            for name, value in fresh[1:]:
                apart = abs(value - fresh[0][1])
                apart = abs(float(wrapped(apart))) if quantity in ANGLES else apart
                if self._lasts(
                    f"{quantity} {name}", apart > self.limits.between(quantity), now
                ):
                    return (
                        f"{quantity.replace('_', ' ')} of {fresh[0][0]} and {name}"
                        " disagree"
                    )
        rudder, reach = (
            self.value("rudder", now) or 0.0,
            radians(self.limits.rudder_rate_deg_s) * step,
        )
        expected = rudder if self.expected is None else self.expected
        self.expected = expected + min(max(order - expected, -reach), reach)
        low, high = sorted((self.expected, order))
        off = max(low - rudder, rudder - high) > radians(self.limits.rudder_deg)
        return (
            "the rudder does not follow its order"
            if self._lasts("order", off, now)
            else None
        )

    def _lasts(self, what: str, wrong: bool, now: float) -> bool:
        if not wrong:
            self.since.pop(what, None)
        return (
            wrong and now - self.since.setdefault(what, now) > self.limits.persistence_s
        )


class Helm:
    """The autopilot between sensors and rudder: `standby`, `steering`, and, after a fault, `manual` for good.

    `heading`, rad, is its set-point, of guidance the direction of the leg; None: the
    plotter's (APB, BWC). `route`: the track to keep to, for an autopilot that sees the
    turn ahead; `rate`, rad/s: rate of turn of one that steers it, with a heading at
    most. Raises InputError for an autopilot that reads what no sentence tells, and for
    one that steers no route or no rate of turn.
    """

    def __init__(
        self,
        agent: Any,
        heading: float | None,
        limits: Limits,
        route: Route | None = None,
        rate: float | None = None,
    ) -> None:
        if rate is not None and heading is not None and isinstance(agent, TurnRate):
            most = float(agent.rates[-1])
            check_number(
                rate,
                "rate of turn",
                above=0.0,
                at_most=most,
                hint="rad/s, to a heading",
            )
            agent = replace(agent, gains={**agent.gains, "rate": rate})
        self.pilot, self.limits, self.sensors = (
            Autopilot(agent),
            limits,
            Sensors(limits),
        )
        self.pilot.largest = min(self.pilot.largest, radians(limits.order_deg))
        self.heading, self.state, self.alarm, self.order = heading, STANDBY, "", 0.0
        self.route, self.rate, self.warnings = route, rate, list[str]()
        self.plotted = (
            ("leg",) if isinstance(agent, Guided) else ("to_steer", "waypoint_bearing")
        )
        without = {"set_point", "rate_of_turn", *(Route.GIVES if route else ())}
        self.needed = [
            one for one in (*self.pilot.inputs, "rudder") if one not in without
        ]
        self.needed += PLACES if route else ()
        self._check(agent)
        self.silent, self.counts = ["sensors"], {"sentences": 0, "damaged": 0}

    def _check(self, agent: Any) -> None:
        name = getattr(agent, "name", type(agent).__name__)
        sees_turns = isinstance(agent, Guided) and {*Route.GIVES} <= {
            *self.pilot.inputs
        }
        if self.rate is not None and not isinstance(agent, TurnRate):
            raise InputError(
                f"rate of turn: autopilot '{name}' found, expected 'turn-rate'"
            )
        if (self.route is not None) != sees_turns:
            raise InputError(
                f"route: autopilot '{name}' {'with' if self.route else 'without'} a"
                " route found, expected 'wheel-over' or 'mpc' of shipgym"
                " autopilot with a route, or another without"
            )
        if unknown := set(self.needed) - TABLES["believed"].keys():
            raise InputError(
                f"autopilot: it reads {', '.join(sorted(unknown))}, which no sentence"
                " of NMEA 0183 tells it"
            )
        if "cross_track" in self.pilot.inputs and not isinstance(agent, Guided):
            raise InputError(
                f"autopilot: '{name}' learned to follow paths, expected one for course"
                " keeping"
            )

    def hear(self, line: str, now: float) -> None:
        """Take in a line that was received."""
        found = readings(line)
        self.counts["damaged" if found is None else "sentences"] += 1
        for reading in found or ():
            self.sensors.take(reading, now)

    def watch(self, step: float, now: float, fault: str | None = None) -> None:
        """Begin when all sensors are there; hand over for good when one is wrong, or at another fault."""
        given = self.given(now)
        self.silent = silent = [
            name.replace("_", " ") for name, value in given.items() if value is None
        ]
        if self.state == STANDBY and not silent:
            self.state = STEERING
        elif self.state == STEERING and not fault:
            fault = (
                f"no {' and no '.join(silent)} for {self.limits.silence_s:g} s"
                if silent
                else None
            )
            fault = fault or self.sensors.fault(self.order, step, now)
            ended = self.route is not None and self.route.ended
            fault = fault or ("the end of the route is reached" if ended else None)
        if fault and self.state == STEERING:
            self.state, self.alarm = MANUAL, fault
        self.warnings = self._warned(given, now) if self.state == STEERING else []

    def steer(self, now: float) -> None:
        """One control interval."""
        if self.state == STEERING:
            self.order = self.pilot.step(
                {name: value or 0.0 for name, value in self.given(now).items()}
            )

    def given(self, now: float) -> dict[str, float | None]:
        """What the autopilot is given; None for what is not known."""
        found = self.sensors.numbers(self.needed, now)
        found["rate_of_turn"] = (
            0.0 if self.rate is None or self.heading is not None else self.rate
        )
        if self.route is None:
            heard = next(
                (one for one in self.sensors.newest if one in self.plotted),
                self.plotted[0],
            )
            plotted = 0.0 if self.rate is not None else self.sensors.value(heard, now)
            return {
                **found,
                "set_point": plotted if self.heading is None else self.heading,
            }
        latitude, longitude = (found[one] for one in PLACES)
        if latitude is None or longitude is None:
            return found
        return {**found, **self.route.given(latitude, longitude)}

    def _warned(self, given: dict[str, float | None], now: float) -> list[str]:
        """What the helmsman is to know although the autopilot steers."""
        number = {name: value or 0.0 for name, value in given.items()}
        off = abs(float(wrapped(number.get("set_point", 0.0) - number["heading"])))
        keeps_heading = "leg" not in self.plotted and not number["rate_of_turn"]
        off_track = abs(number.get("cross_track", 0.0)) > self.limits.off_track_m
        ahead = self._seconds_to_turn(number, now) <= self.limits.early_s
        found = {
            "off heading": keeps_heading and off > radians(self.limits.off_heading_deg),
            "off track": off_track,
            "course change ahead": ahead,
        }
        return [text for text, holds in found.items() if holds]

    def _seconds_to_turn(self, given: dict[str, float], now: float) -> float:
        """Time to where the next turn is begun, or to the plotter's waypoint, s."""
        speed, to_waypoint = (
            self.sensors.value("speed", now),
            self.sensors.value("waypoint_distance", now),
        )
        if not speed:
            return inf
        if self.route is None:
            return inf if to_waypoint is None else to_waypoint / speed
        reach = self.pilot.agent.gains["turn_reach"]
        turns = [
            (given[f"{k}_turn_distance"], given[f"{k}_turn_angle"])
            for k in ("next", "second")
        ]
        return min(
            (
                (to_go - reach) / speed
                for to_go, turn in turns
                if turn and to_go > reach
            ),
            default=inf,
        )

    @property
    def status(self) -> str:
        """What it does, what it waits for, or why it has handed over."""
        if self.state == STANDBY:
            return f"{STANDBY}, waits for {', '.join(self.silent)}"
        steering = ", ".join([self.state, *self.warnings])
        return (
            f"{MANUAL}: ALARM, {self.alarm}: take the wheel" if self.alarm else steering
        )

    def sentences(self) -> str:
        """Rudder order and status, and the alarm if there is one."""
        return sentences(
            render(
                "helm.nmea.j2",
                order=self.order,
                valid=self.state == STEERING,
                limit=self.pilot.largest,
                set_point=self.heading,
                alarm=self.alarm,
                track=self.route is not None,
                rate=self.rate,
                warnings=self.warnings,
            )
        )


async def steer(
    agent: Any,
    address: str,
    *,
    heading: float | None = None,
    limits: Limits | None = None,
    duration: float = inf,
    speed_up: float = 1.0,
    told: Callable[[str], None] = print,
    route: Route | None = None,
    rate: float | None = None,
) -> Helm:
    """Steer a ship over NMEA 0183 for a duration in s; the helm as it was at the end.

    `agent`, `heading`, `limits`, `route` and `rate` are those of `Helm`, `address` is
    that of a `Link`. Of simulated ships `speed_up` seconds pass in one. `told` is given
    a line for each change of state. It waits for an address at which nobody answers
    yet, and connects again when the connection was closed, which ends in an alarm if it
    steered. Raises InputError for an address that cannot be opened at all, or at which
    nobody answered until the end, and for an autopilot that reads what no sentence
    tells.
    """
    for name, number in (
        ("speed_up", speed_up),
        ("heading", heading or 0.0),
        ("rate", rate or 0.0),
    ):
        check_number(number, name)
    helm, loop = (
        Helm(agent, heading, limits or Limits(), route, rate),
        asyncio.get_running_loop(),
    )
    link = Link(lambda line: helm.hear(line, loop.time() * speed_up))
    parts = ceil(helm.pilot.dt / LONGEST_TICK - 1e-9)
    missing, retry_at = await _missing(link, address, first=True), loop.time() + RETRY_S
    tick, begin, number, status = helm.pilot.dt / parts, loop.time() * speed_up, 0, ""
    # so that no collection of garbage looks through all that was imported, which takes
    # long
    gc.freeze()
    with (
        closing(link),
        short_slice(),
        suppress(asyncio.CancelledError),
    ):  # an interruption ends it
        while number * tick < duration:
            due = begin + number * tick
            await asyncio.sleep(max(0.0, due / speed_up - EARLY_S - loop.time()))
            ready = perf_counter() + due / speed_up - loop.time()
            while perf_counter() < ready:
                pass
            now = loop.time() * speed_up
            late = helm.state == STEERING and now - due > helm.limits.late_s * speed_up
            fault = f"a step came {now - due:.1f} s late" if late else None
            helm.watch(tick, now, fault if link.ends else "the connection was closed")
            if number % parts == 0:
                helm.steer(now)
            link.send(helm.sentences())
            before, status = status, f"{helm.status}{'' if link.ends else missing}"
            if status != before:
                told(f"{number * tick:.1f} s: {status}")
            if not link.ends and loop.time() >= retry_at:
                missing, retry_at = await _missing(link, address), loop.time() + RETRY_S
            number += 1
    if missing and not (link.ends or any(helm.counts.values())):
        raise InputError(
            f"{missing[2:]}; nobody was heard in {number * tick:g} s: start the other"
            " end first"
        )
    return helm


async def _missing(link: Link, address: str, first: bool = False) -> str:
    """Why a link could not be opened but may be later, for the line of status; empty where it is open."""
    try:
        await asyncio.wait_for(link.open(address), CONNECT_S)
    except TimeoutError:
        return f"; {address}: no answer"
    except InputError as error:
        if first and not isinstance(error.__cause__, ConnectionError | TimeoutError):
            raise
        return f"; {error}"
    return ""
