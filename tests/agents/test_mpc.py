"""Model predictive control: LQ where no limit is near, the best plan within the limits where one is."""

import json
import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from agents import LQ, MPC, check_controller, load_agent, sail
from agents.controllers.linear_loop import SIGNALS, rate_weight
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.steering import SteeringGear
from shipgym.tasks.task import course_keeping_task, observation_scales

pytest.importorskip("osqp", reason="extra mpc is not installed")
MARINER = load_model("mariner")
SLOW = replace(MARINER, steering=SteeringGear(35.0, 0.6))


def seen(error, yaw_rate, rudder, model=MARINER):
    """Observations of ships without drift, shape (n, 8)."""
    zero = np.zeros_like(error)
    columns = [np.sin(error), np.cos(error), yaw_rate, zero, zero, rudder, rudder, zero]
    return np.stack(columns, axis=-1) / observation_scales(model)


def test_without_a_limit_in_reach_it_is_lq():
    weights = {"rudder_weight": 0.03, "rate_weight_s2": rate_weight(MARINER)}
    mpc, lq = (kind.from_model(MARINER, **weights) for kind in (MPC, LQ))
    assert mpc.gains == lq.gains
    assert mpc.margins == lq.margins
    random = np.random.default_rng(0)
    error, rate, rudder = random.uniform(-1.0, 1.0, (3, 50)) * np.radians(
        [[2.0], [0.05], [0.5]]
    )
    shown = seen(error, rate, rudder)
    assert mpc.predict(shown)[0] == pytest.approx(lq.predict(shown)[0], abs=1e-6)


def test_another_process_that_is_sent_it_plans_the_same():
    """The solver is not sent but set up again there."""
    mpc, far = MPC.from_model(SLOW), seen(np.array([0.5]), np.zeros(1), np.zeros(1))
    order, _ = mpc.predict(far)  # which sets the solver up
    again = pickle.loads(pickle.dumps(mpc))
    assert again.predict(far)[0] == pytest.approx(order, abs=1e-6)


def test_it_plans_two_ship_lengths_ahead_or_two_steps_at_least():
    mpc = MPC.from_model(SLOW, dt=0.5)
    assert mpc.design == {
        "dt": 0.5,
        "integral_lengths": 20.0,
        "rudder_weight": 0.1,
        "rate_weight_s2": pytest.approx(0.01 * (160.93 / 7.7175) ** 2),
        "horizon_steps": round(2.0 * 160.93 / 7.7175 / 0.5),
        "rudder_rate_rad_s": np.radians(0.6),
    }
    assert MPC.from_model(MARINER, horizon_lengths=0.01).design["horizon_steps"] == 2.0
    with pytest.raises(
        InputError,
        match=r"horizon_steps: expected .*<= 640 .*got 834",
    ):
        MPC.from_model(MARINER, dt=0.05)


def hard_questions(model, n=20):
    random = np.random.default_rng(1)
    widths = np.radians([[60.0], [0.5], [30.0]])
    return random.uniform(-1.0, 1.0, (3, n)) * widths


@pytest.mark.parametrize("model", [MARINER, SLOW], ids=["lag", "slow"])
def test_rudder_and_its_rate_keep_to_their_limits(model):
    mpc = MPC.from_model(model)
    error, rate, rudder = hard_questions(model)
    order = (
        mpc.predict(seen(error, rate, rudder, model))[0][:, 0] * model.steering.limit
    )
    deviation = rudder - mpc.neutral_rudder
    moved = (
        mpc.transition[3, 3] * deviation
        + mpc.effect[3] * (order - mpc.neutral_rudder)
        - deviation
    )
    largest = model.steering.rate * mpc.design["dt"]
    assert np.abs(moved).max() == pytest.approx(largest, rel=1e-5)
    assert np.abs(order).max() <= model.steering.limit * (1.0 + 1e-6)


def test_the_plan_is_the_cheapest_within_the_limits():
    """Against scipy's solver on the plan's own numbers, LQ's cost of a plan being a square of corrections."""
    mpc = MPC.from_model(SLOW, horizon_lengths=0.6)
    limit, change = (
        SLOW.steering.limit,
        mpc.design["rudder_rate_rad_s"] * mpc.design["dt"],
    )
    steps, neutral = int(mpc.design["horizon_steps"]), mpc.neutral_rudder
    lowest = np.repeat((-limit - neutral, -change), steps)
    highest = np.repeat((limit - neutral, change), steps)
    error, rate, rudder = hard_questions(SLOW, 6)
    order = mpc.predict(seen(error, rate, rudder, SLOW))[0][:, 0] * SLOW.steering.limit
    row = np.array([mpc.gains[signal] for signal in SIGNALS])
    for k in range(6):
        state = np.array(
            [-mpc.neutral_sway, rate[k], error[k], rudder[k] - mpc.neutral_rudder, 0.0]
        )
        planned = mpc.plan.by_state @ state
        within = [
            {
                "type": "ineq",
                "fun": lambda v, p=planned: highest - p - mpc.plan.by_correction @ v,
            },
            {
                "type": "ineq",
                "fun": lambda v, p=planned: p + mpc.plan.by_correction @ v - lowest,
            },
        ]
        start = np.zeros(mpc.plan.by_correction.shape[1])
        best = minimize(
            lambda v: 50.0 * v @ v,
            start,
            jac=lambda v: 100.0 * v,
            method="SLSQP",
            constraints=within,
        )
        expected = row @ state + best.x[0] + mpc.neutral_rudder
        assert order[k] == pytest.approx(expected, abs=np.radians(0.1))


@pytest.mark.parametrize("rudder_weight", [0.1, 0.02])
def test_corrections_cost_their_squares_beside_lq(rudder_weight):
    """J(x, v) - J(x, 0) = (R + B'PB) sum v^2, here by summing the cost of the linear ship."""
    mpc = MPC.from_model(MARINER, rudder_weight=rudder_weight)
    row = np.array([mpc.gains[signal] for signal in SIGNALS])
    integral_time = mpc.design["integral_lengths"] * 160.93 / 7.7175

    def cost(corrections):
        x, total = np.array([0.2, 0.001, 0.1, 0.02, 0.5]), 0.0
        for k in range(3000):
            order = row @ x + (corrections[k] if k < len(corrections) else 0.0)
            before, x = x[3], mpc.transition @ x + mpc.effect * order
            total += x[2] ** 2 + rudder_weight * x[3] ** 2 + (x[4] / integral_time) ** 2
            total += (
                mpc.design["rate_weight_s2"] * ((x[3] - before) / mpc.design["dt"]) ** 2
            )
        return total

    plain = cost([])
    one, two = cost([0.01]) - plain, cost([0.0, -0.01]) - plain
    assert one > 0.0
    assert two == pytest.approx(one, rel=1e-6)
    assert cost([0.02, 0.01]) - plain == pytest.approx(5.0 * one, rel=1e-6)


def test_a_slow_gear_costs_less_than_with_lq():
    task, seeds = (
        course_keeping_task(episode_steps=120, change_interval_steps=60),
        np.arange(6),
    )
    ours, theirs = (
        sail(kind.from_model(SLOW), SLOW, task, seeds).cost.mean() for kind in (MPC, LQ)
    )
    assert ours < theirs


def test_it_is_a_controller_and_a_file(tmp_path):
    mpc = MPC.from_model(SLOW, rudder_weight=0.05)
    check_controller(mpc, SLOW, n_steps=20)
    mpc.save(tmp_path / "mpc.json")
    again = load_agent(tmp_path / "mpc.json", SLOW)
    shown = seen(*hard_questions(SLOW), SLOW)
    assert np.array_equal(again.predict(shown)[0], mpc.predict(shown)[0])
    assert again.design == mpc.design


def test_a_file_of_before_the_rudder_s_weight_was_a_setting_steers_the_same(tmp_path):
    mpc, path = MPC.from_model(SLOW), tmp_path / "mpc.json"
    mpc.save(path)
    content = json.loads(path.read_text())
    del content["design"]["rudder_weight"]
    path.write_text(json.dumps(content))
    shown = seen(*hard_questions(SLOW), SLOW)
    assert np.array_equal(
        load_agent(path, SLOW).predict(shown)[0], mpc.predict(shown)[0]
    )


def test_without_the_solver_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "osqp", None)
    with pytest.raises(
        InputError,
        match=r"osqp is not installed, MPC needs it: pip install 'shipgym\[mpc\]'",
    ):
        MPC.from_model(MARINER)


@pytest.mark.parametrize(
    ("name", "value"), [("horizon_lengths", 0.0), ("horizon_lengths", 20.1)]
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=f"{name}: expected"):
        MPC.from_model(MARINER, **{name: value})
