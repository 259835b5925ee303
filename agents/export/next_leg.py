"""The next leg, which a helmsman confirms before the ship turns to it."""

from math import degrees, radians
from typing import NamedTuple

from shipgym.tasks.guidance import wrapped


class NextLeg(NamedTuple):
    """A leg that the helmsman has been asked to confirm."""

    course: float  # rad
    turn: float  # rad, from the course now, positive to starboard
    asked_at: float  # s

    def is_open(self, now: float) -> bool:
        """True while a confirmation counts."""
        longest_s = 15.0
        return now - self.asked_at <= longest_s

    def __str__(self) -> str:
        side = "starboard" if self.turn >= 0.0 else "port"
        course = degrees(self.course) % 360.0
        turn = abs(degrees(self.turn))
        return f"next leg {course:05.1f}°, {turn:.0f}° to {side}"


class PlottedCourse:
    """Course of a chart plotter, and the one that a helmsman has confirmed.

    With a helmsman on watch the ship keeps her course when the plotter's jumps, as at a
    waypoint, until he confirms the new one; without, it is followed at once.

    Attributes
    ----------
    attended : bool
        True if a helmsman can confirm.
    waiting : float or None
        Course that waits for him, rad.
    """

    #: Change of the plotter's course that is a new leg, rad.
    new_leg = radians(10.0)

    def __init__(self) -> None:
        self.attended = False
        self.followed: float | None = None
        self.waiting: float | None = None

    def follow(self, course: float | None) -> None:
        """Take in the plotter's course now, rad; None if it is silent."""
        if course is None:
            return
        is_new_leg = self.steered(course) != course
        self.waiting = course if is_new_leg else None
        if not is_new_leg:
            self.followed = course

    def steered(self, course: float | None) -> float | None:
        """Course to steer while the plotter gives this one, rad."""
        followed = self.followed
        if course is None or followed is None or not self.attended:
            return course
        change = abs(wrapped(course - followed))
        return followed if change > self.new_leg else course

    def take(self) -> None:
        """Steer whatever course the plotter gives next."""
        self.followed = None
        self.waiting = None
