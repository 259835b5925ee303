"""LQ over speed: each speed has the gains of its own design."""

from types import SimpleNamespace

import numpy as np
import pytest

from agents import LQ, ScheduledLQ, check_controller, load_agent, sail
from agents.controllers import scheduled_lq
from agents.controllers.linear_loop import SIGNALS, rate_weight, sample_ship
from agents.controllers.lq import lq_gain
from shipgym.errors import InputError
from shipgym.ships import load_model

MARINER, KVLCC2 = load_model("mariner"), load_model("kvlcc2")


@pytest.fixture(scope="module")
def of_mariner():
    return ScheduledLQ.from_model(MARINER)


@pytest.fixture(scope="module")
def of_kvlcc2():
    return ScheduledLQ.from_model(KVLCC2)


def test_at_each_listed_speed_it_is_the_design_for_that_speed():
    speeds = [5.0, 6.5, 8.0]
    scheduled = ScheduledLQ.from_model(MARINER, speeds=speeds)
    for speed, gains in zip(speeds, scheduled.schedule, strict=True):
        ship = sample_ship(MARINER, 1.0, speed=speed)
        expected = -lq_gain(ship, rate_weight(MARINER), 20.0 * 160.93 / speed)
        assert gains == pytest.approx(expected, rel=1e-12)
    between, _ = scheduled.at(np.array([5.75, 1.0, 20.0]))
    assert between[0] == pytest.approx(scheduled.schedule[:2].mean(axis=0))
    assert np.array_equal(between[1:], scheduled.schedule[[0, 2]])


def test_a_slower_ship_is_given_more_rudder_per_yaw_rate(of_mariner, of_kvlcc2):
    for scheduled in (of_mariner, of_kvlcc2):
        by_signal = dict(zip(SIGNALS, scheduled.schedule.T, strict=True))
        assert np.all(np.diff(np.abs(by_signal["yaw_rate"])) < 0.0)


def linear_cost(ship, row, n=4000):
    x, cost = np.array([0.0, 0.0, 0.1, 0.0, 0.0]), 0.0
    for _ in range(n):
        before = x[3]
        x = ship.A @ x + ship.B[:, 0] * (row @ x)
        cost += (
            x[2] ** 2
            + 0.1 * x[3] ** 2
            + rate_weight(MARINER) * ((x[3] - before) / ship.dt) ** 2
        )
    return cost


def test_a_ship_that_has_lost_speed_is_steered_cheaper_than_by_the_gains_of_service_speed(
    of_mariner,
):
    lq = LQ.from_model(MARINER)
    ship = sample_ship(MARINER, 1.0, speed=0.6 * MARINER.particulars["speed"])
    fixed = np.array([lq.gains[signal] for signal in SIGNALS])
    assert linear_cost(ship, of_mariner.schedule[0]) < 0.995 * linear_cost(ship, fixed)


def test_between_the_speeds_the_loop_is_stable(of_kvlcc2):
    scheduled = of_kvlcc2
    dt = scheduled.design["dt"]
    for speed in np.linspace(scheduled.speeds[0], scheduled.speeds[-1], 12):
        ship = sample_ship(KVLCC2, dt, speed=float(speed))
        gains, _ = scheduled.at(np.array([speed]))
        assert np.abs(np.linalg.eigvals(ship.A + ship.B @ gains)).max() < 1.0
    assert scheduled.design["least_phase_margin_deg"] > 30.0


def test_on_the_nonlinear_ship_it_costs_no_more_than_lq(of_mariner):
    pilots = (of_mariner, LQ.from_model(MARINER))
    ours, theirs = (sail(pilot, MARINER, seeds=np.arange(16)) for pilot in pilots)
    assert ours.cost.mean() < 1.01 * theirs.cost.mean()


def test_it_is_a_controller_and_a_file(of_mariner, tmp_path):
    scheduled = of_mariner
    check_controller(scheduled, MARINER, n_steps=10)
    scheduled.save(tmp_path / "scheduled.json")
    shown = np.random.default_rng(0).uniform(-0.5, 0.9, (20, 8))
    again = load_agent(tmp_path / "scheduled.json", MARINER)
    assert np.array_equal(again.predict(shown)[0], scheduled.predict(shown)[0])


def test_speeds_that_do_not_rise_are_refused():
    with pytest.raises(
        InputError,
        match=r"speeds: \[7\.0, 5\.0\] found, expected at least two in rising order",
    ):
        ScheduledLQ.from_model(MARINER, speeds=[7.0, 5.0])


def test_an_unbounded_gain_margin_is_a_million(monkeypatch):
    margins = SimpleNamespace(gain_margin=np.inf, phase_margin_deg=61.0)
    monkeypatch.setattr(scheduled_lq.Compensator, "margins", lambda *_: margins)
    design = ScheduledLQ.from_model(MARINER, speeds=[6.0, 8.0]).design
    assert (design["least_gain_margin"], design["least_phase_margin_deg"]) == (
        1e6,
        61.0,
    )
