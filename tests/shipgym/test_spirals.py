"""Spirals and pull-outs: which ships keep a straight course by themselves."""

import numpy as np
import pytest

from shipgym import InputError, Trial, load_model, manoeuvres
from shipgym.manoeuvres import Spiral
from shipgym.manoeuvres.settling import Voyage
from shipgym.models.simulate import Conditions


@pytest.mark.parametrize(
    ("name", "width_deg", "height_deg_s"),
    [
        ("mariner", 0.0, 0.0),
        ("container", 0.0, 0.0),
        ("tanker", 0.78, 0.314),
        ("kvlcc2", 0.39, 0.184),
    ],
)
def test_both_spirals_find_the_loop(name, width_deg, height_deg_s):
    """The tankers are unstable.

    The direct spiral knows the loop to within its steps of 0.25 deg.
    """
    model = load_model(name)
    direct = manoeuvres.spiral_indices(manoeuvres.direct_spiral(model))
    reverse = manoeuvres.spiral_indices(manoeuvres.reverse_spiral(model))
    assert reverse.loop_width_deg == pytest.approx(width_deg, abs=0.01)
    assert reverse.loop_height_deg_s == pytest.approx(height_deg_s, abs=0.002)
    assert direct.loop_width_deg == pytest.approx(
        reverse.loop_width_deg, abs=0.25 if width_deg else 1e-3
    )
    assert direct.loop_height_deg_s == pytest.approx(
        reverse.loop_height_deg_s, abs=0.005
    )


def test_both_spirals_are_the_same_curve_for_a_stable_ship():
    model = load_model("mariner")
    direct, reverse = manoeuvres.direct_spiral(model), manoeuvres.reverse_spiral(model)
    order = np.argsort(reverse.yaw_rate_deg_s)
    there = np.abs(direct.rudder_deg) <= 2.0
    rudder = np.interp(
        direct.yaw_rate_deg_s[there],
        reverse.yaw_rate_deg_s[order],
        reverse.rudder_deg[order],
    )
    np.testing.assert_allclose(rudder, direct.rudder_deg[there], atol=0.02)


def test_a_point_of_the_reverse_spiral_is_an_equilibrium():
    """Also where the tanker would not stay by itself.

    At r = 0 it needs 0.5 deg against its propeller.
    """
    model = load_model("tanker")
    spiral = manoeuvres.reverse_spiral(model)
    straight = spiral.rudder_deg[np.argmin(np.abs(spiral.yaw_rate_deg_s))]
    assert straight == pytest.approx(0.50, abs=0.01)
    state, command = model.service_state.copy(), model.service_command
    state[model.state_names.index("delta")] = np.radians(straight)
    thrust_and_rudder = model.derivatives(state, command)[model.state_names.index("r")]
    amidships = model.derivatives(model.service_state, command)[
        model.state_names.index("r")
    ]
    assert abs(thrust_and_rudder) < abs(amidships)


def test_a_measured_spiral_gives_the_same_points():
    """Without orders, the plateaus are found in the rudder itself."""
    spiral = manoeuvres.direct_spiral(load_model("tanker"), [10, 5, 1, 0, -1, -5, -10])
    orders = manoeuvres.spiral_from_trial(spiral.trial)
    np.testing.assert_allclose(orders.rudder_deg, spiral.rudder_deg)
    np.testing.assert_allclose(orders.yaw_rate_deg_s, spiral.yaw_rate_deg_s, atol=2e-3)
    channels = {name: spiral.trial[name] for name in ("delta", "r")}
    seen = manoeuvres.spiral_from_trial(Trial(spiral.trial.t, channels))
    np.testing.assert_allclose(seen.rudder_deg, spiral.rudder_deg, atol=0.01)
    np.testing.assert_allclose(seen.yaw_rate_deg_s, spiral.yaw_rate_deg_s, atol=2e-3)
    seen_width = manoeuvres.spiral_indices(seen).loop_width_deg
    assert seen_width == pytest.approx(
        manoeuvres.spiral_indices(spiral).loop_width_deg, abs=0.02
    )


def test_a_plateau_counts_from_a_tenth_of_the_longest_on_with_its_last_third():
    """Held for 100, 10, 50, 9 and 30 s; the yaw rate is steady in the last third."""
    counts, angles = [101, 11, 51, 10, 31], np.array([10.0, 5.0, 0.0, -5.0, -10.0])
    settling = [np.arange(n) < n - n // 3 for n in counts]
    rate = np.where(np.concatenate(settling), 9.0, np.repeat(angles, counts))
    channels = {
        "delta_command": np.radians(np.repeat(angles, counts)),
        "r": np.radians(rate),
    }
    found = manoeuvres.spiral_from_trial(Trial(np.arange(204.0), channels))
    kept = [10.0, 5.0, 0.0, -10.0]
    assert found.rudder_deg == pytest.approx(kept)
    assert found.yaw_rate_deg_s == pytest.approx(kept)


def test_a_loop_drawn_by_hand():
    """Jumps between 2 and 4 deg either side.

    6 deg wide; 2 * 0.5 deg/s high at rudder 0.
    """
    angles = np.array([10, 4, 0, -2, -4, -10, -4, 0, 2, 4, 10], dtype=float)
    rates = np.array([1, 0.7, 0.5, 0.4, -0.4, -1, -0.7, -0.5, -0.4, 0.4, 1])
    trial = Trial([0, 1, 2], {"r": [0, 0, 0]})
    indices = manoeuvres.spiral_indices(Spiral(trial, angles, rates, "direct"))
    assert indices.loop_width_deg == pytest.approx(6.0)
    assert indices.loop_height_deg_s == pytest.approx(1.0)
    mirrored = manoeuvres.spiral_indices(Spiral(trial, -angles, -rates, "direct"))
    assert mirrored == indices


def test_a_fold_drawn_by_hand():
    """delta = r^3 - 3 r folds at r = -1 and 1, delta = 2 and -2.

    It meets 0 at r = -sqrt(3) and sqrt(3).
    """
    rates = np.linspace(-3.0, 3.0, 61)
    trial = Trial([0, 1, 2], {"r": [0, 0, 0]})
    indices = manoeuvres.spiral_indices(
        Spiral(trial, rates**3 - 3.0 * rates, rates, "reverse")
    )
    assert indices.loop_width_deg == pytest.approx(4.0, rel=1e-3)
    assert indices.loop_height_deg_s == pytest.approx(2.0 * np.sqrt(3.0), rel=1e-3)


def test_pull_outs_end_alike_only_for_a_stable_ship():
    """Mariner is left with 0.17 deg/s to starboard from either side.

    KVLCC2 stays in its turn to port.
    """
    ends = {
        name: [
            manoeuvres.pull_out_indices(
                manoeuvres.pull_out(load_model(name), side)
            ).residual_rate_deg_s
            for side in (20, -20)
        ]
        for name in ("mariner", "container", "kvlcc2")
    }
    assert ends["mariner"] == pytest.approx([0.170, 0.170], abs=1e-3)
    assert ends["container"] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert ends["kvlcc2"] == pytest.approx([0.0, -0.173], abs=1e-3)


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
        (
            lambda m: manoeuvres.direct_spiral(m, [10, 5, 0]),
            "rudder_deg: .* from one side to the other",
        ),
        (lambda m: manoeuvres.direct_spiral(m, [10, 12, -10]), "rise or fall"),
        (
            lambda m: manoeuvres.direct_spiral(m, [50, 0, -50]),
            r"rudder_deg\[0\]: expected .*got 50",
        ),
        (lambda m: manoeuvres.direct_spiral(m, dt=-1.0), "dt: expected .*got -1"),
        (lambda m: manoeuvres.reverse_spiral(m, [1, 0.5]), "yaw_rate_deg_s: "),
        (
            lambda m: manoeuvres.pull_out(m, 0.0),
            "expected an angle that turns the ship",
        ),
        (lambda m: manoeuvres.pull_out(m, 60.0), "rudder_deg: expected .*got 60"),
    ],
)
def test_wrong_arguments(call, message):
    with pytest.raises(InputError, match=message):
        call(load_model("mariner"))


def test_a_tolerance_and_a_method_that_are_none_are_refused():
    t = np.arange(50.0)
    still = Trial(t, {"delta": np.zeros(50), "r": np.zeros(50)})
    with pytest.raises(InputError, match=r"tolerance_deg: expected .*got 0"):
        manoeuvres.spiral_from_trial(still, tolerance_deg=0.0)
    with pytest.raises(InputError, match=r"spiral method: expected .*got 'dirct'"):
        manoeuvres.spiral_indices(
            Spiral(still, np.array([1.0, 0, -1]), np.array([1.0, 0.5, -0.1]), "dirct")
        )


def test_what_a_trial_lacks_is_named():
    t = np.arange(50.0)
    still = Trial(t, {"delta": np.zeros(50), "r": np.zeros(50)})
    with pytest.raises(InputError, match="'r' is missing"):
        manoeuvres.spiral_from_trial(Trial(t, {"delta": np.zeros(50)}))
    with pytest.raises(InputError, match="got 1 steady turns"):
        manoeuvres.spiral_from_trial(still)
    with pytest.raises(InputError, match="got no pull-out"):
        manoeuvres.pull_out_indices(still)
    with pytest.raises(InputError, match="got rudder angles that go one way only"):
        manoeuvres.spiral_indices(
            Spiral(still, np.array([1.0, 0, -1]), np.array([1.0, 0.1, -1.0]), "direct")
        )
    with pytest.raises(InputError, match="turns to both sides"):
        manoeuvres.spiral_indices(
            Spiral(still, np.array([1.0, 0, -1]), np.array([1.0, 0.5, 0.1]), "direct")
        )


def test_the_rudder_of_a_pull_out_is_amidships_below_half_of_what_it_was():
    t = np.arange(100.0)
    rate = np.radians(np.where(t < 50.0, 0.5 + 0.01 * t, 0.2 - 0.001 * t))
    for middle, end_of_turn in ((0.16, 60), (0.14, 50)):
        delta = np.r_[np.full(50, -0.3), np.full(10, -middle), np.zeros(40)]
        found = manoeuvres.pull_out_indices(Trial(t, {"delta": delta, "r": rate}))
        last = slice(end_of_turn - end_of_turn // 10, end_of_turn)
        assert found.turning_rate_deg_s == pytest.approx(np.degrees(rate)[last].mean())
        rest = np.degrees(rate)[end_of_turn:]
        assert found.residual_rate_deg_s == pytest.approx(
            rest[-(len(rest) // 10) :].mean()
        )


def test_the_end_of_a_turn_of_few_samples_is_its_last_one():
    delta = np.r_[np.zeros(20), np.full(5, 0.3), np.zeros(30)]
    rate = np.r_[np.zeros(20), 0.01, 0.02, 0.03, 0.04, 0.05, np.linspace(0.05, 0.0, 30)]
    found = manoeuvres.pull_out_indices(
        Trial(np.arange(55.0), {"delta": delta, "r": rate})
    )
    assert found.turning_rate_deg_s == pytest.approx(np.degrees(0.05))
    assert found.residual_rate_deg_s == pytest.approx(np.degrees(rate[-3:].mean()))


def test_a_leg_ends_after_sixty_stretches_of_five_lengths_steady_or_not(monkeypatch):
    voyage = Voyage(load_model("mariner"), None, Conditions())
    gone = []

    def go(sail, n_steps):
        gone.append(n_steps)
        return np.full((n_steps, 7), 0.001 * len(gone)), np.full((n_steps, 2), 0.3)

    monkeypatch.setattr(voyage, "go", go)
    assert voyage.settle(None) == pytest.approx((0.3, 0.06))
    assert gone == [200] * 60  # forty steps a length


@pytest.mark.parametrize(("change", "stretches"), [(1.9e-5, 2), (2.1e-5, 60)])
@pytest.mark.parametrize("what", ["u", "v", "r", "rudder"])
def test_a_motion_is_steady_where_nothing_changes_by_two_parts_in_100_000(
    what, change, stretches, monkeypatch
):
    """Speeds by that of service, yaw rate by that of service over the length, the
    rudder in rad.
    """
    ship = load_model("mariner")
    length, speed = ship.particulars["length"], ship.particulars["speed"]
    unit = {"u": speed, "v": speed, "r": speed / length, "rudder": 1.0}[what]
    voyage, gone = Voyage(ship, None, Conditions()), []

    def go(sail, n_steps):
        states, commands = np.zeros((n_steps, 7)), np.zeros((n_steps, 2))
        gone.append(n_steps)
        if what == "rudder":
            commands[:, 0] = len(gone) * change
        else:
            states[:, ship.state_names.index(what)] = len(gone) * change * unit
        return states, commands

    monkeypatch.setattr(voyage, "go", go)
    voyage.settle(None)
    assert len(gone) == stretches


def test_points_of_a_spiral_near_the_angles_asked_for_are_kept():
    t = np.arange(250.0)
    angles = np.repeat([10.0, 4.6, 4.4, 0.0, -10.0], 50)
    trial = Trial(
        t, {"delta_command": np.radians(angles), "r": np.radians(0.1 * angles)}
    )
    found = manoeuvres.spiral_from_trial(trial, [10.0, 5.0, 0.0, -10.0])
    assert found.rudder_deg == pytest.approx([10.0, 4.6, 0.0, -10.0])
    every = manoeuvres.spiral_from_trial(
        trial, [10.0, 5.0, 0.0, -10.0], tolerance_deg=0.7
    )
    assert every.rudder_deg == pytest.approx([10.0, 4.6, 4.4, 0.0, -10.0])
