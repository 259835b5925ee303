"""LQG autopilot: LQ with a Kalman filter, and noise moves the rudder less."""

import control
import numpy as np
import pytest

from agents import LQ, LQG, load_agent, sail
from agents.controllers.kalman import OUTPUT, course_filter, kalman_gain
from agents.controllers.linear_loop import sample_ship
from shipgym.errors import InputError
from shipgym.instruments.noise import SEA_TRIAL
from shipgym.tasks import control_interval, course_keeping_task
from tests.agents.mariners import MARINER, changed

UNSTABLE = changed(N_v=1.7, N_uv=1.7)


def test_the_kalman_gain_is_that_of_python_control_and_of_the_recursion():
    states = course_filter(MARINER, 1.0, disturbance=0.04)
    transition, output, process = states.transition, OUTPUT, states.process
    noise = np.diag([SEA_TRIAL["yaw_rate"], SEA_TRIAL["heading"]]) ** 2
    gain, deviation = kalman_gain(states, noise=1.0)
    predictor, _, _ = control.dlqe(transition, np.eye(3), output, process, noise)
    assert transition @ gain == pytest.approx(np.asarray(predictor), rel=1e-9)
    covariance = np.eye(3)
    for _ in range(2000):
        innovation = output @ covariance @ output.T + noise
        limit = covariance @ output.T @ np.linalg.inv(innovation)
        covariance = (
            transition @ (covariance - limit @ output @ covariance) @ transition.T
            + process
        )
    assert gain == pytest.approx(limit, rel=1e-6)
    assert deviation == pytest.approx(np.sqrt(np.diag(innovation)), rel=1e-6)


@pytest.mark.parametrize("model", [MARINER, UNSTABLE], ids=["stable", "unstable"])
def test_poles_of_the_loop_are_those_of_lq_and_of_the_filter(model):
    """Separation, but for the mean of the measured rudder that the filter takes."""
    lqg, ship = LQG.from_model(model), sample_ship(model, control_interval(model))
    poles = np.linalg.eigvals(lqg.loop().closed_loop(ship))
    regulator = np.linalg.eigvals(LQ.from_model(model).loop().closed_loop(ship))
    trusted = np.eye(3) - lqg.kalman @ OUTPUT
    observer = np.linalg.eigvals(trusted @ lqg.transition)
    for pole in (*regulator, *observer):
        assert np.abs(poles - pole).min() < 0.02
    assert lqg.margins.gain_margin > 3.0
    assert lqg.margins.phase_margin_deg > 35.0


def test_noise_and_sea_move_the_rudder_less_than_with_lq_at_no_higher_cost():
    lq, lqg = LQ.from_model(MARINER), LQG.from_model(MARINER)
    for task, saved in (
        (course_keeping_task(noise=3.0), 0.75),
        (course_keeping_task(sea="rough", noise=1.0), 0.75),
    ):
        one, other = (sail(pilot, MARINER, task, np.arange(16)) for pilot in (lqg, lq))
        assert one.cost.mean() < other.cost.mean()
        assert (
            one.rudder_travel_deg_min.mean()
            < saved * other.rudder_travel_deg_min.mean()
        )


def test_without_noise_it_costs_as_much_as_lq():
    lq, lqg = (
        sail(kind.from_model(MARINER), MARINER, seeds=np.arange(16))
        for kind in (LQ, LQG)
    )
    assert lqg.cost.mean() == pytest.approx(lq.cost.mean(), rel=0.02)


def test_the_file_holds_the_filter(tmp_path):
    lqg = LQG.from_model(MARINER, wave_period=9.0)
    lqg.save(tmp_path / "lqg.json")
    again = load_agent(tmp_path / "lqg.json", MARINER)
    observations = np.random.default_rng(0).uniform(-0.3, 0.3, (5, 3, 8))
    ours = theirs = None
    for seen in observations:
        action, ours = lqg.predict(seen, ours)
        repeated, theirs = again.predict(seen, theirs)
        assert np.array_equal(action, repeated)
    text = (tmp_path / "lqg.json").read_text()
    (tmp_path / "cut.json").write_text(text.replace('"kalman"', '"calman"'))
    with pytest.raises(
        InputError, match=r"arrays: unknown key 'calman'\. Did you mean 'kalman'"
    ):
        load_agent(tmp_path / "cut.json")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("wave_period", 1.0, "expected a number > 2 \\(two control intervals"),
        ("rudder_weight", -1.0, "expected a number > 0"),
    ],
)
def test_numbers_beyond_their_bounds_are_refused(name, value, message):
    settings = {"wave_period": 9.0, name: value}
    with pytest.raises(InputError, match=f"^{name}: .*{message}"):
        LQG.from_model(MARINER, **settings)
