"""Rate-of-turn autopilot: turns, changes of heading, and limits."""

from dataclasses import replace

import numpy as np
import pytest

from agents import TurnRate, check_controller, load_agent, step_response
from agents.controllers.law import Signals
from agents.controllers.turn_rate import (
    SteadyTurns,
    TurnRateMemory,
    course_rate,
    steady_turns,
)
from shipgym.errors import InputError
from shipgym.manoeuvres import turning_circle
from shipgym.models import load_model
from shipgym.models.linear import straight_running

MARINER, TANKER = load_model("mariner"), load_model("tanker")
STILL = Signals(*np.zeros(len(Signals._fields)))


def turned(agent, model, rate, seconds):
    """Yaw rates, rad/s, and rudder orders of a ship that is ordered a rate of turn."""
    dt, state = agent.design["dt"], model.service_state.copy()
    memory = TurnRateMemory(0.0, 0.0, 0.0)
    yaw_rate = model.state_names.index("r")
    rates, orders = [], []
    for _ in range(int(seconds / dt)):
        seen = STILL._replace(yaw_rate=state[yaw_rate], rate_of_turn=rate)
        order, memory = agent.steer(seen, memory)
        commands = np.tile(model.service_command, (2, 1))
        commands[:, 0] = np.clip(order, -model.steering.limit, model.steering.limit)
        trial = model.simulate(commands, 0.5 * dt, state=state)
        state = np.array([trial[name][-1] for name in model.state_names])
        rates.append(state[yaw_rate])
        orders.append(float(order))
    return np.array(rates), np.array(orders)


@pytest.mark.parametrize("model", [MARINER, TANKER], ids=["mariner", "tanker"])
def test_the_table_is_that_of_steady_turning_circles_also_of_an_unstable_ship(model):
    rates, rudders = steady_turns(model, straight_running(model).rudder)
    steady = turning_circle(model, 10.0, 3000.0, 1.0)["r"][-1]
    assert np.interp(steady, rates, rudders) == pytest.approx(
        np.radians(10.0), rel=0.04
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_ordered_rate_of_turn_is_reached_and_kept(side):
    agent = TurnRate.from_model(MARINER)
    wanted = side * 0.8 * agent.gains["rate"]
    rates, orders = turned(agent, MARINER, wanted, 400.0)
    assert rates[-200:] == pytest.approx(wanted, rel=0.02)
    assert np.abs(rates).max() < 1.1 * abs(wanted)
    assert np.abs(orders).max() < np.radians(20.0)


@pytest.mark.parametrize("model", [MARINER, TANKER], ids=["mariner", "tanker"])
def test_a_course_is_changed_at_its_rate_without_overshoot(model):
    agent = TurnRate.from_model(model, rate_deg_min=15.0)
    found = step_response(agent, model, 40.0)
    rates = np.degrees(np.gradient(found.heading[0], found.t)) * 60.0
    assert rates.max() == pytest.approx(15.0, rel=0.05)
    assert np.degrees(found.heading[0].max()) < 40.5
    assert np.degrees(found.heading[0, -1]) == pytest.approx(40.0, abs=0.5)


@pytest.mark.parametrize("model", [MARINER, TANKER], ids=["mariner", "tanker"])
def test_a_rate_is_hardly_overshot_and_a_heading_damped_by_seven_tenths(model):
    """Of s^2 + (1 / T + p K / T) s + i K / T, inside the loop of the heading."""
    agent = TurnRate.from_model(model)
    gains, design = agent.gains, agent.design
    time, effect = design["nomoto_T"], design["nomoto_K"] / design["nomoto_T"]
    rate = np.array(
        [1.0, 1.0 / time + gains["proportional"] * effect, gains["integral"] * effect]
    )
    pair = np.roots(rate)[0]
    assert np.abs(pair) == pytest.approx(design["frequency"])
    assert np.exp(np.pi * pair.real / np.abs(pair.imag)) == pytest.approx(
        0.0015, abs=0.001
    )
    heading = np.roots(np.append(rate, rate[2] / gains["heading_time"]))
    slowest = heading[np.argmin(np.abs(heading))]
    assert -slowest.real / np.abs(slowest) == pytest.approx(0.74, abs=0.03)


@pytest.mark.parametrize(
    "model",
    [
        replace(MARINER, steering=replace(MARINER.steering, rudder_limit_deg=35.0)),
        TANKER,
    ],
    ids=["mariner", "tanker"],
)
def test_courses_are_changed_at_the_rate_of_three_tenths_of_the_rudder(
    model,
):
    agent, most = TurnRate.from_model(model), 0.3 * model.steering.limit
    time = model.particulars["length"] / model.particulars["speed"]
    rates = agent.gains["rate"] + np.array([0.0, 0.02 / time])
    rudders = [
        np.interp(side * rates, agent.rates, agent.rudders) for side in (1.0, -1.0)
    ]
    used, further = np.abs(np.array(rudders) - straight_running(model).rudder).max(
        axis=0
    )
    assert used <= most < further


def test_a_long_ship_and_a_slow_gear_are_asked_for_less():
    time = MARINER.particulars["length"] / MARINER.particulars["speed"]
    assert TurnRate.from_model(MARINER).design["frequency"] * time == pytest.approx(2.0)
    slow = replace(MARINER, steering=replace(MARINER.steering, time_constant=10.0))
    assert TurnRate.from_model(slow, dt=2.0).design["frequency"] * (
        10.0 + 1.0
    ) == pytest.approx(0.3)


def test_it_is_a_controller_with_margins_and_a_file(tmp_path):
    agent = TurnRate.from_model(MARINER)
    check_controller(agent, MARINER, n_steps=20)
    assert agent.margins.phase_margin_deg > 45.0
    assert agent.margins.gain_margin > 3.0
    agent.save(tmp_path / "it.json")
    again = load_agent(tmp_path / "it.json", MARINER)
    assert np.array_equal(again.rudders, agent.rudders)
    with pytest.raises(InputError, match=r"^rate_deg_min: "):
        TurnRate.from_model(MARINER, rate_deg_min=1000.0)


def test_a_ship_that_hardly_turns_changes_courses_at_the_least_rate():
    """A fiftieth of speed over length."""
    table = SteadyTurns(np.array([-0.01, 0.0, 0.01]), np.radians([-15.0, 0.0, 15.0]))
    rate = course_rate(MARINER, table, neutral=0.0)
    assert rate == pytest.approx(0.02 / MARINER.travel_time)


@pytest.mark.parametrize(
    ("yaw_rate", "waits"), [(-0.003, False), (-0.5, True), (0.5, True)]
)
def test_the_integral_waits_while_the_rudder_is_at_its_limit(yaw_rate, waits):
    agent = TurnRate.from_model(MARINER)
    gains, smoothing = agent.gains, agent.parameters.smoothing
    seen = STILL._replace(yaw_rate=yaw_rate, rate_of_turn=0.001)
    order, after = agent.steer(seen, TurnRateMemory(0.02, 0.0, 1.0))

    assert (abs(order) >= MARINER.steering.limit) == waits
    off = smoothing * 0.001 - yaw_rate
    more = 0.0 if waits else gains["integral"] * agent.design["dt"] * off
    assert after.integral == pytest.approx(0.02 + more)
    assert after.followed == pytest.approx(smoothing * 0.001)
