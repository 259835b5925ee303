"""MPC: symmetry, what the search is worth, its file."""

import json

import numpy as np
import pytest

from agents import MPC, WheelOver, check_controller, load_agent
from agents.controllers.law import Turns
from agents.controllers.mpc import BodyCurrent, DesignModels
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
def test_a_ship_that_sails_the_path_is_on_it_beyond_a_right_angle_too(degrees):
    """An arc ends after its angle; beside it the way along is shorter inside."""
    guide = MPC.from_model(MARINER)
    radius, angle, step = guide.gains["path_radius"], np.radians(degrees), 10.0
    seen = guide.path_signals(np.zeros((3, len(guide.observation_names))))
    one, zero = np.ones(3), np.zeros(3)
    aside = np.array([0.0, 100.0, -100.0])
    seen = seen._replace(
        cross_track=aside,
        heading_error=zero,
        turns=Turns(50.0 * one, angle * one, 1e6 * one, zero),
    )
    models = DesignModels(guide, seen, BodyCurrent(zero, zero))
    length = 50.0 + radius * angle + 200.0
    for along in np.arange(0.0, length, step):
        heading = np.clip((along + 0.5 * step - 50.0) / radius, 0.0, angle)
        is_bent = 0.0 < heading < angle
        way = step * (1.0 - is_bent * aside / radius)
        models.move(way * np.cos(heading), way * np.sin(heading))
    assert models.cross_track == pytest.approx(aside, abs=1.0)
    assert models.along == pytest.approx(along + step, abs=3.0)
    assert models.path_course(0.0) == pytest.approx(angle)


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
