from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.samples.gear_response import GearResponse, goes_on
from identification.samples.rudder import estimated_gear, rebuild, straight
from shipgym import ShipModel, SteeringGear, Trial
from shipgym.manoeuvres import zigzag


def fine_and_coarse(model: ShipModel, rate: float, lag: float) -> tuple[Trial, Trial]:
    """A 15/15 zigzag with some steering gear, every 0.02 s and every 0.5 s of it."""
    geared = replace(model, steering=SteeringGear(40.0, rate, lag))
    fine = zigzag(geared, 15, 15, duration=300, dt=0.02)
    return fine, Trial(
        fine.t[::25], {name: fine[name][::25] for name in ("u", "v", "r", "delta")}
    )


GEARS = [(2.5, 0.0), (5.0, 0.0), (5.0, 0.4), (5.0, 1.0), (2.5, 2.5)]


@pytest.mark.parametrize(("rate", "lag"), GEARS)
def test_rate_and_lag_of_the_gear_are_found_from_its_samples(
    mariner: ShipModel, rate: float, lag: float
) -> None:
    _, coarse = fine_and_coarse(mariner, rate, lag)
    gear = estimated_gear([coarse])
    assert gear.rudder_rate_deg_s == pytest.approx(rate, rel=1e-6)
    assert gear.time_constant == pytest.approx(lag, rel=1e-3, abs=1e-9)
    assert gear.rudder_limit_deg == 35.0


@pytest.mark.parametrize(("rate", "lag"), GEARS)
def test_rudder_between_samples_is_known_to_a_thousandth_of_a_degree(
    mariner: ShipModel, rate: float, lag: float
) -> None:
    fine, coarse = fine_and_coarse(mariner, rate, lag)
    rebuilt = rebuild(coarse.t, coarse["delta"])
    assert rebuilt.follows_gear
    away = np.abs(rebuilt(fine.t) - fine["delta"])
    assert np.degrees(away.max()) < 2e-3
    straight = np.abs(np.interp(fine.t, coarse.t, coarse["delta"]) - fine["delta"])
    assert np.degrees(straight.max()) > 0.1


def test_corners_are_at_the_switches_and_at_the_ends_of_the_ramps(
    mariner: ShipModel,
) -> None:
    fine, coarse = fine_and_coarse(mariner, 5.0, 1.0)
    switches = np.flatnonzero(np.diff(fine["delta_command"])) + 1
    rebuilt = rebuild(coarse.t, coarse["delta"])
    jumps = rebuilt.corners[rebuilt.smoothness == 0]
    assert len(jumps) == len(switches)
    assert np.all(np.abs(jumps - fine.t[switches]) <= 0.021)
    ends = rebuilt.corners[rebuilt.smoothness == 1]
    assert np.all(np.abs(ends[-len(jumps) :] - jumps - 5.0) < 0.01)


def test_given_gear_that_contradicts_the_samples_is_not_believed(
    mariner: ShipModel,
) -> None:
    _, coarse = fine_and_coarse(mariner, 5.0, 1.0)
    rebuilt = rebuild(coarse.t, coarse["delta"], SteeringGear(35.0, 2.5, 0.0))
    assert np.degrees(rebuilt.rate) == pytest.approx(5.0, rel=1e-6)


def test_rudder_that_no_gear_explains_is_taken_straight() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(200.0)
    delta = 0.1 * np.sin(t / 9.0) + 0.01 * rng.standard_normal(200)
    rebuilt = rebuild(t, delta)
    assert not rebuilt.follows_gear
    assert rebuilt(10.25) == pytest.approx(0.75 * delta[10] + 0.25 * delta[11])


def test_a_gear_needs_eight_samples_for_each_change_of_order() -> None:
    t = np.arange(40.0)
    delta = np.radians(np.interp(t, [3, 13, 18, 28], [0, 10, 10, 0]))
    assert rebuild(t, delta).follows_gear
    sawtooth = np.radians(np.interp(t, np.arange(0.0, 40.0, 4.0), [0, 4] * 5))
    assert not rebuild(t, sawtooth).follows_gear


def test_limit_of_an_estimated_gear_is_the_largest_recorded_angle() -> None:
    t = np.linspace(0.0, 40.0, 81)
    delta = np.radians(np.clip(4.0 * t, 0.0, 42.0))
    still = np.zeros_like(t)
    gear = estimated_gear(
        [Trial(t, {"u": still + 5.0, "v": still, "r": still, "delta": delta})]
    )
    assert gear.rudder_limit_deg == pytest.approx(42.0)
    assert gear.rudder_rate_deg_s == pytest.approx(4.0)


def test_a_rudder_taken_straight_has_no_gear_and_no_corners() -> None:
    t = np.arange(5.0, 9.0)
    found = straight(t, np.array([0.0, 0.1, 0.3, 0.2]))
    assert (found.rate, found.time_constant, found.follows_gear) == (0.0, 0.0, False)
    for row in (
        found.before,
        found.after,
        found.switch,
        found.corners,
        found.smoothness,
    ):
        assert row.shape == (0,)
    assert found.smoothness.dtype == np.int64
    np.testing.assert_allclose(found([5.5, 6.25, 8.0]), [0.05, 0.15, 0.2])


def test_four_samples_are_the_fewest_that_a_gear_explains() -> None:
    """A ramp goes on; a rudder that never moved has no gear."""
    ramp, gear = 0.1 * np.arange(5.0), GearResponse(0.1, 0.0)
    shares = [gear.explained_share(np.arange(float(n)), ramp[:n]) for n in (3, 4, 5)]
    assert shares == [0.0, 1.0, 1.0]
    assert GearResponse(0.0, 0.0).explained_share(np.arange(5.0), ramp) == 0.0


@pytest.mark.parametrize(
    ("orders", "delta", "expected"),
    [
        ([np.inf, np.inf], [0.0, 0.1, 0.2], True),  # one ramp
        ([np.inf, -np.inf], [0.0, 0.1, 0.0], False),
        ([np.inf, 0.15], [0.0, 0.1, 0.15], True),  # it arrives
        ([np.inf, 0.1], [0.0, 0.1, 0.1], True),
        ([np.inf, 0.05], [0.0, 0.1, 0.05], False),
        ([-np.inf, -0.15], [0.0, -0.1, -0.15], True),
        ([-np.inf, -0.05], [0.0, -0.1, -0.05], False),
        ([0.1, 0.1009], [0.0, 0.1, 0.1009], True),  # within the tolerance
        ([0.1, 0.1015], [0.0, 0.1, 0.1015], False),
        ([0.1, np.inf], [0.0, 0.1, 0.2], False),  # from rest to a ramp
        ([0.0, np.inf], [0.0, 0.0, 0.1], False),
    ],
)
def test_an_order_goes_on_where_the_rudder_moves_as_before(
    orders: list[float], delta: list[float], expected: bool
) -> None:
    """Orders that differ by a thousandth of the rudder's range are one."""
    found = goes_on(np.array([*orders, 0.0]), np.array([*delta, delta[0] - 1.0]))
    assert found.tolist()[0] is expected


def test_an_order_changes_within_an_interval_when_the_rudder_ends_as_seen() -> None:
    """At rest for 29.7 s, then moving at 0.1 rad/s, seen every 2 s."""
    t = 2.0 * np.arange(31.0)
    fine = np.linspace(0.0, 60.0, 601)
    angles = 0.1 * np.maximum(fine - 29.7, 0.0)
    found = rebuild(t, np.interp(t, fine, angles))
    assert found.corners == pytest.approx([29.7], abs=1e-6)
    assert found.smoothness.tolist() == [0]
    np.testing.assert_allclose(found(fine), angles, atol=1e-6)


def test_a_gear_of_rate_and_lag_ramps_and_then_creeps() -> None:
    """0.1 rad/s and 2 s: to an order of 0.5 it ramps to 0.3, then exp(-t / 2)."""
    gear = GearResponse(0.1, 2.0)
    angles = gear.angle(0.0, 0.5, np.array([1.0, 3.0, 5.0]))
    np.testing.assert_allclose(angles, [0.1, 0.3, 0.5 - 0.2 * np.exp(-1.0)])
    ramping = gear.angle(0.0, -np.inf, np.array([1.0, 9.0]))
    np.testing.assert_allclose(ramping, [-0.1, -0.9])
    at_order = GearResponse(0.1, 0.0).angle(0.2, 0.2, np.array([4.0]))
    np.testing.assert_allclose(at_order, [0.2])
    t = np.array([0.0, 1.0, 3.0, 5.0])
    orders = gear.orders(t, gear.angle(0.0, 0.5, t))
    np.testing.assert_allclose(orders, [np.inf, np.inf, 0.5])


def test_no_rudder_goes_beyond_a_right_angle() -> None:
    t = np.linspace(0.0, 40.0, 81)
    still, delta = np.zeros_like(t), np.radians(np.clip(4.0 * t, 0.0, 110.0))
    gear = estimated_gear(
        [Trial(t, {"u": still + 5.0, "v": still, "r": still, "delta": delta})]
    )
    assert gear.rudder_limit_deg == 90.0
