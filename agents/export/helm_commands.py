"""What a helmsman may ask of a helm, and when it does what he asks for."""

from math import inf, pi, tau
from typing import Any

from agents.export.heading_belief import HeadingBelief
from agents.export.next_leg import NextLeg, PlottedCourse
from agents.export.route import Route
from agents.export.sensors import HelmSensors, Limits
from shipgym import InputError
from shipgym.checks import check_number
from shipgym.tasks.guidance import wrapped

STANDBY, STEERING, MANUAL = "standby", "steering", "manual"


class HelmCommands:
    """Stand-by, steer, change of heading and next leg, of a `Helm`.

    Attributes
    ----------
    held : bool
        In stand-by because the helmsman wants it.
    has_steered : bool
    obstacle : str
        Why it cannot steer; empty if it can.
    well_since : float
        Time since which there has been no fault, s; inf with one.
    plotted : PlottedCourse
        Course of the chart plotter.
    question : NextLeg or None
        What the helmsman has to confirm.
    """

    pilot: Any
    limits: Limits
    sensors: HelmSensors
    belief: HeadingBelief
    heading: float | None
    rate: float | None
    route: Route | None
    follows_path: bool
    state: str
    alarm: str
    order: float
    now: float
    commanded: float | None

    def __init__(self) -> None:
        self.held = False
        self.has_steered = False
        self.obstacle = "no sensors"
        self.well_since = inf
        self.plotted = PlottedCourse()
        self.question: NextLeg | None = None

    def inputs(self, now: float) -> dict[str, float | None]:
        """Inputs of the autopilot by name; None for what is not known."""
        raise NotImplementedError

    def note_obstacle(self, fault: str) -> None:
        """Note why it cannot steer; after an alarm all has to be well for a while."""
        if fault:
            self.well_since = inf
        else:
            self.well_since = min(self.well_since, self.now)
        self.obstacle = fault
        well_s = self.now - self.well_since
        enough_s = 10.0  # in which each fault of a heading shows
        if self.state == MANUAL and not fault and well_s < enough_s:
            self.obstacle = f"all has to be well for {enough_s:g} s first"

    def follow_plotter(self, now: float) -> None:
        """Follow the plotter's course; close a question that was not answered."""
        if self._is_led_by_plotter:
            if self.state != STEERING:
                self.plotted.take()
            self.plotted.follow(self.plotters_course(now))
        if self.question is not None and not self.question.is_open(now):
            self.question = None

    def begin(self) -> None:
        """Steer from the rudder and, if it steers its own, the heading of now."""
        self.state = STEERING
        self.has_steered = True
        self.alarm = ""
        self.held = False
        self.sensors.expected = None
        rudder = self.inputs(self.now)["rudder"] or 0.0
        largest = self.pilot.largest
        self.order = min(max(rudder, -largest), largest)
        self.pilot.engage(rudder)
        self.belief = HeadingBelief(self.pilot.agent, self.limits)

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
        now. Raises InputError unless all is well, after an alarm for 10 s.
        """
        self.question = None
        if self.state == STEERING:
            return
        if self.obstacle:
            raise InputError(f"cannot steer: {self.obstacle}")
        has_own = self.heading is not None
        if has_own and self.has_steered:
            self.heading = self.sensors.value("heading", self.now)
        self.begin()

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

    @property
    def _is_led_by_plotter(self) -> bool:
        """True if the plotter's course is the set-point."""
        is_commanded = self.commanded is not None and not self.follows_path
        return self.heading is None and self.rate is None and not is_commanded

    def _next_course(self) -> float | None:
        """Direction of the next leg of the route or the plotter, rad; None if none."""
        if self.route is not None:
            return self.route.next_course()
        if self.rate is not None:
            return None
        if self._is_led_by_plotter:
            return self.plotted.waiting
        if self.heading is not None and self.commanded is not None:
            return self.commanded
        return self.plotters_course(self.now)

    def plotters_course(self, now: float) -> float | None:
        """Heading to steer by the plotter which was heard first, or its leg, rad."""
        for quantity in self.sensors.newest:
            if quantity in self.plotter_quantities:
                return self.sensors.value(quantity, now)
        return None

    @property
    def plotter_quantities(self) -> tuple[str, ...]:
        """Quantities of a plotter that may be the set-point."""
        return ("leg",) if self.follows_path else ("to_steer", "waypoint_bearing")
