"""MPC: symmetry, what the search is worth, its file."""

import json

import numpy as np
import pytest

from agents import MPC, WheelOver, check_controller, load_agent
from agents.controllers.law import Turns
from agents.controllers.path_ahead import PathAhead
from agents.rollouts.rollout import episode_costs
from shipgym.envs.engine import Engine
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.sea import Current, Weather
from shipgym.tasks import path_following_task
from tests.agents.mariners import MARINER


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


@pytest.mark.parametrize("degrees", [60.0, 90.0, 120.0])
def test_arcs_end_after_their_angle_also_beyond_a_right_angle(degrees):
    radius, angle = 100.0, np.radians(degrees)
    one, other = np.ones(1), np.zeros(1)
    path = PathAhead(Turns(50.0 * one, angle * one, other, other), radius)
    for swept in np.linspace(0.0, angle, 20):
        x, y = 50.0 + radius * np.sin(swept), radius * (1.0 - np.cos(swept))
        place = path.fix(x * one, y * one)
        assert place.course == pytest.approx([swept], abs=1e-9)
        assert place.cross_track == pytest.approx([0.0], abs=1e-9)
    x, y = x + 70.0 * np.cos(angle), y + 70.0 * np.sin(angle)
    place = path.fix(x * one, y * one)
    assert place.course == pytest.approx([angle])
    assert place.along_track == pytest.approx([50.0 + radius * angle + 70.0])


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
