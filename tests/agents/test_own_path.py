"""Own path of wider arcs, tangent to the legs of the planned one."""

import numpy as np
import pytest

from agents.controllers.law import Turns
from agents.controllers.own_path import Radii, TurnMemory, own_path, remembered
from agents.controllers.path_ahead import PathAhead

LEG = 3000.0  # m before the turn
NONE = np.zeros(1)


@pytest.mark.parametrize("angle_deg", [-75.0, -40.0, 25.0, 80.0])
@pytest.mark.parametrize("radii", [Radii(500.0, 900.0), Radii(400.0, 400.0)])
def test_a_ship_on_the_wider_arc_is_on_her_own_path(angle_deg, radii):
    """Before, on and behind the planned arc, by the geometry of circles."""
    angle = np.radians(angle_deg)
    step = 5.0
    memory = TurnMemory(NONE, NONE, NONE, NONE, NONE)
    route = PathAhead(turns=one_turn(LEG, angle), radius=radii.planned)
    for x, y, course in wider_arc(angle, radii, step):
        place = route.fix(np.array([x]), np.array([y]))
        memory = remembered(place.turns, memory, np.array([step]), radii.planned)
        path = own_path(place.turns, memory, radii)
        aside = path.leaving.aside + path.first.aside
        direction = place.course + path.leaving.course + path.first.course
        assert aside == pytest.approx(place.cross_track, abs=step)
        assert direction == pytest.approx([course], abs=0.04)


def one_turn(distance, angle):
    """Turns of a path with one."""
    return Turns(np.array([distance]), np.array([angle]), np.array([1e9]), NONE)


def wider_arc(angle, radii, step):
    """Points and courses of a ship along the wider arc, from the leg before."""
    size, side = abs(angle), np.sign(angle)
    earlier = (radii.own - radii.planned) * np.tan(0.5 * size)
    begins = LEG - earlier
    for along in np.arange(begins - 50.0, begins, step):
        yield along, 0.0, 0.0
    for swept in np.arange(0.0, size, step / radii.own):
        across = radii.own * (1.0 - np.cos(swept))
        yield begins + radii.own * np.sin(swept), side * across, side * swept
    end_x = begins + radii.own * np.sin(size)
    end_y = radii.own * (1.0 - np.cos(size))
    for along in np.arange(0.0, 50.0, step):
        x = end_x + along * np.cos(size)
        yield x, side * (end_y + along * np.sin(size)), angle


def test_a_turn_to_the_other_side_at_once_is_another_turn():
    """Without a straight between, what was left of the first is none of the second."""
    memory = TurnMemory(whole=1.05, left=0.02, on_arc=1.0, last=0.0, behind=0.0)
    port = Turns(0.0, -0.78, 1e4, 0.0)
    after = remembered(port, memory, 8.0, radius=640.0)
    assert (after.whole, after.last, after.behind) == (-0.78, 1.05, 0.0)
    first = own_path(port, after, Radii(640.0, 640.0)).first
    assert first.angle == pytest.approx(-0.78)


def test_an_equal_turn_close_behind_is_another_turn():
    memory = TurnMemory(whole=0.6, left=0.01, on_arc=1.0, last=0.0, behind=0.0)
    after = remembered(Turns(100.0, 0.6, 1e4, 0.0), memory, 8.0, radius=640.0)
    assert (after.whole, after.last, after.on_arc) == (0.6, 0.6, 0.0)


def test_a_turn_stays_the_same_in_noise():
    memory = TurnMemory(whole=0.6, left=0.6, on_arc=0.0, last=0.0, behind=9e9)
    for distance, left in ((0.0, 0.58), (3.0, 0.6), (0.0, 0.55), (0.0, 0.57)):
        memory = remembered(Turns(distance, left, 1e4, 0.0), memory, 8.0, radius=640.0)
        assert (memory.whole, memory.last) == (0.6, 0.0)
