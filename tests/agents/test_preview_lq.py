"""LQ path tracking with preview: the path is read ahead, averaged, and turned with."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents import LQ, PID, PreviewLQ, WheelOver, check_controller, load_agent
from agents.controllers.preview_lq import weighed_turn
from agents.rollouts.rollout import episode_costs
from agents.training.controller_search import side_by_side
from shipgym import load_model
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.sea import Current, Weather
from shipgym.tasks import path_following_task
from tests.agents.mariners import MARINER

PATH = path_following_task(max_turn_deg=90.0, leg_lengths=[12.0, 16.0])


DESIGNED = PreviewLQ.from_model(MARINER, task=PATH)


@given(st.floats(0.0, 2000.0), st.floats(-1.5, 1.5))
def test_as_designed_it_reads_the_mean_course_about_one_lead_ahead(distance, angle):
    p = DESIGNED.parameters
    points = np.linspace(0.1 * p.reach, 0.3 * p.reach, 8001)
    size = np.clip((points - distance) / p.path_radius, 0.0, abs(angle))
    mean = np.sign(angle) * np.mean(size)
    assert weighed_turn(distance, angle, 1.0, p) == pytest.approx(mean, abs=1e-3)


def test_in_a_current_it_costs_less_than_wheel_over():
    """The angle against the current is that for the course behind the turn."""
    seeds = np.arange(8)
    task = path_following_task(
        max_turn_deg=90.0, leg_lengths=[12.0, 16.0], sea=Weather(Current(1.5))
    )
    engine = Engine(MARINER, 8, task)
    wheel_over = WheelOver.from_model(MARINER, task=PATH)
    costs, theirs = (
        episode_costs(guide, engine, seeds).mean() for guide in (DESIGNED, wheel_over)
    )
    assert costs < 0.95 * theirs
    assert episode_costs(blind(DESIGNED), engine, seeds).mean() > 1.1 * costs


def blind(guide):
    """The same without an eye for the current."""
    return replace(guide, gains={**guide.gains, "crab_share": 0.0})


def test_designs_side_by_side_steer_as_each_alone():
    designs = [
        PreviewLQ.from_model(MARINER, task=PATH, reach_lengths=4.0, yaw_time=0.1),
        PreviewLQ.from_model(
            MARINER,
            task=PATH,
            autopilot=LQ.from_model(MARINER, rudder_weight=0.5),
            weight_3=-0.1,
            weight_4=-0.05,
            reach_power=0.5,
            sway_gain=0.3,
            current_time=0.2,
            dead_band_deg=0.5,
            speed_power=1.0,
        ),
    ]
    together = episode_costs(
        side_by_side(designs, 3), Engine(MARINER, 6, PATH), np.tile(np.arange(3), 2)
    )
    alone = [
        episode_costs(one, Engine(MARINER, 3, PATH), np.arange(3)) for one in designs
    ]
    np.testing.assert_array_equal(together, np.concatenate(alone))


def test_it_is_a_controller_and_a_file(tmp_path):
    quiet = LQ.from_model(MARINER, rudder_time=0.1, rudder_band_deg=0.5)
    guide = PreviewLQ.from_model(
        MARINER, task=PATH, autopilot=quiet, weight_3=-0.1, dead_band_deg=0.2
    )
    check_controller(guide, MARINER, PATH, n_steps=20)
    guide.save(tmp_path / "guide.json")
    again = load_agent(tmp_path / "guide.json", MARINER)
    assert (again.kind, again.gains) == ("preview-lq", guide.gains)


def test_heel_turns_the_rudder_where_a_task_shows_it(tmp_path):
    ship = load_model("container")
    task = path_following_task(roll=True)
    guide = PreviewLQ.from_model(ship, task=task, roll_gain=0.5, roll_time=0.1)
    guide.save(tmp_path / "guide.json")
    again = load_agent(tmp_path / "guide.json", ship)
    level = np.zeros((1, len(again.observation_names)))
    level[0, [1, 4]] = 1.0  # on course at service speed
    heeled = level.copy()
    heeled[0, again.observation_names.index("roll")] = 0.5
    assert again.predict(heeled)[0] != again.predict(level)[0]
    assert "roll" not in PreviewLQ.from_model(ship).observation_names


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lookahead_lengths", 0.0),
        ("reach_lengths", 0.0),
        ("weight_0", np.nan),
        ("crab_share", 3.0),
        ("current_time", -1.0),
    ],
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=f"^{name}: .*expected a number"):
        PreviewLQ.from_model(MARINER, **{name: value})


def test_it_leads_lq_alone():
    with pytest.raises(InputError, match=r"^autopilot: expected LQ, got PID"):
        PreviewLQ.from_model(MARINER, autopilot=PID.from_model(MARINER))
