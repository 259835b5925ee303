"""Other ships in a task: how they sail, how they are met, how they are drawn."""

from math import pi
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from shipgym import check_task, load_model
from shipgym.engine.motion import Motion
from shipgym.tasks import traffic
from shipgym.tasks.traffic import Target

ROOT = Path(__file__).parents[2]
FERRY = '''
"""A ferry who crosses ahead, by equations of her own."""
from typing import Annotated, NamedTuple

from shipgym.engine.motion import Motion
from shipgym.tasks.contract import ObservationSpec, Setting, at_service_speed
from shipgym.tasks.shapes import ChartWidth, Circle, ShipOutline
from shipgym.tasks.traffic import approach, rudder_to, target_of, vessel

ferry = vessel("mariner")
FERRY, AT_SPEED = ferry.ship, ferry.start


class Settings(NamedTuple):
    ahead: Annotated[float, Setting("Of own ship at the start, lengths.")] = 8.0


class State(NamedTuple):
    ferry: Motion


class Reward(NamedTuple):
    closeness: float


class Observation(NamedTuple):
    dcpa: Annotated[
        float, ObservationSpec(0, 9, "m", lambda ship, _: ship.length)
    ]


def begin(ship, settings, random, plan):
    ahead = settings.ahead * ship.length
    ferry = Motion(ahead, -ahead, 1.57, *AT_SPEED[3:])
    return at_service_speed(0.0, 0.0, 0.0, ship), State(ferry)


def step(motion, state, interval, ship, settings):
    rudder = rudder_to(state.ferry, 1.57, FERRY)
    after = ferry(state.ferry, rudder, AT_SPEED.n, interval.dt)
    near = approach(motion, target_of(after))
    return State(after), Reward(-ship.length / near.distance), False, False


def observe(readings, state, interval, ship, settings):
    return Observation(approach(readings, target_of(state.ferry)).dcpa)


def draw(motion, state, ship, settings):
    at = state.ferry.x, state.ferry.y
    outline = ShipOutline(*at, state.ferry.psi, ship.length, None, "danger")
    shapes = [ChartWidth(20 * ship.length), outline, Circle(*at, ship.length)]
    return shapes
'''
COURSE = "shipgym/CourseKeeping-v0"


def sailing(x, y, psi, u):
    return Motion(x, y, psi, u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def sail_until_the_end(env):
    env.reset(seed=0)
    over = False
    while not over:
        *_, over, _, _ = env.step(np.zeros(1, dtype=np.float32))


@pytest.mark.interpreted
def test_a_vessel_sails_as_the_model_is_simulated():
    mariner = load_model("mariner")
    sail = traffic.vessel(mariner, steps=1)
    motion, dt = sail.start, 1.0
    expected = mariner.simulate(np.full((50, 1), 0.2), dt)
    for _ in range(50):
        motion = sail(motion, 0.2, sail.start.n, dt)
    for name in ("x", "y", "psi", "u", "v", "r"):
        assert getattr(motion, name) == pytest.approx(expected[name][-1], rel=1e-9)


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("other", "dcpa", "tcpa", "kind"),
    [
        (Target(2000.0, 0.0, pi, 5.0), 0.0, 200.0, traffic.HEAD_ON),
        (Target(1000.0, 1000.0, -pi / 2, 5.0), 0.0, 200.0, traffic.GIVE_WAY),
        (Target(1000.0, -1000.0, pi / 2, 5.0), 0.0, 200.0, traffic.STAND_ON),
        (Target(500.0, 0.0, 0.0, 2.5), 0.0, 200.0, traffic.OVERTAKING),
        (Target(-500.0, 0.0, 0.0, 7.5), 0.0, 200.0, traffic.OVERTAKEN),
        (Target(-500.0, 0.0, 0.0, 2.5), 0.0, -200.0, traffic.CLEAR),
        (Target(2000.0, 800.0, pi, 5.0), 800.0, 200.0, traffic.CLEAR),
    ],
)
def test_encounters_by_the_rules(other, dcpa, tcpa, kind):
    """Own ship at 5 m/s northwards, at the origin."""
    near = traffic.approach(sailing(0.0, 0.0, 0.0, 5.0), other)
    assert near.dcpa == pytest.approx(dcpa, abs=1e-3)
    assert near.tcpa == pytest.approx(tcpa)
    assert traffic.encounter(near, 300.0, 600.0) == kind
    later = traffic.advance(other, tcpa)
    assert np.hypot(later.x - 5.0 * tcpa, later.y) == pytest.approx(dcpa, abs=1e-3)


def test_a_task_draws_what_it_wants_shown(tmp_path):
    path = tmp_path / "ferry.py"
    path.write_text(FERRY)
    plain = FERRY[: FERRY.index("def draw(")]
    (tmp_path / "plain.py").write_text(plain)
    pictures = []
    for name in ("ferry.py", "plain.py"):
        env = gymnasium.make(
            COURSE, task=tmp_path / name, dt=5.0, render_mode="rgb_array"
        )
        env.reset(seed=0)
        pictures.append(env.render())
    assert pictures[0].shape == (600, 600, 3)
    assert np.any(pictures[0] != pictures[1])
    many = gymnasium.make_vec(COURSE, 2, task=path, dt=5.0, render_mode="rgb_array")
    many.reset(seed=0)
    np.testing.assert_array_equal(many.render()[0], pictures[0])
    path.write_text(FERRY.replace("    return shapes\n", "    return [1.0]\n"))
    (problem,) = check_task(path, dt=5.0).problems
    assert "in draw: expected a list of Line, Circle" in problem
