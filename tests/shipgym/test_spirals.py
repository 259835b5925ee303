"""Spirals and pull-outs: which ships keep a straight course by themselves."""

import numpy as np
import pytest

from shipgym import InputError, Trial, load_model, manoeuvres
from shipgym.manoeuvres import Spiral

STILL = Trial(np.arange(50.0), {"delta": np.zeros(50), "r": np.zeros(50)})


@pytest.mark.parametrize(
    ("name", "width_deg", "height_deg_s"),
    [("mariner", 0.0, 0.0), ("tanker", 0.78, 0.314), ("kvlcc2", 0.39, 0.184)],
)
def test_the_tankers_have_a_loop_known_to_the_steps_of_the_rudder(
    name, width_deg, height_deg_s
):
    found = manoeuvres.spiral_indices(manoeuvres.direct_spiral(load_model(name)))
    step = 0.25 if width_deg else 1e-3
    assert found.loop_width_deg == pytest.approx(width_deg, abs=step)
    assert found.loop_height_deg_s == pytest.approx(height_deg_s, abs=0.005)


def test_a_loop_drawn_by_hand():
    """Jumps between 2 and 4 deg: 6 deg wide, 2 * 0.5 deg/s high at rudder 0."""
    angles = np.array([10, 4, 0, -2, -4, -10, -4, 0, 2, 4, 10], dtype=float)
    rates = np.array([1, 0.7, 0.5, 0.4, -0.4, -1, -0.7, -0.5, -0.4, 0.4, 1])
    indices = manoeuvres.spiral_indices(Spiral(STILL, angles, rates))
    assert indices.loop_width_deg == pytest.approx(6.0)
    assert indices.loop_height_deg_s == pytest.approx(1.0)
    assert manoeuvres.spiral_indices(Spiral(STILL, -angles, -rates)) == indices


def test_pull_outs_end_alike_only_for_a_stable_ship():
    """Mariner is left with 0.17 deg/s to starboard, KVLCC2 in her turn to port."""
    ends = {"mariner": [0.170, 0.170], "kvlcc2": [0.0, -0.173]}
    for name, rates in ends.items():
        runs = [manoeuvres.pull_out(load_model(name), side) for side in (20, -20)]
        found = [manoeuvres.pull_out_indices(run).residual_rate_deg_s for run in runs]
        assert found == pytest.approx(rates, abs=1e-3)


def test_the_turn_of_a_pull_out_is_that_of_the_spiral():
    model = load_model("mariner")
    spiral = manoeuvres.direct_spiral(model, [20, 0, -20])
    indices = manoeuvres.pull_out_indices(manoeuvres.pull_out(model, 20))
    assert indices.turning_rate_deg_s == pytest.approx(
        spiral.yaw_rate_deg_s[0], abs=1e-3
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: manoeuvres.direct_spiral(m, [10, 5, 0]), "one side to the other"),
        (lambda m: manoeuvres.direct_spiral(m, [10, 12, -10]), "rise or fall"),
        (lambda m: manoeuvres.direct_spiral(m, [50, 0, -50]), r"rudder_deg\[0\]: .*50"),
        (lambda m: manoeuvres.direct_spiral(m, dt=-1.0), "dt: expected .*got -1"),
        (lambda m: manoeuvres.pull_out(m, 0.0), "an angle that turns the ship"),
        (lambda m: manoeuvres.pull_out(m, 60.0), "rudder_deg: expected .*got 60"),
        (lambda m: manoeuvres.pull_out_indices(STILL), "got no pull-out"),
        (
            lambda m: manoeuvres.spiral_indices(
                Spiral(STILL, np.array([1.0, 0, -1]), np.array([1.0, 0.1, -1.0]))
            ),
            "got rudder angles that go one way only",
        ),
        (
            lambda m: manoeuvres.spiral_indices(
                Spiral(STILL, np.array([1.0, 0, -1]), np.array([1.0, 0.5, 0.1]))
            ),
            "turns to both sides",
        ),
    ],
)
def test_what_is_no_spiral_or_pull_out_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call(load_model("mariner"))


def test_the_rudder_of_a_pull_out_is_amidships_below_half_of_what_it_was():
    t = np.arange(100.0)
    rate = np.radians(np.where(t < 50.0, 0.5 + 0.01 * t, 0.2 - 0.001 * t))
    for middle, end_of_turn in ((0.16, 60), (0.14, 50)):
        delta = np.r_[np.full(50, -0.3), np.full(10, -middle), np.zeros(40)]
        found = manoeuvres.pull_out_indices(Trial(t, {"delta": delta, "r": rate}))
        last = slice(end_of_turn - end_of_turn // 10, end_of_turn)
        assert found.turning_rate_deg_s == pytest.approx(np.degrees(rate)[last].mean())
