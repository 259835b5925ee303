"""Margins are the least over every break of the loop, by poles and by simulation."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, PID, step_response
from agents.controllers.linear_loop import SIGNALS, sample_ship
from agents.controllers.margins import crossings, frequencies_of, largest_pole
from shipgym.models import load_model
from shipgym.ships.steering import SteeringGear
from tests.agents.mariners import LAGGING, LENGTH_TIME, MARINER, UNSTABLE

SHIPS = {
    "mariner": MARINER,
    "lagging": LAGGING,
    "unstable": UNSTABLE,
    **{name: load_model(name) for name in ("kvlcc2", "tanker", "container")},
    **{name: load_model(name) for name in ("mariner-tls-svm", "kvlcc2-rm-svm")},
}
DESIGNS = (PID, LQ, LQG)
HEADING = ("heading_error", "heading_error_integral")


def signals_at(place):
    return np.isin(SIGNALS, HEADING if place == "heading_error" else place)


def pole(controller, ship, place, factor=1.0, delay=0):
    """Largest pole with a gain, and a delay in intervals, at one place of the loop."""
    loop = controller.loop()
    columns = np.where(signals_at(place), factor, 1.0)
    order = factor if place == "order" else 1.0
    changed = loop._replace(
        B=loop.B * columns, C=order * loop.C, D=order * loop.D * columns
    )
    if place != "order" or not delay:
        return largest_pole(changed.closed_loop(ship))
    n = len(loop.A)
    into_line = np.zeros((delay, 5 + n))
    into_line[0] = np.hstack([loop.D[0], loop.C[0]])
    into_ship = np.zeros((5 + n, delay))
    into_ship[:5, [-1]] = ship.B
    plant = np.block([[ship.A, np.zeros((5, n))], [loop.B, loop.A]])
    line = np.eye(delay, k=-1)
    return largest_pole(np.block([[plant, into_ship], [into_line, line]]))


def breaks(controller, ship):
    omega = frequencies_of(ship)
    broken = controller.loop().responses(ship, omega)
    return {place: crossings(omega, one) for place, one in broken.items()}


@pytest.mark.parametrize("kind", DESIGNS)
@pytest.mark.parametrize("name", SHIPS)
def test_at_each_break_the_loop_is_stable_up_to_its_margin(name, kind):
    controller = kind.from_model(SHIPS[name])
    ship = sample_ship(SHIPS[name], controller.design["dt"])
    found = breaks(controller, ship)
    assert {"order", "yaw_rate", "heading_error"} <= set(found)
    assert "rudder" not in found
    raised = {}
    for place, (gains, _, _) in found.items():
        raised[place] = min(gains[gains > 1.0], default=np.inf)
        if np.isfinite(raised[place]):
            assert pole(controller, ship, place, 0.99 * raised[place]) < 1.0
            assert pole(controller, ship, place, 1.01 * raised[place]) > 1.0
    margins = controller.margins
    assert margins.gain_margin == pytest.approx(min(raised.values()))
    _, _, delays = found["order"]
    intervals = min(delays) / ship.dt
    assert pole(controller, ship, "order", delay=int(intervals)) < 1.0
    assert pole(controller, ship, "order", delay=int(intervals) + 1) > 1.0
    if margins.lowest_gain:
        assert pole(controller, ship, "order", 1.02 * margins.lowest_gain) < 1.0
        assert pole(controller, ship, "order", 0.98 * margins.lowest_gain) > 1.0


@pytest.mark.parametrize("kind", DESIGNS)
@pytest.mark.parametrize("name", SHIPS)
def test_designs_have_six_decibels_and_thirty_degrees_everywhere(name, kind):
    margins = kind.from_model(SHIPS[name]).margins
    assert margins.gain_margin >= 2.0
    assert margins.phase_margin_deg >= 30.0


class Broken:
    """A controller with a gain at one place of each ship's loop."""

    def __init__(self, controller, gains):
        self.controller = controller
        self.check_fits = controller.check_fits
        names = list(controller.observation_names)
        self.seen = np.ones((len(gains), len(names)))
        self.order = np.ones((len(gains), 1))
        for lane, (place, gain) in enumerate(gains):
            if place == "order":
                self.order[lane] = gain
            elif place == "heading_error":
                places = ("heading_error_sin", "heading_error_integral")
                self.seen[lane, [names.index(one) for one in places]] = gain
            else:
                self.seen[lane, names.index(place)] = gain

    def predict(self, seen, state=None, starts=None, deterministic=True):
        neutral = self.controller.neutral_rudder / self.controller.rudder_limit
        shown = seen * self.seen
        shown[:, self.controller.observation_names.index("last_command")] = neutral
        action, state = self.controller.predict(shown, state, starts)
        return np.clip(neutral + (action - neutral) * self.order, -1.0, 1.0), state


@pytest.mark.parametrize("kind", DESIGNS)
@pytest.mark.parametrize(
    "name", ["mariner", "lagging", "kvlcc2", "mariner-tls-svm", "kvlcc2-rm-svm"]
)
def test_ships_settle_below_a_margin_and_swing_above_it(name, kind):
    """At nine tenths and eleven tenths of each margin, gear and its limits included."""
    model = SHIPS[name]
    controller = kind.from_model(model)
    gains = []
    found = breaks(controller, sample_ship(model, controller.design["dt"]))
    for place, (factors, _, _) in found.items():
        margin = min(factors[factors > 1.0], default=np.inf)
        if margin < 100.0:
            gains += [(place, 0.9 * margin), (place, 1.1 * margin)]
    step = step_response(
        Broken(controller, gains),
        [model] * len(gains),
        step_deg=0.05,
        duration=60.0 * model.travel_time,
    )
    ends = np.degrees(step.rudder[:, -len(step.t) // 5 :]).std(axis=1)
    for place, settled, swinging in zip(gains[::2], ends[::2], ends[1::2], strict=True):
        assert settled < 0.1, place
        assert swinging > 1.0, place


@pytest.mark.parametrize("kind", DESIGNS)
def test_a_gear_far_slower_than_the_design_knows_still_settles(kind):
    """1 deg/s and a lag of 8 s, where the design knows 5 deg/s and 1 s."""
    slow = replace(MARINER, steering=SteeringGear(40.0, 1.0, 8.0))
    step = step_response(kind.from_model(MARINER), slow, duration=40.0 * LENGTH_TIME)
    end = np.degrees(step.heading[0, -len(step.t) // 4 :])
    assert end == pytest.approx(20.0, abs=0.5)
