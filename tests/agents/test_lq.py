"""LQ autopilot: optimal for the environment's cost on the linear ship."""

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

from agents import LQ, PID, sail, step_response
from agents.controllers.linear_loop import sample_ship
from agents.controllers.lq import SteeringCost, lq_gain
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.models.linear import nomoto
from shipgym.tasks.task import course_keeping_task
from tests.agents.mariners import (
    HARD_TO_STEER,
    LENGTH_TIME,
    MARINER,
    UNSTABLE,
    changed,
)
from tests.ships.nomoto import nomoto2_ship


def linear_cost(ship, gain, cost, n=4000):
    """Cost of a step of 1 rad on the sampled linear ship, summed step by step."""
    x, total = np.array([0.0, 0.0, 1.0, 0.0, 0.0]), 0.0
    for _ in range(n):
        before = x[3]
        x = ship.A @ x - ship.B[:, 0] * (gain @ x)
        rate = (x[3] - before) / ship.dt
        total += x[2] ** 2 + cost.rudder_weight * x[3] ** 2
        total += cost.rate_weight_s2 * rate**2 + (x[4] / (20.0 * LENGTH_TIME)) ** 2
    return total


@pytest.mark.parametrize(
    "model", [MARINER, UNSTABLE], ids=["stable, lag", "unstable, no lag"]
)
def test_no_other_gains_are_cheaper_on_the_linear_ship(model):
    ship = sample_ship(model, 1.0)
    cost = SteeringCost().completed(model, 1.0)
    gain = lq_gain(ship, cost, LENGTH_TIME)
    best = linear_cost(ship, gain, cost)
    for i in range(5):
        for factor in (0.98, 1.02):
            other = gain.copy()
            other[i] *= factor
            assert linear_cost(ship, other, cost) > best


def test_sampling_is_exact_for_small_motions_of_the_environments_ship():
    ship = sample_ship(MARINER, 1.0)
    about, order = ship.about, np.radians(0.01)
    state = [0.0, 0.0, 0.0, about.surge, about.sway, 0.0, about.rudder]
    trial = MARINER.simulate(np.full((300, 1), about.rudder + order), 0.1, state)

    x, integral = np.zeros(5), 0.0
    for k in range(1, 31):
        x = ship.A @ x + ship.B[:, 0] * order
        integral -= trial["psi"][10 * k]
    sway = trial["v"][-1] - about.sway
    expected = [sway, trial["r"][-1], -trial["psi"][-1], order, integral]
    np.testing.assert_allclose(x, expected, rtol=2e-3)


@pytest.mark.parametrize("kind", [PID, LQ])
def test_a_course_change_ends_on_the_course_with_little_overshoot(kind):
    step = step_response(kind.from_model(MARINER), MARINER, step_deg=-20.0)
    heading = np.degrees(step.heading[0])
    assert heading[-1] == pytest.approx(-20.0, abs=0.3)
    assert -22.0 < heading.min() < -20.0


@pytest.mark.parametrize("kind", [PID, LQ])
@pytest.mark.parametrize("name", HARD_TO_STEER)
def test_ships_hard_to_steer_are_kept_on_course(kind, name):
    model = HARD_TO_STEER[name]
    controller = kind.from_model(model)
    episodes = sail(controller, model, seeds=np.arange(32))
    assert not episodes.terminated.any()
    assert episodes.cost.mean() < 70.0
    step = step_response(controller, model, duration=60.0 * LENGTH_TIME)
    assert np.degrees(step.heading[0, -200:]) == pytest.approx(20.0, abs=0.1)


def overshoot(controller, ship, share):
    """Overshoot of a change of 20 degrees, deg, at a share of her service speed."""
    state, memory = np.array(ship.service_state), None
    names, dt = ship.state_names, controller.design["dt"]
    state[names.index("u")] *= share
    largest = 0.0
    for _ in range(int(12.0 * ship.travel_time / share / dt)):
        known = dict(zip(names, state, strict=True))
        error = np.radians(20.0) - known["psi"]
        angles = [np.sin(error), np.cos(error)]
        seen = np.array([*angles, known["r"], known["v"], known["u"], 0.0, 0.0, 0.0])
        action, memory = controller.predict(
            seen / controller.observation_scales, memory
        )
        order = [action[0] * controller.rudder_limit, share * ship.service_shaft_speed]
        state = ship.simulate(np.array([order] * 2), 0.5 * dt, state)
        state = np.array([state[name][-1] for name in names])
        largest = max(largest, np.degrees(state[names.index("psi")]))
    return largest - 20.0


@pytest.mark.parametrize("kind", [PID, LQ])
def test_a_slow_ship_turns_as_she_does_at_service_speed(kind):
    """One set of gains overshoots by 3 degrees at half of it."""
    ship = load_model("kvlcc2")
    assert overshoot(kind.from_model(ship), ship, 0.5) < 1.0
    assert overshoot(kind.from_model(ship, schedule=0.0), ship, 0.5) > 2.0


@pytest.mark.parametrize(("kind", "share"), [(PID, 0.5), (LQ, 0.75)])
def test_waves_are_kept_from_the_rudder_where_a_sea_is_given(kind, share):
    """The design for a rough sea, at the same heading error and with margins."""
    task = course_keeping_task(sea="rough", noise=1.0)
    unaware = kind.from_model(MARINER)
    aware = kind.from_model(MARINER, wave_period=task.weather.waves.peak_period)
    assert aware.margins.is_enough
    plain, calm = (sail(one, MARINER, task, np.arange(16)) for one in (unaware, aware))
    travel = calm.rudder_travel_deg_min.mean()
    assert travel < share * plain.rudder_travel_deg_min.mean()
    error = calm.heading_rmse_deg.mean()
    assert error < 1.05 * plain.heading_rmse_deg.mean()
    assert calm.cost.mean() < plain.cost.mean()


@pytest.mark.parametrize("period", [0.5, 90.0])
def test_a_period_that_no_sea_is_met_with_is_refused(period):
    with pytest.raises(InputError, match=r"^wave_period: .*expected a number [<>]"):
        LQ.from_model(MARINER, wave_period=period)


@pytest.mark.parametrize("kind", [PID, LQ])
def test_the_integral_removes_what_a_wrong_neutral_rudder_leaves(kind):
    other = changed(N_0=-2.0, N_0u=-2.0, N_0uu=-2.0)
    controller = kind.from_model(MARINER)
    step = step_response(controller, other, 0.0, duration=120.0 * LENGTH_TIME)
    assert np.degrees(np.abs(step.heading).max()) > 0.5
    assert np.degrees(np.abs(step.heading[0, -1])) < 0.02


def test_a_ship_of_second_order_is_steered_without_seeing_her_memory():
    """Nomoto's form of second order has no sway to feed back; margins are exact."""
    ship = nomoto2_ship(nomoto(MARINER), MARINER.particulars, MARINER.steering)
    controller = LQ.from_model(ship)
    assert controller.gains["sway"] == 0.0
    assert controller.margins.gain_margin > 5.0
    assert controller.margins.phase_margin_deg > 50.0
    response = step_response(controller, ship, duration=40 * LENGTH_TIME)
    assert np.degrees(response.heading[0, -1]) == pytest.approx(20.0, abs=1.0)


def test_a_policy_evaluation_of_stable_baselines3_takes_it_as_it_is():
    env = Monitor(gym.make("shipgym/CourseKeeping-v0", model=MARINER))
    rewards, lengths = evaluate_policy(
        LQ.from_model(MARINER), env, n_eval_episodes=3, return_episode_rewards=True
    )
    assert lengths == [600, 600, 600]
    for reward, length in zip(rewards, lengths, strict=True):
        assert -0.05 * length < reward < 0.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rudder_weight", 0.0),
        ("rate_weight_s2", 0.0),
        ("dt", 0.0),
        ("integral_lengths", -1.0),
    ],
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=f"^{name}: .*expected a number > 0"):
        LQ.from_model(MARINER, **{name: value})
