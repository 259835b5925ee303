"""Margins and bandwidth of linear loops against poles and python-control."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, PID
from agents.controllers.linear_loop import SIGNALS, sample_ship
from agents.controllers.margins import (
    Compensator,
    bandwidth,
    check_stable,
    largest_pole,
)
from shipgym.errors import InputError
from shipgym.tasks.scales import control_interval
from tests.agents.mariners import LAGGING, MARINER

RUDDER = np.array(SIGNALS) == "rudder"


def pole_with(controller, ship, factor):
    """Largest pole where the rudder's effect on the ship is multiplied."""
    gains = np.array(controller.parameters.gains)
    changed = gains * np.where(RUDDER, 1.0, factor)
    return largest_pole(ship.A + ship.B @ changed[None])


@pytest.mark.parametrize("kind", [PID, LQ])
def test_margins_are_where_the_sampled_loop_becomes_unstable(kind):
    controller = kind.from_model(LAGGING)
    ship = sample_ship(LAGGING, control_interval(LAGGING))
    margins = controller.margins
    assert pole_with(controller, ship, margins.gain_margin) == pytest.approx(
        1.0, abs=1e-5
    )
    assert pole_with(controller, ship, margins.lowest_gain) == pytest.approx(
        1.0, abs=1e-5
    )
    assert pole_with(controller, ship, 1.0) < 1.0
    assert margins.gain_margin > 2.0 > 0.5 > margins.lowest_gain > 0.0
    assert margins.phase_margin_deg > 35.0


def test_what_is_left_of_the_gain_margin_is_found_to_the_last_twentieth():
    """Beyond it the loop is unstable, and what is lost of it below 1 is found too."""
    pid = PID.from_model(LAGGING)
    most, least = pid.margins.gain_margin, pid.margins.lowest_gain

    def with_gains(factor):
        gains = {name: factor * gain for name, gain in pid.gains.items()}
        return replace(pid, gains=gains)

    high = with_gains(most / 1.05).margins_on(LAGGING)
    assert high.gain_margin == pytest.approx(1.05, rel=1e-6)
    assert high.lowest_gain == pytest.approx(1.05 * least / most, rel=1e-6)
    low = with_gains(least / 0.95).margins_on(LAGGING)
    assert low.lowest_gain == pytest.approx(0.95, rel=1e-6)
    for factor in (1.02 * most, 0.98 * least):
        with pytest.raises(
            InputError, match=r"expected sampled poles below 1, got 1\.0"
        ):
            with_gains(factor).margins_on(LAGGING)


def test_a_delay_beyond_the_margin_makes_the_loop_unstable():
    pid = PID.from_model(MARINER)
    ship = sample_ship(MARINER, control_interval(MARINER))
    gains = np.array(pid.parameters.gains)

    def pole_with_delay(intervals):
        """The command passes a line of buffers."""
        into_ship = np.zeros((5, intervals))
        into_ship[:, [-1]] = ship.B
        into_line = np.zeros((intervals, 5))
        into_line[0] = gains
        line = np.eye(intervals, k=-1)
        return largest_pole(np.block([[ship.A, into_ship], [into_line, line]]))

    delay = pid.margins.delay_margin_s / ship.dt
    assert pole_with_delay(int(np.floor(delay))) < 1.0
    assert pole_with_delay(int(np.ceil(delay))) > 1.0


def test_the_bandwidth_ends_where_half_of_the_power_is_left():
    omega = np.array([0.01, 0.1, 1.0, 10.0])
    assert bandwidth(omega, 1.0 / np.hypot(1.0, omega)) == pytest.approx(1.0)
    share = (0.9 - np.sqrt(0.5)) / 0.4
    straight = bandwidth(omega, np.array([1.0, 0.9, 0.5, 0.9]))
    assert straight == pytest.approx(0.1 * 10**share)
    assert bandwidth(omega, np.ones(4)) == 10.0
    assert bandwidth(omega, np.array([0.5, 1.0, 0.1, 0.1])) == 0.01


def test_the_integral_is_a_state_of_the_loop_only_where_it_is_fed_back():
    """By a gain on it, or into what a controller remembers."""
    ship = sample_ship(MARINER, 1.0)
    proportional, integral = np.eye(5)[2], np.eye(5)[4]

    def size(remembered, fed_back):
        loop = Compensator(
            np.zeros((1, 1)), remembered[None], np.ones((1, 1)), fed_back[None]
        )
        return len(loop.closed_loop(ship))

    assert len(Compensator.static(proportional).closed_loop(ship)) == 4
    closed = Compensator.static(integral).closed_loop(ship)
    assert closed == pytest.approx(ship.A + ship.B @ integral[None])
    assert size(proportional, proportional) == 5
    assert size(integral, proportional) == size(proportional, integral) == 6


@pytest.mark.parametrize("kind", [PID, LQ, LQG])
def test_the_loop_of_a_law_is_what_its_margins_are_of(kind):
    controller = kind.from_model(MARINER)
    ship = sample_ship(MARINER, controller.design["dt"])
    assert controller.loop().margins(ship, "it") == controller.margins


def test_a_system_that_does_not_decay_is_refused_by_name():
    check_stable(np.diag([0.99]), "here")
    with pytest.raises(
        InputError, match=r"here: expected sampled poles below 1, got 1$"
    ):
        check_stable(np.diag([0.5, 1.0]), "here")
