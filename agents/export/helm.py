"""An autopilot between instruments and rudder, which hands over after a fault."""

from contextlib import suppress
from dataclasses import replace
from math import inf, radians
from typing import Any

from agents.controllers.guided import TURNS, Guided
from agents.controllers.turn_rate import TurnRate
from agents.export.alerts import Alerts
from agents.export.autopilot import Autopilot
from agents.export.c99 import render
from agents.export.compass import Compass
from agents.export.heading_belief import HeadingBelief
from agents.export.helm_commands import (
    MANUAL,
    STANDBY,
    STEERING,
    HelmCommands,
)
from agents.export.nmea import gives_up_steering, readings, sentences
from agents.export.route import Route
from agents.export.sensors import HelmSensors, Limits
from shipgym import InputError
from shipgym.checks import check_number
from shipgym.tasks.guidance import wrapped
from shipgym.trials.nmea import NMEA_QUANTITIES
from shipgym.trials.units import UNITS


class Helm(HelmCommands):
    """An autopilot that waits for its sensors, steers, and hands over after a fault.

    Its state is `standby`, `steering` or, after a fault, `manual`, which only the
    helmsman ends. Raises InputError for an autopilot that reads what no sentence of
    NMEA 0183 has, and for one that cannot follow the route or the rate of turn.

    Parameters
    ----------
    agent : Controller or LearnedPolicy
        The autopilot.
    heading : float or None
        Set-point, rad; for path following the direction of the leg. None: the chart
        plotter's (APB, BWC, BWR).
    limits : Limits
        When it hands over, and when it warns.
    route : Route, optional
        Track to keep, for an autopilot that sees the turn ahead.
    rate : float, optional
        Rate of turn, rad/s, of an autopilot that steers one; with a heading the
        largest.
    variation : float, optional
        Magnetic variation, rad, positive to the east; by default that of RMC or HDG.
    rudder_feedback : bool
        False: steer without a measured rudder, which then nobody watches.
    """

    def __init__(
        self,
        agent: Any,
        heading: float | None,
        limits: Limits,
        route: Route | None = None,
        rate: float | None = None,
        variation: float | None = None,
        rudder_feedback: bool = True,
    ) -> None:
        super().__init__()
        if rate is not None and heading is not None and isinstance(agent, TurnRate):
            agent = _with_largest_rate(agent, rate)
        self.pilot = Autopilot(agent)
        self.pilot.largest = min(self.pilot.largest, radians(limits.order_deg))
        self.limits = limits
        self.sensors = HelmSensors(limits)
        self.belief = HeadingBelief(agent, limits)
        self.heading = heading
        self.route = route
        self.rate = rate
        self.compass = Compass(variation)
        self.rudder_feedback = rudder_feedback
        self.follows_path = isinstance(agent, Guided)
        self.needed = self._needed()
        self._check(agent)

        self.state = STANDBY
        self.alarm = ""
        self.warnings: list[str] = []
        self.notices: list[str] = []  # warnings of others
        self.silent = ["sensors"]  # what it waits for
        self.order = 0.0  # rudder, rad
        self.commanded: float | None = None  # heading by HSC or HTC, rad
        self.now = 0.0  # of the last watch, s
        self.ended_by = ""  # the signal that ended it
        self.alerts = Alerts()
        self.counts = {"sentences": 0, "damaged": 0}

    def _needed(self) -> list[str]:
        """Quantities that the instruments have to measure."""
        provided = {"set_point", "rate_of_turn"}
        if self.route is not None:
            provided.update(Route.GIVES)
        if not self.rudder_feedback:
            provided.add("rudder")
        needed = []
        for name in (*self.pilot.inputs, "rudder"):
            if name not in provided:
                needed.append(name)
        position = ("latitude", "longitude")
        if self.route is not None:
            needed += position
        return needed

    def _check(self, agent: Any) -> None:
        """Refuse an autopilot that cannot be used in this way."""
        name = getattr(agent, "name", type(agent).__name__)
        if self.rate is not None and not isinstance(agent, TurnRate):
            raise InputError(
                f"rate of turn: expected autopilot 'turn-rate', got '{name}'"
            )
        self._check_route(name)
        unknown = set(self.needed) - NMEA_QUANTITIES.keys()
        if unknown:
            read = ", ".join(sorted(unknown))
            raise InputError(
                "autopilot: expected one that reads what sentences of NMEA 0183 have,"
                f" got '{name}', which reads {read}"
            )
        if "cross_track" in self.pilot.inputs and not self.follows_path:
            raise InputError(
                f"autopilot: expected one for course keeping, got '{name}', which"
                " learned to follow paths"
            )

    def _check_route(self, name: str) -> None:
        """Refuse guidance by turns without a route that shows them, and the reverse."""
        turns: set[str] = set()
        if self.follows_path:
            turns = {*TURNS} & {*self.pilot.inputs}
        has_route = self.route is not None
        preposition = "with" if has_route else "without"
        if has_route != bool(turns) or not turns <= {*Route.GIVES}:
            raise InputError(
                "route: expected 'preview-lq', 'wheel-over' or 'mpc' of shipgym"
                " autopilot with a route, or another without, got"
                f" '{name}' {preposition} a route"
            )

    def hear(self, line: str, source: str, now: float) -> None:
        """Take in a line that was received from an address at a time, s."""
        heard = readings(line, source)
        if heard is None:
            self.counts["damaged"] += 1
            return
        self.counts["sentences"] += 1
        if gives_up_steering(line):
            self.stand_by()
        for reading in self.compass.true(heard, now):
            self.sensors.take(reading, now)
            quantity = reading.quantity
            is_steered_by = self.sensors.value(quantity, now) == reading.value
            if is_steered_by:
                self.belief.take(reading, now)
            if quantity == "commanded":
                self.commanded = reading.value
        with suppress(ValueError, IndexError):
            self.alerts.hear(line, now)

    def watch(self, step: float, now: float, fault: str | None = None) -> None:
        """Begin when all sensors are there; hand over at a fault.

        `step`: time since the last call, s; `fault`: one of another part.
        """
        self.now = now
        if self.state != STEERING:
            self.sensors.renew(now)
        self.follow_plotter(now)
        inputs = self.inputs(now)
        self.silent = []
        for name, value in inputs.items():
            if value is None:
                self.silent.append(name.replace("_", " "))

        may_begin = not (self.silent or self.held or fault)
        if self.state == STANDBY and may_begin:
            self.begin()
        elif not fault:
            fault = self._fault(step, now)
        if fault and self.state == STEERING:
            self.state = MANUAL
            self.alarm = fault
            self.question = None
        self.note_obstacle(fault or "")
        self.warnings = []
        if self.state == STEERING:
            self.warnings = [*self.warnings_of(inputs, now), *self.notices]
        else:
            self.order = 0.0
        self._give_alerts(now)

    def _give_alerts(self, now: float) -> None:
        """Hand the alarm and the warnings over to alert management."""
        texts = {warning: warning for warning in self.warnings}
        if self.alarm:
            texts["alarm"] = self.alarm
        self.alerts.update(texts, now)

    def _fault(self, step: float, now: float) -> str:
        if self.silent:
            silent = " and no ".join(self.silent)
            return f"no {silent} for {self.limits.silence_s:g} s"
        is_steering = self.state == STEERING
        order = self.order
        if not is_steering:  # the rudder follows the helmsman
            order = self.sensors.value("rudder", now) or 0.0
        fault = self.sensors.fault(order, step, now, self.read)
        doubt = self.belief.doubt(self.sensors, now)
        if doubt and not is_steering:  # look again
            self.belief = HeadingBelief(self.pilot.agent, self.limits)
        fault = fault or doubt
        if not fault and self.route is not None and self.route.ended:
            fault = "the end of the route is reached"
        return fault

    def steer(self, now: float) -> None:
        """One control interval."""
        if self.state == STEERING:
            inputs = self.inputs(now)
            self.order = self.pilot.step(_known(inputs))

    def inputs(self, now: float) -> dict[str, float | None]:
        """Inputs of the autopilot by name; None for what is not known."""
        inputs = self.sensors.numbers(self.needed, now)
        if not self.rudder_feedback:
            rudder = self.sensors.value("rudder", now)
            inputs["rudder"] = self.sensors.expected if rudder is None else rudder
            inputs["rudder"] = inputs["rudder"] or 0.0
        turns_at_rate = self.rate is not None and self.heading is None
        inputs["rate_of_turn"] = self.rate if turns_at_rate else 0.0
        if self.route is None:
            inputs["set_point"] = self._set_point(now)
            if "cross_track" in inputs and self.plotted.waiting is not None:
                inputs["cross_track"] = 0.0  # that of the plotter is from the new leg
            return inputs

        latitude = inputs["latitude"]
        longitude = inputs["longitude"]
        if latitude is not None and longitude is not None:
            inputs |= self.route.given(latitude, longitude)
        return inputs

    def _set_point(self, now: float) -> float | None:
        """Heading to steer, its own or that of the plotter which was heard first."""
        if self.heading is not None:
            return self.heading
        if self.rate is not None:
            return 0.0
        if self.commanded is not None and not self.follows_path:
            return self.commanded
        return self.plotted.steered(self.plotters_course(now))

    @property
    def read(self) -> set[str]:
        """Quantities that it steers by."""
        read = set(self.needed)
        if self.heading is None and self.route is None:
            read.update(self.plotter_quantities)
        if (read & {"surge", "sway"}) - self.sensors.newest.keys():
            read |= {"course", "speed", "heading"}
        return read

    def warnings_of(self, inputs: dict[str, float | None], now: float) -> list[str]:
        """Warnings for the helmsman although the autopilot steers."""
        known = _known(inputs)
        warnings = []

        keeps_heading = not self.follows_path and not known["rate_of_turn"]
        set_point = known.get("set_point", 0.0)
        off_heading = abs(wrapped(set_point - known["heading"]))
        largest = radians(self.limits.off_heading_deg)
        if keeps_heading and off_heading > largest:
            warnings.append("off heading")

        cross_track = known.get("cross_track", 0.0)
        if abs(cross_track) > self.limits.off_track_m:
            warnings.append("off track")

        seconds_to_turn = self.seconds_to_turn(known, now)
        if seconds_to_turn <= self.limits.early_s:
            warnings.append("course change ahead")
        if self.plotted.waiting is not None:
            warnings.append("next leg waits to be confirmed")
        return warnings

    def seconds_to_turn(self, inputs: dict[str, float], now: float) -> float:
        """Time to where the next turn begins, or to the plotter's waypoint, s."""
        speed = self.sensors.value("speed", now)
        if not speed:
            return inf
        if self.route is None:
            distance = self.sensors.value("waypoint_distance", now)
            return inf if distance is None else distance / speed

        for turn in ("next", "second"):
            angle = inputs[f"{turn}_turn_angle"]
            reach = self.pilot.agent.turn_reach(angle)
            to_go = inputs[f"{turn}_turn_distance"] - reach
            if angle and to_go > 0.0:
                return float(to_go / speed)
        return inf

    @property
    def status(self) -> str:
        """The state, what it waits for, or why it has handed over."""
        if self.state == STANDBY and self.held:
            return f"{STANDBY}, by the helmsman"
        if self.state == STANDBY:
            silent = ", ".join(self.silent or ["steering gear"])
            return "; ".join([f"{STANDBY}, waits for {silent}", *self.hints])
        if self.alarm:
            return f"{MANUAL}: ALARM, {self.alarm}: take the wheel"
        return ", ".join([self.state, *self.warnings])

    @property
    def hints(self) -> list[str]:
        """What was heard instead of that for which it waits, and what to do."""
        hints = []
        for name in ("heading", "to_steer", "leg"):
            waits = name.replace("_", " ") in self.silent or (
                name in self.plotter_quantities and "set point" in self.silent
            )
            if waits and self.compass.lacks(name, self.now, self.limits.silence_s):
                hints = [
                    "only magnetic bearings heard; no variation (RMC or HDG has one, or"
                    " start with --variation DEG)"
                ]
        if self.silent == ["rudder"]:
            hints.append("to steer without RSA start with --no-rudder-feedback")
        return hints

    def sentences(self, last: bool = False) -> str:
        """Rudder order and status, and alerts; with `last` it steers no more."""
        is_valid = self.state == STEERING and not last
        report = self._report(is_valid)
        order = self.order if is_valid else 0.0
        text = render("helm.nmea.j2", order=order, **report)
        return sentences(text) + self.alerts.sentences(self.now)

    def _report(self, is_valid: bool) -> dict[str, Any]:
        """Fields of HTD, and the status of ROR."""
        set_point = self.inputs(self.now).get("set_point") if is_valid else None
        keeps_track = self.follows_path or self.route is not None
        mode = "S"  # by itself; H by another's command, T a track, M manual
        if self.heading is None and self.rate is None:
            mode = "T" if keeps_track else "H"

        is_at_limit = abs(self.order) >= self.pilot.largest
        wrong = (
            is_at_limit,
            "off heading" in self.warnings,
            "off track" in self.warnings,
        )
        statuses = ["V" if is_wrong or not is_valid else "A" for is_wrong in wrong]
        off_track_miles = self.limits.off_track_m / UNITS["length"]["nm"]
        return {
            "status": "A" if is_valid else "V",
            "mode": mode if is_valid else "M",
            "limit": self.pilot.largest,
            "off_heading_deg": self.limits.off_heading_deg,
            "off_track": f"{off_track_miles:.3f}" if keeps_track else "",
            "rate": self.rate,
            "set_point": None if keeps_track else set_point,
            "track": set_point if keeps_track else None,
            "statuses": ",".join(statuses),
            "heading": self.sensors.value("heading", self.now),
        }


def _known(inputs: dict[str, float | None]) -> dict[str, float]:
    """Inputs, with 0 for what is not known."""
    return {name: value or 0.0 for name, value in inputs.items()}


def _with_largest_rate(agent: TurnRate, rate: float) -> TurnRate:
    """The autopilot with a largest rate of turn, rad/s."""
    check_number(
        rate,
        "rate of turn",
        above=0.0,
        at_most=float(agent.rates[-1]),
        hint="rad/s, to a heading",
    )
    return replace(agent, gains={**agent.gains, "rate": rate})
