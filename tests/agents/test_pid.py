"""PID autopilot: poles, margins, and what it does with ships."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

from agents import PID, sail, step_response
from agents.controllers.linear_loop import rate_weight, sample_ship
from agents.controllers.pid import optimal_poles, place_poles
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.linear import Nomoto, nomoto
from shipgym.ships.steering import SteeringGear
from shipgym.tasks.task import control_interval, observation_scales

MARINER = load_model("mariner")


def changed(model=MARINER, gear=None, **factors):
    coefficients = {
        name: value * factors.get(name, 1.0)
        for name, value in model.coefficients.items()
    }
    return replace(model, coefficients=coefficients, steering=gear or model.steering)


UNSTABLE = changed(N_v=1.7, N_uv=1.7, gear=SteeringGear(35.0, 2.5))


def test_poles_of_the_nomoto_loop_are_where_they_were_asked_for():
    response, lag = nomoto(MARINER), 1.5
    gains = place_poles(response, lag, frequency=0.07, damping=0.8, slow=0.002)
    ship = np.polymul([1.0, 1.0 / response.T, 0.0, 0.0], [lag, 1.0])
    pid = response.rudder_effect * np.array(
        [gains["derivative"], gains["proportional"], gains["integral"]]
    )
    poles = np.roots(np.polyadd(ship, pid))
    pair = 0.07 * (-0.8 + 0.6j)
    for wanted in (pair, pair.conjugate(), -0.002):
        assert np.abs(poles - wanted).min() < 1e-9
    assert poles.sum() == pytest.approx(-1.0 / lag - 1.0 / response.T)


def test_without_price_on_the_rudder_rate_the_optimal_poles_have_the_textbook_damping():
    """Double integrator K/T with cost e^2 + 0.1 delta^2: frequency (K/T)^(1/2) 10^(1/4), damping 0.71."""
    frequency, damping = optimal_poles(
        Nomoto(K=2e3, T1=1e6, T2=0.0, T3=0.0, T=1e6), rate_weight=1e-9
    )
    assert damping == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert frequency == pytest.approx(np.sqrt(2e-3) * 10**0.25, rel=1e-3)


def test_margins_are_where_the_sampled_loop_becomes_unstable():
    model = changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 2.0))
    pid = PID.from_model(model)
    ship = sample_ship(model, control_interval(model))
    row = np.array(
        [
            [
                0.0,
                -pid.gains["derivative"],
                pid.gains["proportional"],
                0.0,
                pid.gains["integral"],
            ]
        ]
    )

    def largest_pole(factor):
        return np.abs(np.linalg.eigvals(ship.A + factor * ship.B @ row)).max()

    assert largest_pole(pid.margins.gain_margin) == pytest.approx(1.0, abs=1e-5)
    assert largest_pole(pid.margins.lowest_gain) == pytest.approx(1.0, abs=1e-5)
    assert largest_pole(1.0) < 1.0
    assert pid.margins.gain_margin > 2.0 > 0.5 > pid.margins.lowest_gain > 0.0
    assert pid.margins.phase_margin_deg > 45.0


def test_an_extra_delay_beyond_the_margin_makes_the_loop_unstable():
    pid = PID.from_model(MARINER)
    ship = sample_ship(MARINER, control_interval(MARINER))
    row = np.array(
        [
            [
                0.0,
                -pid.gains["derivative"],
                pid.gains["proportional"],
                0.0,
                pid.gains["integral"],
            ]
        ]
    )

    def largest_pole(
        delay,
    ):  # in control intervals: the command passes a line of buffers
        line = np.eye(delay, k=-1)
        into_ship = np.zeros((5, delay))
        into_ship[:, [-1]] = ship.B
        into_line = np.zeros((delay, 5))
        into_line[0] = row
        return np.abs(
            np.linalg.eigvals(np.block([[ship.A, into_ship], [into_line, line]]))
        ).max()

    intervals = pid.margins.delay_margin_s / ship.dt
    assert (
        largest_pole(int(np.floor(intervals)))
        < 1.0
        < largest_pole(int(np.ceil(intervals)))
    )


def test_a_course_change_ends_on_the_course_with_little_overshoot():
    step = step_response(PID.from_model(MARINER), MARINER, step_deg=20.0)
    heading = np.degrees(step.heading[0])
    assert heading[-1] == pytest.approx(20.0, abs=0.3)
    assert 20.0 < heading.max() < 22.0
    assert np.degrees(step.rudder[0].max()) > 20.0


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
    pid = PID.from_model(model)
    episodes = sail(pid, model, seeds=np.arange(32))
    assert not episodes.terminated.any()
    assert episodes.cost.mean() < 70.0
    step = step_response(pid, model, duration=60.0 * 160.93 / 7.7175)
    assert np.degrees(step.heading[0, -200:]) == pytest.approx(20.0, abs=0.1)


def test_the_integral_removes_what_a_wrong_neutral_rudder_leaves():
    pid = PID.from_model(MARINER)
    other = changed(N_0=-2.0, N_0u=-2.0, N_0uu=-2.0)
    step = step_response(pid, other, 0.0, duration=120.0 * 160.93 / 7.7175)
    assert np.degrees(np.abs(step.heading).max()) > 0.5
    assert np.degrees(np.abs(step.heading[0, -1])) < 0.02


def test_it_is_as_quick_as_a_weak_rudder_and_a_slow_gear_allow():
    """A weak rudder would have it slower, a slow gear quicker: so they would save 5 % and 3 % at most."""
    for model, other, most in (
        (changed(N_d=0.3, N_ud=0.3), 0.8, 1.05),
        (changed(UNSTABLE, gear=SteeringGear(35.0, 0.6)), 1.1, 1.03),
    ):
        pid = PID.from_model(model)
        else_ = PID.from_model(model, frequency=other * pid.design["frequency"])
        ours, theirs = (
            sail(one, model, seeds=np.arange(32)).cost.mean() for one in (pid, else_)
        )
        assert 1.0 < ours / theirs < most


def test_half_of_the_gears_lag_and_of_an_interval_is_made_up_for():
    model = replace(MARINER, steering=SteeringGear(35.0, 2.5, 10.0))
    assert PID.from_model(model, dt=2.0).design["lag"] == pytest.approx(5.0 + 1.0)


def test_a_slow_gear_is_asked_for_less():
    weights = [
        rate_weight(replace(MARINER, steering=SteeringGear(35.0, rate)))
        for rate in (1e9, 2.5, 0.5)
    ]
    assert weights[0] == pytest.approx(0.01 * (160.93 / 7.7175) ** 2)
    assert weights[0] < weights[1] < weights[2]
    assert weights[2] - weights[0] == pytest.approx((7.0 / 0.5) ** 2)


def test_commands_are_the_gains_on_what_is_observed():
    pid = PID.from_model(MARINER)
    scales = observation_scales(MARINER)
    error, yaw_rate, integral = np.radians(3.0), np.radians(0.1), 1.5
    seen = (
        np.array([np.sin(error), np.cos(error), yaw_rate, 0.1, 7.0, 0.1, 0.1, integral])
        / scales
    )
    order = pid.neutral_rudder + pid.gains["proportional"] * error
    order += pid.gains["integral"] * integral - pid.gains["derivative"] * yaw_rate
    action, state = pid.predict(seen, state="kept")
    assert action.dtype == np.float32
    assert action == pytest.approx([order / MARINER.steering.limit], rel=1e-5)
    assert state == "kept"
    many, _ = pid.predict(np.stack([seen, -seen]))
    assert many.shape == (2, 1)
    assert many[0] == action
    with pytest.raises(
        InputError,
        match=r"observation: shape \(7,\) found, expected \(8,\) or \(n, 8\)",
    ):
        pid.predict(seen[:7])


def test_a_policy_evaluation_of_stable_baselines3_takes_it_as_it_is():
    env = Monitor(gym.make("shipgym/CourseKeeping-v0", model=MARINER))
    rewards, lengths = evaluate_policy(
        PID.from_model(MARINER), env, n_eval_episodes=3, return_episode_rewards=True
    )
    assert lengths == [600, 600, 600]
    assert all(-100.0 < reward < 0.0 for reward in rewards)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"integral_lengths": 0.0}, "integral_lengths: expected a number > 0"),
        (
            {"frequency": 5.0},
            "PID on model 'mariner': the closed loop is unstable with these gains",
        ),
        ({"damping": -1.0}, "damping: expected"),
        ({"dt": "1"}, "dt: expected"),
    ],
)
def test_impossible_designs_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        PID.from_model(MARINER, **arguments)


@pytest.mark.parametrize(("name", "value"), [("frequency", 0.0), ("damping", -1.0)])
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=rf"{name}: expected"):
        PID.from_model(MARINER, **{name: value})


def test_what_is_left_of_the_gain_margin_is_told_to_the_last_twentieth():
    """Beyond it the loop is unstable, and what is lost of it below 1 is found too."""
    model = changed(UNSTABLE, gear=SteeringGear(35.0, 2.5, 2.0))
    pid = PID.from_model(model)
    most, least = pid.margins.gain_margin, pid.margins.lowest_gain

    def with_gains(factor):
        return replace(
            pid, gains={name: factor * gain for name, gain in pid.gains.items()}
        )

    high = with_gains(most / 1.05).margins_on(model)
    assert high.gain_margin == pytest.approx(1.05, rel=1e-6)
    assert high.lowest_gain == pytest.approx(1.05 * least / most, rel=1e-6)
    assert with_gains(least / 0.95).margins_on(model).lowest_gain == pytest.approx(
        0.95, rel=1e-6
    )
    for factor in (1.02 * most, 0.98 * least):
        with pytest.raises(
            InputError, match=r"unstable with these gains \(largest sampled pole 1\.0"
        ):
            with_gains(factor).margins_on(model)


def test_poles_that_do_not_oscillate_are_the_two_slowest_of_the_three():
    """1 / T two thousand times the rudder's effect: s1 s2 = (K / T) 10^(1/2), s1^2 + s2^2 = 1 / T^2."""
    effect = 0.01
    found = optimal_poles(
        Nomoto(K=effect, T1=1.0, T2=0.0, T3=0.0, T=1.0), rate_weight=1e-9
    )
    product = effect * np.sqrt(10.0)
    frequency, damping = (
        np.sqrt(product),
        np.sqrt(1.0 + 2.0 * product) / (2.0 * np.sqrt(product)),
    )
    assert found == pytest.approx((frequency, damping), rel=1e-3)
    assert damping > 1.0
