"""Wheel-over: a path's arcs are seen ahead, and a current is countered."""

import numpy as np
import pytest

from agents import LQ, IntegralLineOfSight, WheelOver, check_controller, load_agent
from agents.controllers.wheel_over import own_lead
from agents.rollouts.rollout import episode_costs
from shipgym.envs.engine import Engine
from shipgym.models.linear import straight_running
from shipgym.sea import Current, Weather
from shipgym.tasks import path_following_task
from tests.agents.mariners import MARINER

LENGTH, SPEED = MARINER.particulars["length"], MARINER.particulars["speed"]


def test_an_arc_is_seen_ahead_by_the_lag_and_a_quarter_of_a_length():
    """In a turn with a twentieth of a degree of rudder heading and way lag by that."""
    pilot, neutral = LQ.from_model(MARINER), straight_running(MARINER)
    side, turns = np.radians(0.05), []
    for rudder in (side, -side):
        orders = np.full((1500, 1), neutral.rudder + rudder)
        turn = MARINER.simulate(orders, 1.0, neutral.state(MARINER))
        turns.append((turn["v"][-1], turn["r"][-1]))
    sway, rate = np.subtract(*turns)

    gains = pilot.gains
    missing = 2.0 * side * (1.0 - gains["rudder"])
    missing -= gains["yaw_rate"] * rate + gains["sway"] * sway
    behind = missing / gains["heading_error"] / rate * SPEED - sway / rate
    assert own_lead(MARINER, pilot) == pytest.approx(behind / LENGTH + 0.25, abs=1e-3)


def test_turns_and_a_current_cost_less_than_with_line_of_sight():
    task = path_following_task(
        max_turn_deg=90.0, leg_lengths=[12.0, 16.0], sea=Weather(current=Current(1.5))
    )
    engine, seeds = Engine(MARINER, 8, task), np.arange(8)
    plain, ours = (
        episode_costs(kind.from_model(MARINER, task=task), engine, seeds).mean()
        for kind in (IntegralLineOfSight, WheelOver)
    )
    assert ours < 0.7 * plain


def test_it_is_a_controller_and_a_file(tmp_path):
    task = path_following_task(noise=1.0)
    guide = WheelOver.from_model(MARINER, task=task)
    check_controller(guide, MARINER, task, n_steps=20)
    guide.save(tmp_path / "guide.json")
    again = load_agent(tmp_path / "guide.json", MARINER)
    assert (again.kind, again.gains) == ("wheel-over", guide.gains)
