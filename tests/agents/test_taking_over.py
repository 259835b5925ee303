"""An autopilot takes the rudder over without a jump, and then steers as designed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents import LQ, LQG, PID, TurnRate, WheelOver
from agents.export.autopilot import Autopilot
from agents.export.helm import STEERING, Helm
from agents.export.nmea import NmeaReading
from agents.export.sensors import Limits
from agents.export.simulated import SimulatedShip
from shipgym.tasks.task import Task
from tests.agents.policies import MARINER

AGENTS = {kind.__name__: kind.from_model(MARINER) for kind in (PID, LQ, LQG, TurnRate)}
AGENTS["WheelOver"] = WheelOver.from_model(MARINER, task=Task.of("PathFollowing"))
SLOWEST_GEAR = np.radians(2.3)
NO_TURNS = {
    "cross_track": 0.0,
    "next_turn_distance": 0.0,
    "next_turn_angle": 0.0,
    "second_turn_distance": 0.0,
    "second_turn_angle": 0.0,
    "rate_of_turn": 0.0,
}


def engaged(agent, measured, set_point):
    """An autopilot that takes over, and what it is told."""
    pilot = Autopilot(agent)
    pilot.engage(measured["rudder"])
    return pilot, {**NO_TURNS, **measured, "set_point": set_point}


@pytest.mark.parametrize("name", AGENTS)
@settings(max_examples=25, deadline=None)
@given(
    rudder=st.floats(-0.6, 0.6),
    rate=st.floats(-0.03, 0.03),
    error=st.floats(-3.1, 3.1),
)
def test_the_first_order_is_the_rudder_and_the_next_are_near(name, rudder, rate, error):
    measured = {
        "heading": 1.0,
        "yaw_rate": rate,
        "rudder": rudder,
        "surge": 7.0,
        "sway": 0.0,
        "course": 1.0,
    }
    pilot, given_inputs = engaged(AGENTS[name], measured, 1.0 + error)
    orders = [rudder] + [pilot.step(given_inputs) for _ in range(10)]
    assert orders[1] == pytest.approx(rudder, abs=1e-9)
    assert np.abs(np.diff(orders)).max() <= SLOWEST_GEAR * pilot.dt + 1e-12


@pytest.mark.parametrize("name", AGENTS)
def test_it_comes_to_its_heading_from_a_turn_with_rudder(name):
    ship = SimulatedShip(MARINER, step=0.5)
    states = MARINER.state_names
    ship.states[0, states.index("delta")] = ship.order = np.radians(20.0)
    ship.states[0, states.index("r")] = np.radians(0.6)
    pilot, given_inputs = engaged(AGENTS[name], ship.measured(), np.radians(40.0))
    headings = []
    for number in range(1600):
        if number % 2 == 0:
            ship.order = pilot.step({**given_inputs, **ship.measured(), **NO_TURNS})
        ship.advance()
        headings.append(np.degrees(ship.now["psi"]))
    assert max(headings) < 43.0  # no swing beyond the course
    assert headings[-1] == pytest.approx(40.0, abs=0.3)


def test_orders_of_the_helm_begin_where_the_rudder_is():
    helm = Helm(AGENTS["PID"], 0.5, Limits())
    readings = {"heading": 0.4, "yaw_rate": 0.01, "rudder": 0.3}
    for quantity, value in readings.items():
        helm.sensors.take(NmeaReading(quantity, value, "HE"), 0.0)
    helm.watch(1.0, 0.0)
    assert (helm.state, helm.order) == (STEERING, 0.3)
    helm.steer(0.0)
    assert helm.order == pytest.approx(0.3)
