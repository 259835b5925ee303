"""LQ autopilot: optimal for the environment's cost on the linear ship, and near it on the real one."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

from agents import LQ, sail, step_response
from agents.controllers.linear_loop import (
    SIGNALS,
    Compensator,
    _crossing,
    rate_weight,
    sample_ship,
    sampled_ships,
)
from agents.controllers.lq import lq_gain, lq_rows, riccati
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.conversions import nomoto, nomoto2_ship
from shipgym.ships.steering import SteeringGear
from shipgym.tasks.steering import RUDDER_WEIGHT
from shipgym.tasks.task import control_interval

MARINER = load_model("mariner")
LENGTH_TIME = 160.93 / 7.7175


def changed(model=MARINER, gear=None, **factors):
    coefficients = {
        name: value * factors.get(name, 1.0)
        for name, value in model.coefficients.items()
    }
    return replace(model, coefficients=coefficients, steering=gear or model.steering)


UNSTABLE = changed(N_v=1.7, N_uv=1.7, gear=SteeringGear(35.0, 2.5))


def test_a_ship_of_second_order_is_steered_without_seeing_her_memory():
    """Mariner in Nomoto's form of second order: no sway to feed back; the margins are of the exact loop."""
    ship = nomoto2_ship(nomoto(MARINER), MARINER.particulars, MARINER.steering)
    controller = LQ.from_model(ship)
    assert controller.gains["sway"] == 0.0
    assert controller.margins.gain_margin > 5.0
    assert controller.margins.phase_margin_deg > 50.0
    response = step_response(controller, ship, duration=40 * LENGTH_TIME)
    assert np.degrees(response.heading[0, -1]) == pytest.approx(20.0, abs=1.0)


def linear_cost(ship, gain, weight, integral_time, n=20_000):
    """Cost of a step of 1 rad on the sampled linear ship, summed step by step as the environment does."""
    x, cost = np.array([0.0, 0.0, 1.0, 0.0, 0.0]), 0.0
    for _ in range(n):
        before = x[3]
        x = ship.A @ x - ship.B[:, 0] * (gain @ x)
        rate = (x[3] - before) / ship.dt
        cost += (
            x[2] ** 2
            + RUDDER_WEIGHT * x[3] ** 2
            + weight * rate**2
            + (x[4] / integral_time) ** 2
        )
    return cost


@pytest.mark.parametrize(
    "model", [MARINER, UNSTABLE], ids=["stable, lag", "unstable, no lag"]
)
def test_no_other_gains_are_cheaper_on_the_linear_ship(model):
    ship, weight, integral_time = (
        sample_ship(model, 1.0),
        rate_weight(model),
        20.0 * LENGTH_TIME,
    )
    gain = lq_gain(ship, weight, integral_time)
    best = linear_cost(ship, gain, weight, integral_time, 4000)
    for i in range(5):
        for factor in (0.98, 1.02):
            other = gain * np.where(np.arange(5) == i, factor, 1.0)
            assert linear_cost(ship, other, weight, integral_time, 4000) > best


def test_sampling_is_exact_for_small_motions_of_the_environments_ship():
    ship = sample_ship(MARINER, 1.0)
    about, order = ship.about, np.radians(0.01)
    state = [0.0, 0.0, 0.0, about.surge, about.sway, 0.0, about.rudder]
    trial = MARINER.simulate(np.full((300, 1), about.rudder + order), 0.1, state)
    x, integral = np.zeros(5), 0.0
    for k in range(1, 31):
        x = ship.A @ x + ship.B[:, 0] * order
        integral -= trial["psi"][10 * k]
    expected = [
        trial["v"][-1] - about.sway,
        trial["r"][-1],
        -trial["psi"][-1],
        order,
        integral,
    ]
    np.testing.assert_allclose(x, expected, rtol=2e-3)


def test_margins_are_where_the_sampled_loop_becomes_unstable():
    lq = LQ.from_model(changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 2.0)))
    ship = sample_ship(changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 2.0)), 1.0)
    gains = np.array([[lq.gains[signal] for signal in SIGNALS]])

    def largest_pole(factor):  # of the rudder's effect on the ship
        scaled = gains * np.where(np.array(SIGNALS) == "rudder", 1.0, factor)
        return np.abs(np.linalg.eigvals(ship.A + ship.B @ scaled)).max()

    assert largest_pole(lq.margins.gain_margin) == pytest.approx(1.0, abs=1e-5)
    assert largest_pole(lq.margins.lowest_gain) == pytest.approx(1.0, abs=1e-5)
    assert lq.margins.gain_margin > 2.0 > 0.5 > lq.margins.lowest_gain
    assert lq.margins.phase_margin_deg > 35.0


def test_the_bandwidth_ends_where_half_of_the_power_is_left():
    omega = np.array([0.01, 0.1, 1.0, 10.0])
    assert _crossing(omega, 1.0 / np.hypot(1.0, omega)) == pytest.approx(1.0)
    assert _crossing(omega, np.array([1.0, 0.9, 0.5, 0.9])) == pytest.approx(
        0.1 * 10 ** ((0.9 - 0.5**0.5) / 0.4)
    )
    assert _crossing(omega, np.ones(4)) == 10.0
    assert _crossing(omega, np.array([0.5, 1.0, 0.1, 0.1])) == 0.01


def test_a_course_change_ends_on_the_course_with_little_overshoot():
    step = step_response(LQ.from_model(MARINER), MARINER, step_deg=-20.0)
    heading = np.degrees(step.heading[0])
    assert heading[-1] == pytest.approx(-20.0, abs=0.3)
    assert -22.0 < heading.min() < -20.0


@pytest.mark.parametrize(
    "model",
    [
        UNSTABLE,
        changed(N_v=2.5, N_uv=2.5),
        changed(UNSTABLE, gear=SteeringGear(35.0, 0.6)),
        changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 5.0)),
        changed(N_r=2.0, N_ur=2.0),
        changed(N_d=0.3, N_ud=0.3),
    ],
    ids=[
        "unstable",
        "very unstable",
        "slow gear",
        "lagging gear",
        "very stable",
        "weak rudder",
    ],
)
def test_ships_hard_to_steer_are_kept_on_course(model):
    lq = LQ.from_model(model)
    episodes = sail(lq, model, seeds=np.arange(32))
    assert not episodes.terminated.any()
    assert episodes.cost.mean() < 70.0
    step = step_response(lq, model, duration=60.0 * LENGTH_TIME)
    assert np.degrees(step.heading[0, -200:]) == pytest.approx(20.0, abs=0.1)


def test_the_integral_removes_what_a_wrong_neutral_rudder_leaves():
    other = changed(N_0=-2.0, N_0u=-2.0, N_0uu=-2.0)
    step = step_response(
        LQ.from_model(MARINER), other, 0.0, duration=120.0 * LENGTH_TIME
    )
    assert np.degrees(np.abs(step.heading).max()) > 0.5
    assert np.degrees(np.abs(step.heading[0, -1])) < 0.02


def test_the_model_seven_metres_long_is_steered_as_its_ship():
    """Gains are similar in units of ship length and speed where the gears are similar too."""
    p, scale = MARINER.particulars, 7.0 / 160.93
    small = replace(
        p,
        length=7.0,
        beam=p["beam"] * scale,
        draught=p["draught"] * scale,
        mass=p["mass"] * scale**3,
        xg=p["xg"] * scale,
        yaw_gyradius=p["yaw_gyradius"] * scale,
        speed=p["speed"] * np.sqrt(scale),
    )
    time = np.sqrt(scale)
    gear = SteeringGear(40.0, 5.0 / time, 1.0 * time)
    dt = control_interval(MARINER)
    ship, model = (
        LQ.from_model(MARINER),
        LQ.from_model(replace(MARINER, particulars=small, steering=gear), dt=dt * time),
    )
    assert model.gains["heading_error"] == pytest.approx(
        ship.gains["heading_error"], rel=1e-6
    )
    assert model.gains["rudder"] == pytest.approx(ship.gains["rudder"], rel=1e-6)
    assert model.gains["yaw_rate"] == pytest.approx(
        ship.gains["yaw_rate"] * time, rel=1e-6
    )
    assert model.margins.phase_margin_deg == pytest.approx(
        ship.margins.phase_margin_deg, rel=1e-3
    )


def test_a_policy_evaluation_of_stable_baselines3_takes_it_as_it_is():
    env = Monitor(gym.make("shipgym/CourseKeeping-v0", model=MARINER))
    rewards, lengths = evaluate_policy(
        LQ.from_model(MARINER), env, n_eval_episodes=3, return_episode_rewards=True
    )
    assert lengths == [600, 600, 600]
    assert all(-100.0 < reward < 0.0 for reward in rewards)


def test_an_impossible_design_is_refused():
    with pytest.raises(InputError, match="integral_lengths: expected a number > 0"):
        LQ.from_model(MARINER, integral_lengths=-1.0)


@pytest.mark.parametrize(
    ("name", "value"), [("rudder_weight", 0.0), ("rate_weight_s2", 0.0), ("dt", 0.0)]
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=rf"{name}: expected"):
        LQ.from_model(MARINER, **{name: value})


def test_the_integral_is_a_state_of_the_loop_only_where_it_is_fed_back():
    """By a gain on it, or into what a controller remembers."""
    ship = sample_ship(MARINER, 1.0)
    proportional, integral = np.eye(5)[[2]], np.eye(5)[[4]]

    def size(gathers, row):
        memory = np.zeros((1, 1)), gathers, np.ones((1, 1)), row
        return len(Compensator(*memory).closed_loop(ship))

    assert len(Compensator.static(proportional).closed_loop(ship)) == 4
    assert Compensator.static(integral).closed_loop(ship) == pytest.approx(
        ship.A + ship.B @ integral
    )
    assert size(proportional, proportional) == 5
    assert size(integral, proportional) == size(proportional, integral) == 6


def test_a_gear_without_lag_is_where_it_was_ordered_an_interval_later():
    linear = np.array([[[-0.02, -3.1, 0.9], [-0.001, -0.05, 0.003]]])
    (A,), (B,) = sampled_ships(linear, 0.0, 1.3)
    assert (A[3].tolist(), B[3]) == ([0.0] * 5, 1.0)
    quick, order = sampled_ships(linear, 1e-4, 1.3)
    others = [0, 1, 2, 4]
    np.testing.assert_allclose(
        A[np.ix_(others, others)], quick[0][np.ix_(others, others)], atol=1e-9
    )
    np.testing.assert_allclose(B, order[0], rtol=2e-3)


def test_the_riccati_equation_has_the_golden_ratio_for_ones_and_no_solution_without_a_rudder():
    """X = X / (1 + X) + 1; a state that stays or doubles, and that no command moves, has none."""
    stays, doubles = np.array([[1.0]]), np.array([[2.0]])
    found = riccati(
        np.array([stays, stays, doubles]),
        np.array([[[1.0]], [[0.0]], [[0.0]]]),
        np.ones((3, 1, 1)),
    )
    assert found[0, 0, 0] == pytest.approx((1.0 + np.sqrt(5.0)) / 2.0, rel=1e-12)
    assert np.isnan(found[1:]).all()
    unsteady = np.array([[[-0.02, -3.1, 0.0], [-0.001, 0.05, 0.0]]])
    rows = lq_rows(
        *sampled_ships(unsteady, 2.0, 1.0), 1.0, rate_weight(UNSTABLE), 400.0
    )
    assert np.isnan(rows).all()
