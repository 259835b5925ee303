"""Margins and bandwidth of linear loops against poles and python-control."""

import numpy as np
import pytest

from agents import LQ, LQG, PID
from agents.controllers.linear_loop import SIGNALS, sample_ship
from agents.controllers.margins import largest_pole
from shipgym.errors import InputError
from shipgym.tasks import control_interval
from tests.agents.mariners import LAGGING, MARINER, changed

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


RUDDER_COEFFICIENTS = ("Y_d", "Y_ud", "Y_uud", "N_d", "N_ud", "N_uud")


@pytest.mark.parametrize("kind", [PID, LQ, LQG])
def test_the_gain_margin_is_the_rudder_effect_at_which_the_loop_becomes_unstable(kind):
    controller = kind.from_model(MARINER)
    margin = controller.margins.gain_margin

    def ship(factor):
        return changed(**dict.fromkeys(RUDDER_COEFFICIENTS, factor))

    near = controller.margins_on(ship(0.9 * margin))
    assert near.gain_margin == pytest.approx(1.0 / 0.9, rel=0.05)
    with pytest.raises(InputError):
        controller.margins_on(ship(1.1 * margin))
