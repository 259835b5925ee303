"""An autopilot between instruments and rudder, which hands over after a fault."""

from dataclasses import replace
from math import inf, pi, radians, tau
from typing import Any

from agents.controllers.guided import TURNS, Guided
from agents.controllers.turn_rate import TurnRate
from agents.deployment.autopilot import Autopilot
from agents.deployment.c99 import render
from agents.deployment.next_leg import NextLeg, PlottedCourse
from agents.deployment.nmea import readings, sentences
from agents.deployment.route import Route
from agents.deployment.sensors import HelmSensors, Limits
from shipgym import InputError
from shipgym.checks import check_number
from shipgym.tasks.guidance import wrapped
from shipgym.trials.nmea import NMEA_QUANTITIES

STANDBY, STEERING, MANUAL = "standby", "steering", "manual"


class Helm:
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
            agent = _with_largest_rate(agent, rate)
        self.pilot = Autopilot(agent)
        self.pilot.largest = min(self.pilot.largest, radians(limits.order_deg))
        self.limits = limits
        self.sensors = HelmSensors(limits)
        self.heading = heading
        self.route = route
        self.rate = rate
        self.follows_path = isinstance(agent, Guided)
        self.needed = self._needed()
        self._check(agent)

        self.state = STANDBY
        self.held = False  # in standby by the helmsman's wish
        self.has_steered = False
        self.obstacle = "no sensors"  # why it cannot steer
        self.well_since = inf  # time since which there is none, s
        self.now = -inf  # time of the last watch, s
        self.plotted = PlottedCourse()
        self.question: NextLeg | None = None  # for the helmsman
        self.alarm = ""
        self.warnings: list[str] = []
        self.notices: list[str] = []  # warnings of others
        self.silent = ["sensors"]  # what it waits for
        self.order = 0.0  # rudder, rad
        self.counts = {"sentences": 0, "damaged": 0}

    def _needed(self) -> list[str]:
        """Quantities that the instruments have to measure."""
        provided = {"set_point", "rate_of_turn"}
        if self.route is not None:
            provided.update(Route.GIVES)
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
                "route: expected 'wheel-over' or 'mpc' of shipgym autopilot with a"
                f" route, or another without, got '{name}' {preposition} a route"
            )

    def hear(self, line: str, source: str, now: float) -> None:
        """Take in a line that was received from an address at a time, s."""
        heard = readings(line, source)
        if heard is None:
            self.counts["damaged"] += 1
            return
        self.counts["sentences"] += 1
        for reading in heard:
            self.sensors.take(reading, now)

    def watch(self, step: float, now: float, fault: str | None = None) -> None:
        """Begin when all sensors are there; hand over at a fault.

        `step`: time since the last call, s; `fault`: one of another part.
        """
        inputs = self.inputs(now)
        self.now = now
        self.silent = []
        for name, value in inputs.items():
            if value is None:
                self.silent.append(name.replace("_", " "))

        if self.state == STANDBY and not self.silent and not self.held:
            self._begin()
        elif not fault:
            fault = self._fault(step, now)
        if fault and self.state == STEERING:
            self.state = MANUAL
            self.alarm = fault
        self._note_obstacle(fault or "")
        self._follow_plotter(now)
        self.warnings = []
        if self.state == STEERING:
            self.warnings = [*self.warnings_of(inputs, now), *self.notices]

    def _fault(self, step: float, now: float) -> str:
        if self.silent:
            silent = " and no ".join(self.silent)
            return f"no {silent} for {self.limits.silence_s:g} s"
        order = self.order
        if self.state != STEERING:  # the rudder follows the helmsman
            order = self.sensors.value("rudder", now) or 0.0
        fault = self.sensors.fault(order, step, now)
        if not fault and self.route is not None and self.route.ended:
            fault = "the end of the route is reached"
        return fault

    def _note_obstacle(self, fault: str) -> None:
        """Note why it cannot steer; after an alarm all has to be well for a while."""
        if fault:
            self.well_since = inf
        else:
            self.well_since = min(self.well_since, self.now)
        self.obstacle = fault
        well_s = self.now - self.well_since
        enough_s = self.limits.persistence_s
        if self.state == MANUAL and not fault and well_s < enough_s:
            self.obstacle = f"all has to be well for {enough_s:g} s first"

    def _follow_plotter(self, now: float) -> None:
        """Follow the plotter's course; close a question that was not answered."""
        if self.heading is None:
            if self.state != STEERING:
                self.plotted.take()
            self.plotted.follow(self._plotters_course(now))
        asked = self.question
        if asked is not None and (self.state != STEERING or not asked.is_open(now)):
            self.question = None

    def _begin(self) -> None:
        """Steer from the rudder and, if it steers its own, the heading of now."""
        self.state = STEERING
        self.has_steered = True
        self.alarm = ""
        self.held = False
        self.order = self.sensors.value("rudder", self.now) or 0.0
        self.sensors.expected = None
        self.pilot.switch_on()

    def stand_by(self) -> None:
        """Give the rudder back to the helmsman until `engage`.

        After an alarm it is his already.
        """
        self.held = True
        self.question = None
        if self.state == STEERING:
            self.state = STANDBY

    def engage(self) -> None:
        """Steer again, after stand-by or an alarm.

        An autopilot that keeps a heading of its own keeps the one that the ship has
        now. Raises InputError unless all is well, after an alarm for `persistence_s`.
        """
        self.question = None
        if self.state == STEERING:
            return
        if self.obstacle:
            raise InputError(f"cannot steer: {self.obstacle}")
        if self.heading is not None and self.has_steered:
            self.heading = self.sensors.value("heading", self.now)
        self._begin()

    def change_heading(self, delta: float) -> None:
        """Turn the set-point by an angle, rad, positive to starboard.

        Of an autopilot that keeps a plotter's heading it becomes its own, until
        `next_leg`. Raises InputError if it does not steer, follows a path or turns at a
        rate, or if the set-point came near to the opposite of the heading, from where
        the ship might turn to the other side.
        """
        check_number(delta, "change of heading")
        self.question = None
        inputs = self.inputs(self.now)
        turns_at_rate = self.rate is not None and self.heading is None
        if self.state != STEERING:
            raise InputError("no change of heading: not steering")
        if self.follows_path or turns_at_rate:
            course = "rate of turn" if turns_at_rate else "track"
            raise InputError(f"no change of heading: it steers a {course}")

        set_point = inputs["set_point"]
        heading = inputs["heading"]
        if set_point is None or heading is None:
            raise InputError("no change of heading: no heading")
        to_turn = wrapped(set_point - heading) + delta
        if abs(to_turn) > 0.95 * pi and abs(to_turn) > abs(to_turn - delta):
            raise InputError("no change of heading: more than 170° from the heading")
        self.heading = (set_point + delta) % tau
        self.plotted.take()

    def next_leg(self, confirm: bool = False) -> None:
        """Ask the helmsman for the next leg; with `confirm` turn to it.

        It is that of the route, which she is on from then, or that of the plotter.
        Raises InputError if there is none, or it has not been asked for before.
        """
        asked = self.question
        self.question = None
        if self.state != STEERING:
            raise InputError("no next leg: not steering")
        course = self._next_course()
        if course is None:
            raise InputError("no next leg: none is known")

        now_steered = self.inputs(self.now)["set_point"] or 0.0
        turn = float(wrapped(course - now_steered))
        question = NextLeg(course, turn, self.now)
        if not confirm:
            self.question = question
            return
        if asked is None or abs(wrapped(asked.course - course)) > PlottedCourse.new_leg:
            raise InputError("nothing to confirm: ask for the next leg first")
        if self.route is not None:
            self.route.advance()
            return
        self.heading = None
        self.plotted.take()

    def _next_course(self) -> float | None:
        """Direction of the next leg of the route or the plotter, rad; None if none."""
        if self.route is not None:
            return self.route.next_course()
        if self.rate is not None:
            return None
        if self.heading is None:
            return self.plotted.waiting
        return self._plotters_course(self.now)

    def steer(self, now: float) -> None:
        """One control interval."""
        if self.state == STEERING:
            inputs = self.inputs(now)
            self.order = self.pilot.step(_known(inputs))

    def inputs(self, now: float) -> dict[str, float | None]:
        """Inputs of the autopilot by name; None for what is not known."""
        inputs = self.sensors.numbers(self.needed, now)
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
        """Heading to steer, its own or that of the plotter."""
        if self.heading is not None:
            return self.heading
        if self.rate is not None:
            return 0.0
        return self.plotted.steered(self._plotters_course(now))

    def _plotters_course(self, now: float) -> float | None:
        """Heading to steer by the plotter which was heard first, or her leg."""
        plotted = ("leg",) if self.follows_path else ("to_steer", "waypoint_bearing")
        for quantity in self.sensors.newest:
            if quantity in plotted:
                return self.sensors.value(quantity, now)
        return None

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

        reach = self.pilot.agent.gains["turn_reach"]
        for turn in ("next", "second"):
            to_go = inputs[f"{turn}_turn_distance"] - reach
            angle = inputs[f"{turn}_turn_angle"]
            if angle and to_go > 0.0:
                return float(to_go / speed)
        return inf

    @property
    def status(self) -> str:
        """The state, what it waits for, or why it has handed over."""
        if self.state == STANDBY and self.held:
            return f"{STANDBY}, by the helmsman"
        if self.state == STANDBY:
            silent = ", ".join(self.silent)
            return f"{STANDBY}, waits for {silent}"
        if self.alarm:
            return f"{MANUAL}: ALARM, {self.alarm}: take the wheel"
        return ", ".join([self.state, *self.warnings])

    def sentences(self) -> str:
        """Rudder order and status, and the alarm if there is one."""
        text = render(
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
        return sentences(text)


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
