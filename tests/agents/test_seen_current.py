"""The current that a ship sees along legs and arcs, against the one that there is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.controllers.law import PathSignals
from agents.controllers.path_ahead import PathAhead, Turns
from agents.controllers.seen_current import CurrentMemory, CurrentScales, seen_current

RADIUS, LEG, INTERVAL, SPEED = 500.0, 900.0, 5.0, 8.0
AT_ONCE = CurrentScales(
    update=1.0,
    path_radius=RADIUS,
    sight=3000.0,
    interval=INTERVAL,
    slowest=0.2 * SPEED,
    fastest=2.0 * SPEED,
)
NOTHING = CurrentMemory(*np.zeros((len(CurrentMemory._fields), 1)))


class Drifting:
    """A ship whose way over ground is along a path with one turn, in a current."""

    def __init__(self, angle, current, sway=0.0):
        turns = Turns(np.array([LEG]), np.array([angle]), np.array([1e9]), np.zeros(1))
        self.route = PathAhead(turns=turns, radius=RADIUS)
        self.current, self.sway = current, sway
        self.position = np.zeros(2)
        self.heading = 0.0

    def sailed(self, n_steps):
        """Signals of the path and the direction of the path, interval by interval."""
        for _ in range(n_steps):
            place = self.route.fix(*self.position[:, None])
            course = float(place.course[0])
            over_ground = SPEED * np.array([np.cos(course), np.sin(course)])
            north, east = over_ground - self.current
            heading = np.arctan2(east, north) - np.arcsin(
                self.sway / np.hypot(north, east)
            )
            cosine, sine = np.cos(heading), np.sin(heading)
            zeros = dict.fromkeys(PathSignals._fields, np.zeros(1))
            signals = PathSignals(
                **zeros
                | {
                    "heading_error": np.array([course - heading]),
                    "drift": np.array([course - heading]),
                    "surge": np.array([north * cosine + east * sine]),
                    "sway": np.array([east * cosine - north * sine]),
                    "cross_track": place.cross_track,
                    "turns": place.turns,
                }
            )
            yield signals, course
            self.position = self.position + INTERVAL * over_ground


def in_axes(current, course):
    """Current ahead and to starboard of a course."""
    north, east = current
    cosine, sine = np.cos(course), np.sin(course)
    return north * cosine + east * sine, east * cosine - north * sine


@given(
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.sampled_from([-1.4, -0.6, 0.5, 1.2]),
    st.floats(-0.5, 0.5),
)
def test_it_is_the_current_on_legs_and_on_arcs(north, east, angle, sway):
    current = np.array([north, east])
    memory = NOTHING
    for number, (seen, course) in enumerate(Drifting(angle, current, sway).sailed(55)):
        memory = seen_current(seen, memory, AT_ONCE)
        if number == 0:
            continue  # no speed over ground yet
        ahead, aside = in_axes(current, course)
        assert memory.ahead == pytest.approx(ahead, abs=0.3)
        assert memory.aside == pytest.approx(aside, abs=0.1)
    assert abs(course) == pytest.approx(abs(angle), abs=0.1)  # the turn was sailed


def test_on_the_last_leg_the_end_of_the_path_comes_closer():
    current = np.array([1.0, 0.5])
    memory = NOTHING
    for seen, _ in Drifting(0.0, current).sailed(20):
        memory = seen_current(seen, memory, AT_ONCE)
    assert (memory.ahead, memory.aside) == pytest.approx((1.0, 0.5), abs=0.01)
