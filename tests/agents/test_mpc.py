"""MPC: the path ahead as it sees it, symmetry, what the search is worth, its file."""

import json

import numpy as np
import pytest

from agents import LQ, MPC, PID, WheelOver, check_controller, load_agent
from agents.controllers.mpc import FAR, Ahead
from agents.rollouts.rollout import episode_costs
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.sea.conditions import Current, Weather
from shipgym.ships import load_model
from shipgym.tasks.task import path_following_task

MARINER = load_model("mariner")
LENGTH = MARINER.particulars["length"]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ship_on_the_arc_is_on_the_path_and_beyond_it_on_the_next_leg(side):
    turn, radius, begin = side * np.radians(60.0), 300.0, 100.0
    ahead = Ahead(
        [np.array([begin]), np.array([turn]), np.array([900.0]), np.array([-turn])],
        radius,
        0.0,
    )
    swept = np.radians(np.array([10.0, 45.0]))
    for angle in swept:
        x, y = begin + radius * np.sin(angle), side * radius * (1.0 - np.cos(angle))
        place = ahead.fix(np.array([x]), np.array([y]))
        assert place.way[0] == pytest.approx(begin + radius * angle)
        assert place.cross[0] == pytest.approx(0.0, abs=1e-9)
        assert place.course[0] == pytest.approx(side * angle)
        assert place.turns[1][0] == pytest.approx(turn - side * angle)
    further = 50.0  # on the next leg, 7 m to starboard of it
    end = begin + radius * np.sin(abs(turn)), side * radius * (1.0 - np.cos(turn))
    x = end[0] + further * np.cos(turn) - 7.0 * np.sin(turn)
    y = end[1] + further * np.sin(turn) + 7.0 * np.cos(turn)
    place = ahead.fix(np.array([x]), np.array([y]))
    assert (place.way[0], place.cross[0]) == pytest.approx(
        (begin + radius * abs(turn) + further, 7.0)
    )
    assert place.turns[0][0] == FAR


def test_a_corner_is_passed_within_the_acceptance_radius_and_way_counts_abeam_of_it():
    ahead = Ahead([np.array([500.0]), np.array([np.pi / 2.0])], 0.0, 200.0)
    before, after = (ahead.fix(np.array([x]), np.array([10.0])) for x in (299.0, 301.0))
    assert (before.cross[0], before.turns[1][0]) == pytest.approx((10.0, np.pi / 2.0))
    assert (after.cross[0], after.way[0], after.turns[1][0]) == pytest.approx(
        (199.0, 510.0, 0.0)
    )


def mirrored(observation):
    names = {
        "heading_error_sin",
        "yaw_rate",
        "sway",
        "rudder",
        "last_command",
        "heading_error_integral",
    }
    names |= {"cross_track", "course_error_sin", "turn_angle"}
    sign = [-1.0 if name in names else 1.0 for name in MPC.observes]
    return observation * np.array(sign)


def test_to_port_it_does_what_it_does_to_starboard():
    guide = MPC.from_model(load_model("mariner-nomoto"), horizon_lengths=4.0)
    rng = np.random.default_rng(1)
    seen = rng.uniform(-0.3, 0.3, (5, 13))
    seen[:, 4], seen[:, 1], seen[:, 10] = 1.0, 0.95, 0.95
    seen[:, 11] = np.abs(seen[:, 11])
    (one, _), (other, _) = (guide.predict(shown) for shown in (seen, mirrored(seen)))
    assert other == pytest.approx(-one, abs=1e-5)


def test_in_a_current_its_search_is_worth_something_though_it_is_told_of_none():
    task = path_following_task(
        sea=Weather(current=Current(1.5)), max_turn_deg=90.0, episode_steps=600
    )
    engine, seeds = Engine(MARINER, 8, task), np.arange(8)
    searched = MPC.from_model(MARINER, task=task, horizon_lengths=8.0)
    plain, better = (
        episode_costs(one, engine, seeds).mean()
        for one in (WheelOver.from_model(MARINER, task=task), searched)
    )
    assert better < 0.99 * plain


def test_it_is_a_controller_and_a_file_with_its_design_model(tmp_path):
    task = path_following_task()
    guide = MPC.from_model(MARINER, task=task, horizon_lengths=2.0)
    check_controller(guide, MARINER, task, n_steps=23)
    guide.save(tmp_path / "guide.json")
    again = load_agent(tmp_path / "guide.json", MARINER)
    assert again.ship.to_dict() == MARINER.to_dict()
    assert again.to_dict() == guide.to_dict()
    content = json.loads((tmp_path / "guide.json").read_text())
    content["ship"]["coefficients"] = {}
    (tmp_path / "guide.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"guide.json: ship: "):
        load_agent(tmp_path / "guide.json")


def test_it_simulates_lq_and_no_other_autopilot():
    with pytest.raises(InputError, match="autopilot: PID found, expected LQ"):
        MPC.from_model(MARINER, autopilot=PID.from_model(MARINER))
    assert isinstance(MPC.from_model(MARINER).autopilot, LQ)


def test_it_looks_one_step_of_two_intervals_ahead_at_least():
    design = MPC.from_model(MARINER, horizon_lengths=0.01).design
    assert design["horizon_steps"] == 1.0
    longer = MPC.from_model(MARINER, horizon_lengths=3.0).design
    time = 3.0 * LENGTH / MARINER.particulars["speed"]
    assert longer["horizon_steps"] == round(time / (2.0 * longer["dt"]))


def test_far_inside_of_an_arc_the_way_stays_finite_and_forward():
    """A ship beyond the middle of the circle, from where every direction would be the arc's."""
    ahead = Ahead(
        [np.array([100.0]), np.array([1.0]), np.array([9e3]), np.array([0.5])],
        300.0,
        0.0,
    )
    ways = [
        ahead.fix(np.array([x]), np.array([320.0])).way[0] for x in (90.0, 102.0, 110.0)
    ]
    assert ways == pytest.approx(
        [90.0, 100.0 + 300.0 * np.arctan(2 / 30), 100.0 + 300.0 * np.arctan(1 / 3)]
    )
