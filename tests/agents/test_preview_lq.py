"""LQ path tracking with preview: the path is read ahead, averaged, and turned with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents import LQ, PID, PreviewLQ, WheelOver, check_controller, load_agent
from agents.controllers.law import PathSignals, Turns
from agents.controllers.own_path import Radii, TurnMemory, own_path
from agents.controllers.preview_lq import PreviewMemory, summed_turn, turned_by
from agents.controllers.quiet_lq import QuietLQ
from agents.controllers.side_by_side import side_by_side
from agents.rollouts.rollout import episode_costs
from shipgym import load_model
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.tasks.task import course_keeping_task, path_following_task
from tests.agents.mariners import MARINER

PATH = path_following_task(max_turn_deg=90.0, leg_lengths=[12.0, 16.0])

#: Two legs whose arcs of 4 ship lengths leave no straight between turns of 60 degrees.
S_BEND = np.array(
    [[0.0, 0.0], [10.0, 0.0], [10.0 + 4.62 * 0.5, 4.62 * np.sqrt(0.75)]],
)

metres = st.floats(0.0, 3000.0)
angles = st.floats(-1.5, 1.5)


@given(metres, metres, angles, metres, angles, st.floats(200.0, 900.0))
def test_the_mean_course_is_the_integral_of_the_course(
    distance, first, first_angle, second, second_angle, radius
):
    turns = Turns(first, first_angle, first + second, second_angle)
    nothing = TurnMemory(0.0, 0.0, 0.0, 0.0, 0.0)
    path = own_path(turns, nothing, Radii(planned=radius, own=radius))
    points = np.linspace(0.0, distance, 4001)
    courses = turned_by(points, path, radius)
    summed = summed_turn(distance, path, radius)
    assert summed == pytest.approx(np.trapezoid(courses, points), abs=1e-3 * 3000.0)


def test_with_nothing_added_it_is_wheel_over():
    narrow = PreviewLQ.from_model(MARINER, task=PATH, window_lengths=1e-4)
    seeds = np.arange(4)
    engine = Engine(MARINER, 4, PATH)
    ours, wheel_over = (
        episode_costs(guide, engine, seeds)
        for guide in (narrow, WheelOver.from_model(MARINER, task=PATH))
    )
    np.testing.assert_allclose(ours, wheel_over, rtol=1e-3)


@pytest.mark.parametrize(
    ("kind", "wider"),
    [(WheelOver, {}), (PreviewLQ, {}), (PreviewLQ, {"arc_factor": 1.5})],
)
def test_a_turn_is_begun_at_the_reach(kind, wider):
    guide = kind.from_model(MARINER, task=PATH, **wider)
    speed = MARINER.particulars["speed"]

    def course(distance):
        turns = Turns(distance, 0.5, 2.0 * distance, 0.0)
        numbers = dict.fromkeys(PathSignals._fields, 0.0) | {"surge": speed}
        seen = PathSignals(**numbers | {"turns": turns})
        nothing = PreviewMemory(0.0, 0.0, TurnMemory(0.0, 0.0, 0.0, 0.0, 0.0))
        return guide.course(seen, nothing)[0]

    reach = guide.turn_reach(0.5)
    assert course(reach + 1.0) == pytest.approx(0.0, abs=1e-9)
    assert course(reach - 10.0) > 1e-5


def test_designs_side_by_side_steer_as_each_alone():
    designs = [
        PreviewLQ.from_model(MARINER, task=PATH, window_lengths=1.0, yaw_time=0.1),
        PreviewLQ.from_model(
            MARINER,
            task=PATH,
            autopilot=LQ.from_model(MARINER, rudder_weight=0.5),
            arc_factor=1.5,
            lead_power=0.5,
            inside_lengths=0.3,
            feed_forward_lengths=0.2,
            crab_time=0.2,
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
    quiet = QuietLQ.from_model(MARINER, rudder_time=0.1, rudder_band_deg=0.5)
    guide = PreviewLQ.from_model(
        MARINER, task=PATH, autopilot=quiet, arc_factor=1.3, dead_band_deg=0.2
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
        ("lead_lengths", 0.0),
        ("window_lengths", 0.0),
        ("inside_lengths", np.nan),
        ("crab_share", 3.0),
        ("crab_time", -1.0),
        ("dead_band_deg", 200.0),
        ("speed_power", 9.0),
        ("lead_power", np.inf),
        ("arc_factor", 0.5),
        ("roll_gain", 200.0),
        ("roll_time", np.nan),
    ],
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=f"^{name}: .*expected a number"):
        PreviewLQ.from_model(MARINER, **{name: value})


@pytest.mark.parametrize("angle_deg", [-60.0, -45.0, 60.0])
def test_a_turn_at_once_after_another_costs_about_what_wheel_over_costs(angle_deg):
    legs = S_BEND * MARINER.particulars["length"]
    angle = np.radians(angle_deg)
    course = np.radians(60.0) + angle
    end = legs[-1] + 2000.0 * np.array([np.cos(course), np.sin(course)])
    task = path_following_task(waypoints=np.vstack([legs, end]))
    seeds = np.arange(4)
    engine = Engine(MARINER, 4, task)
    costs = [
        episode_costs(guide.from_model(MARINER, task=task), engine, seeds).mean()
        for guide in (PreviewLQ, WheelOver)
    ]
    assert costs[0] < 1.5 * costs[1]


@pytest.mark.parametrize("error_deg", [20.0, 60.0, 100.0])
def test_a_gain_by_speed_never_turns_the_rudder_to_the_other_side(error_deg):
    guide = PreviewLQ.from_model(MARINER, speed_power=4.0)
    seen = np.zeros((1, len(guide.observation_names)))
    error = np.radians(error_deg)
    seen[0, :2] = np.sin(error), np.cos(error)
    of_course = guide.observation_names.index("course_error_sin")
    seen[0, of_course : of_course + 2] = seen[0, :2]  # no current
    seen[0, guide.observation_names.index("surge")] = 0.3
    assert guide.predict(seen)[0] == 1.0


@pytest.mark.parametrize("guide", [PreviewLQ, WheelOver])
def test_a_task_without_a_path_is_refused(guide):
    with pytest.raises(InputError, match=r"^task: expected one with a path, got"):
        guide.from_model(MARINER, task=course_keeping_task())


def test_gains_on_heel_need_a_task_that_shows_it():
    with pytest.raises(InputError, match=r"^roll_gain, roll_time: expected 0"):
        PreviewLQ.from_model(MARINER, roll_gain=0.1)


def test_it_leads_lq_alone():
    with pytest.raises(InputError, match=r"^autopilot: expected LQ, got PID"):
        PreviewLQ.from_model(MARINER, autopilot=PID.from_model(MARINER))
