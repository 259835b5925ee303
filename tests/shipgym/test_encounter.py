"""Encounters: who meets whom, and how the others sail."""

from math import pi

import gymnasium
import numpy as np
import pytest

from shipgym import load_model
from shipgym.engine.motion import Motion
from shipgym.ships.manoeuvring_model import ship_of
from shipgym.tasks import other_ships
from shipgym.tasks.other_ships import IMAZU, Habits, Other, Place
from shipgym.tasks.traffic import Target, approach

pytestmark = pytest.mark.interpreted

ID = "shipgym/Encounter-v0"
SHIP = ship_of(load_model("container-two-zigzags"), float("inf"))
L, U = SHIP.length, SHIP.speed


def sailing(x, y, psi=0.0, u=U):
    return Motion(x, y, psi, u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def another(x, y, psi, answer=1.0):
    return Other(Place(x, y, psi, 0.0), Habits(U, L, psi, answer, 12.0 * L / U), 0.0)


def looked_at(env, seed):
    """Distances, closest distances and times of the others at the start, lengths."""
    seen, _ = env.reset(seed=seed)
    names = env.unwrapped.observation_names
    shown = []
    for name in ("distance", "dcpa", "tcpa"):
        places = [names.index(f"others_{number}_{name}") for number in range(4)]
        shown.append(10.0 * seen[places])
    return shown


def test_the_others_of_a_case_of_imazu_meet_who_keeps_her_course():
    assert IMAZU.shape == (22, 3)
    assert np.isfinite(IMAZU).sum(axis=1).tolist() == [1] * 4 + [2] * 7 + [3] * 11
    for case in range(1, 23):
        env = gymnasium.make(ID, case=case)
        distance, dcpa, tcpa = looked_at(env, seed=case)
        present = distance < 60.0
        assert present.sum() == np.isfinite(IMAZU[case - 1]).sum()
        assert dcpa[present].max() < 1.01
        assert tcpa[present].min() > 10.0


def test_one_to_four_others_begin_at_a_distance_in_the_order_of_their_times():
    env = gymnasium.make(ID)
    counts = []
    for seed in range(100):
        distance, _, tcpa = looked_at(env, seed=seed)
        present = distance < 60.0
        counts.append(present.sum())
        assert distance.min() > 4.99
        assert np.all(np.diff(tcpa[present]) >= 0.0)
    assert set(counts) == {1, 2, 3, 4}


@pytest.mark.parametrize(("answer", "side"), [(1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)])
def test_another_ship_gives_way_to_starboard_to_port_or_not(answer, side):
    """She has own ship to starboard; she turns by 40 degrees, and comes back."""
    own, other = sailing(-10.0 * L, 0.0), another(0.0, -10.0 * L, pi / 2, answer)
    courses = []
    for second in range(0, 600, 5):
        at = own._replace(x=own.x + U * second)
        other = other_ships.sailed(other, 5.0)
        near = approach(at, other_ships.target(other))
        other = other_ships.decided(other, near, SHIP)
        courses.append(other.place.psi - pi / 2)
    furthest = max(courses, key=abs)
    assert furthest == pytest.approx(0.7 * side, abs=0.1)
    assert courses[-1] == pytest.approx(0.0, abs=0.02)


def test_another_ship_turns_as_nomoto_says():
    """At rudder hard over: K delta, in lengths and the time of one."""
    other = another(0.0, 0.0, 0.0)
    other = other._replace(habits=other.habits._replace(course=3.0))
    for _ in range(8):
        other = other_ships.sailed(other, 5.0)
    time = L / U
    expected = 0.6 / time * (1.0 - (1.5 * time / (1.5 * time + 5.0)) ** 8)
    assert other.place.r == pytest.approx(expected)


def test_the_ellipse_is_longer_ahead_of_her_than_abeam_and_astern():
    def inside(x, y):
        near = approach(sailing(x * L, y * L), Target(0.0, 0.0, 0.0, U))
        return other_ships.in_her_way(near, 6.4 * L, 3.2 * L)

    assert inside(0.01, 0.0) == pytest.approx(1.0, abs=1e-4)
    assert inside(6.3, 0.0) > 0.0
    assert inside(6.5, 0.0) == 0.0
    for place in ((0.0, 3.3), (0.0, -3.3), (-3.3, 0.0)):
        assert inside(*place) == 0.0
    assert inside(3.2, 0.0) == pytest.approx(0.75**2)
    assert inside(0.0, 1.6) == pytest.approx(inside(-1.6, 0.0))
