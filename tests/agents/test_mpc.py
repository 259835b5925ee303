"""MPC: the path ahead as it sees it, symmetry, what the search is worth, its file."""

import json

import numpy as np
import pytest

from agents import MPC, WheelOver, check_controller, load_agent
from agents.controllers.law import Turns
from agents.controllers.path_ahead import FAR, PathAhead
from agents.rollouts.rollout import episode_costs
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.sea import Current, Weather
from shipgym.tasks.task import path_following_task
from tests.agents.mariners import MARINER


def turns(*numbers):
    """Two turns of one ship."""
    return Turns(*(np.array([one]) for one in numbers))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_ship_on_the_arc_is_on_the_path_and_beyond_it_on_the_next_leg(side):
    turn, radius, begin = side * np.radians(60.0), 300.0, 100.0
    ahead = PathAhead(turns(begin, turn, 900.0, -turn), radius)
    for swept in np.radians([10.0, 45.0]):
        x, y = begin + radius * np.sin(swept), side * radius * (1.0 - np.cos(swept))
        place = ahead.fix(np.array([x]), np.array([y]))
        assert place.along_track[0] == pytest.approx(begin + radius * swept)
        assert place.cross_track[0] == pytest.approx(0.0, abs=1e-9)
        assert place.course[0] == pytest.approx(side * swept)
        assert place.turns.next_angle[0] == pytest.approx(turn - side * swept)

    further, aside = 50.0, 7.0  # on the next leg, and to starboard of it
    end = begin + radius * np.sin(abs(turn)), side * radius * (1.0 - np.cos(turn))
    x = end[0] + further * np.cos(turn) - aside * np.sin(turn)
    y = end[1] + further * np.sin(turn) + aside * np.cos(turn)
    place = ahead.fix(np.array([x]), np.array([y]))
    along = begin + radius * abs(turn) + further
    assert (place.along_track[0], place.cross_track[0]) == pytest.approx((along, aside))
    assert place.turns.next_distance[0] == FAR


def mirrored(observation):
    """The same to the other side."""
    odd = {
        "heading_error_sin",
        "yaw_rate",
        "sway",
        "rudder",
        "last_command",
        "heading_error_integral",
        "cross_track",
        "course_error_sin",
        "next_turn_angle",
        "second_turn_angle",
    }
    return observation * np.array(
        [-1.0 if name in odd else 1.0 for name in MPC.observes]
    )


def test_to_port_it_does_what_it_does_to_starboard():
    guide = MPC.from_model(load_model("mariner-nomoto"), horizon_lengths=4.0)
    seen = np.random.default_rng(1).uniform(-0.3, 0.3, (5, len(MPC.observes)))
    for name in ("heading_error_cos", "surge", "course_error_cos"):
        seen[:, MPC.observes.index(name)] = 0.95
    for name in ("next_turn_distance", "second_turn_distance"):
        column = MPC.observes.index(name)
        seen[:, column] = np.abs(seen[:, column])
    one, _ = guide.predict(seen)
    other, _ = guide.predict(mirrored(seen))
    assert other == pytest.approx(-one, abs=1e-5)


def test_in_a_current_its_search_is_worth_something_though_it_is_told_of_none():
    task = path_following_task(
        sea=Weather(current=Current(1.5)),
        max_turn_deg=90.0,
        leg_lengths=[12.0, 16.0],
        episode_steps=600,
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
    with pytest.raises(InputError, match=r"guide\.json: ship: "):
        load_agent(tmp_path / "guide.json")
