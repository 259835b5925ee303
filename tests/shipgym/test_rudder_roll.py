"""Rudder and waves roll a ship, and a rudder can damp her roll."""

import gymnasium
import numpy as np
import pytest

import shipgym

ID = "shipgym/RudderRoll-v0"


def rolls(from_deg, gain=0.0):
    """Roll of 16 ships under a heading autopilot that adds `gain` times roll rate, deg.

    The waves come from `from_deg` at 2.6 m and 9.2 s; shape (600, 16).
    """
    waves = {"significant_height": 2.6, "peak_period": 9.2, "from_deg": from_deg}
    envs = gymnasium.make_vec(ID, num_envs=16, sea={"waves": waves})
    scales = envs.observation_scales
    seen, _ = envs.reset(seed=0)
    heels = []
    for _ in range(600):
        error, _, rate, *_, roll, roll_rate = (seen * scales).T
        order = error - 10.0 * rate - gain * roll_rate
        command = order / np.radians(35.0)
        seen, *_ = envs.step(command[:, None].astype(np.float32))
        heels.append(np.degrees(roll))
    return np.array(heels)


@pytest.fixture(scope="module")
def near():
    """Waves met at 0.6 rad/s, about the ship's own frequency."""
    return rolls(97.0)


def test_waves_roll_a_ship_most_where_they_meet_her_near_her_own_period(near):
    """Several degrees there, a third of it from the quarter (0.36 rad/s)."""
    assert 3.0 < near.std() < 9.0
    assert rolls(125.0).std() < 0.5 * near.std()


def test_a_rudder_against_the_roll_rate_damps_the_roll(near):
    """By a sixth and more, though the gear limits it; with another sign not at all."""
    assert rolls(97.0, gain=3.0).std() < 0.85 * near.std()
    assert rolls(97.0, gain=-3.0).std() > near.std()


def test_a_rudder_heels_a_ship_inward_first_and_then_outward():
    """Rudder to starboard: first to starboard, then to port (not minimum phase)."""
    ship = shipgym.load_model("container-stiff")
    held = [[np.radians(10.0), ship.service_shaft_speed]] * 120
    trial = ship.simulate(held, 1.0)
    heel = np.degrees(trial["phi"])
    assert heel[:6].max() > 0.1
    assert heel[60:].mean() < -0.3
    assert trial["psi"][-1] > 0.5


def test_the_gear_of_an_episode_is_drawn_from_its_range():
    envs = gymnasium.make_vec(ID, num_envs=64)
    envs.reset(seed=3)
    rudders = []
    for _ in range(4):
        envs.step(np.ones((64, 1), np.float32))
        rudders.append(np.degrees(envs.physical_state()["delta"]))
    rates = rudders[3] - rudders[2]
    assert 2.5 <= rates.min() < 2.8
    assert 4.7 < rates.max() <= 5.0


def test_roll_costs_its_square_beyond_three_degrees_and_way_lost_counts():
    envs = gymnasium.make_vec(ID, num_envs=16)
    envs.reset(seed=4)
    service_speed = 22.0 * 1852.0 / 3600.0
    for _ in range(60):
        *_, info = envs.step(np.zeros((16, 1), np.float32))
        now = envs.physical_state()
        beyond = np.maximum(np.abs(np.degrees(now["phi"])) - 3.0, 0.0)
        np.testing.assert_allclose(info["reward_roll"], -((beyond / 5.0) ** 2))
        lost = np.maximum(1.0 - now["u"] / service_speed, 0.0)
        np.testing.assert_allclose(info["reward_speed"], -lost, atol=1e-12)
