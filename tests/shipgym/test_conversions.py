"""Conversions between linear steering forms, and straight-line stability."""

from dataclasses import replace

import control
import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lsim

import shipgym
from shipgym import (
    InputError,
    Particulars,
    SteeringGear,
    Trial,
    straight_line_stability,
)
from shipgym.models.conversions import (
    Nomoto,
    linear_steering_ship,
    nomoto,
    nomoto1_ship,
    nomoto2_ship,
    nomoto_of,
    prime_matrices,
    si_matrices,
    state_space,
    steering_state_space,
    transfer_function,
)
from shipgym.models.ship_model import ShipModel
from shipgym.models.simulate import open_loop

pytestmark = pytest.mark.interpreted

MARINER = shipgym.load_model("mariner")
SHIP = Particulars(length=160.93, speed=7.7175)
FORM = Nomoto(
    K=0.185, T1=118.0, T2=7.8, T3=18.5, T=107.3
)  # Mariner, Fossen 2011, table 7.2


def same(found: Nomoto, expected: Nomoto, rel: float = 1e-9) -> None:
    for name in ("K", "T1", "T2", "T3", "T"):
        assert getattr(found, name) == pytest.approx(
            getattr(expected, name), rel=rel
        ), name


@pytest.mark.parametrize("lag", [1.0, 2.5])
def test_state_space_has_the_ship_s_states_by_name_and_nomoto_s_response(lag):
    ship = replace(MARINER, steering=replace(MARINER.steering, time_constant=lag))
    plant = state_space(ship, heading=True, gear=True)
    assert plant.state_labels == ["v", "r", "psi", "delta"]
    assert plant.input_labels == ["delta_command"]
    form = nomoto(MARINER)
    s = 1j * np.geomspace(1e-3, 1.0, 7)
    yaw = (
        form.K
        * (1 + form.T3 * s)
        / ((1 + form.T1 * s) * (1 + form.T2 * s))
        / (1 + lag * s)
    )
    np.testing.assert_allclose(plant(s)[1, 0], yaw, rtol=1e-9)
    np.testing.assert_allclose(plant(s)[2, 0], yaw / s, rtol=1e-9)
    np.testing.assert_allclose(
        transfer_function(form)(s) / (1 + lag * s), yaw, rtol=1e-9
    )
    assert transfer_function(form, 1).dcgain() == pytest.approx(form.K)


@settings(max_examples=30, deadline=None)
@given(
    st.floats(0.01, 0.5),
    st.floats(20.0, 300.0),
    st.floats(2.0, 15.0),
    st.floats(1.0, 60.0),
    st.booleans(),
)
def test_nomoto_survives_the_way_to_a_ship_and_back(K, T1, T2, T3, stable):
    """Also for a ship unstable on her course: K and T1 negative."""
    sign = 1.0 if stable else -1.0
    form = Nomoto(sign * K, sign * T1, T2, T3, sign * T1 + T2 - T3)
    ship = nomoto2_ship(form, SHIP)
    same(nomoto(ship), form, 1e-6)
    stability = straight_line_stability(ship)
    assert stability.stable is stable
    assert stability.criterion is None


def test_nomoto_of_first_order_survives_the_way_to_a_ship_and_back():
    found = nomoto(nomoto1_ship(0.185, 107.3, SHIP))
    np.testing.assert_allclose([found.K, found.T], [0.185, 107.3], rtol=1e-6)


def test_the_ship_of_a_linear_form_has_that_form():
    A, B = steering_state_space(MARINER)
    ship = linear_steering_ship(A, B, MARINER.particulars, MARINER.steering)
    again = steering_state_space(ship)
    np.testing.assert_allclose(again[0], A, rtol=1e-6)
    np.testing.assert_allclose(again[1], B, rtol=1e-6)
    same(nomoto(ship), nomoto(MARINER), 1e-6)
    prime = prime_matrices(A, B, 160.93, 7.7175)
    np.testing.assert_allclose(
        [*prime[0].ravel(), *prime[1].ravel()],
        [
            ship.coefficients[name]
            for name in ("b_v", "b_r", "c_v", "c_r", "b_d", "c_d")
        ],
    )
    for back, given_ in zip(si_matrices(*prime, 160.93, 7.7175), (A, B), strict=True):
        np.testing.assert_allclose(back, given_, rtol=1e-12)


def test_a_scaled_ship_has_the_same_prime_form():
    """Froude: K of a model at 1:25 is 5 times that of the ship, T a fifth."""
    model = shipgym.scale_model(MARINER, MARINER.particulars.length / 25.0)
    small, full = nomoto(model), nomoto(MARINER)
    np.testing.assert_allclose(
        [small.K, small.T], [5.0 * full.K, full.T / 5.0], rtol=1e-6
    )
    of_nomoto2 = nomoto(
        shipgym.scale_model(nomoto2_ship(FORM, SHIP), SHIP.length / 25.0)
    )
    found = [of_nomoto2.K, of_nomoto2.T1, of_nomoto2.T3]
    np.testing.assert_allclose(found, [5.0 * 0.185, 118.0 / 5.0, 18.5 / 5.0], rtol=1e-6)


def test_a_nomoto_ship_follows_her_transfer_function_in_any_manoeuvre():
    """Large angles too: the equation is linear, second order in yaw, without sway."""
    ship = nomoto2_ship(FORM, SHIP, SteeringGear(35.0, 3.0, 0.0))
    orders = np.repeat([0.3, -0.2, 0.5, 0.0], 400)[:, None]
    trial = ship.simulate(orders, 0.1)
    system = ([FORM.K * FORM.T3, FORM.K], np.polymul([FORM.T1, 1.0], [FORM.T2, 1.0]))
    _, r, _ = lsim(system, trial["delta"], trial.t)
    np.testing.assert_allclose(
        trial["r"], r, atol=1e-4 * np.abs(r).max()
    )  # lsim: straight between samples
    assert "q" not in trial
    np.testing.assert_array_equal(trial["v"], 0.0)


def test_a_record_of_a_steady_turn_goes_on_as_one():
    """Its first sample has no memory of yaw, and is taken for a steady yaw rate."""
    constant = {
        "u": SHIP["speed"],
        "v": 0.0,
        "r": 0.2 * FORM.K,
        "psi": 0.0,
        "delta": 0.2,
    }
    record = Trial(
        np.arange(50.0), {name: np.full(50, value) for name, value in constant.items()}
    )
    np.testing.assert_allclose(
        open_loop(nomoto2_ship(FORM, SHIP), record)["r"], record["r"], rtol=1e-9
    )


def test_an_environment_sails_the_same_ship_of_second_order():
    ship = nomoto2_ship(FORM, SHIP)
    env = gymnasium.make("shipgym/CourseKeeping-v0", model=ship).unwrapped
    env.reset(seed=1)
    start = [env.physical_state()[name] for name in ship.state_names]
    commands = np.sin(np.arange(60.0))[:, None].astype(np.float32) * np.float32(0.5)
    for command in commands:
        env.step(command)
    trial = ship.simulate(commands * ship.steering.limit, env.dt, start)
    for name in ("psi", "r", "delta"):
        assert env.physical_state()[name] == pytest.approx(
            trial[name][-1], rel=1e-5, abs=1e-7
        )
    assert env.physical_state()["q"] != 0.0


def test_nomoto2_survives_its_file_and_is_sound(tmp_path):
    ship = nomoto2_ship(FORM, SHIP)
    assert ship.state_names == ("x", "y", "psi", "u", "v", "r", "q", "delta")
    ship.save(tmp_path / "ship.json")
    again = ShipModel.load(tmp_path / "ship.json")
    same(nomoto(again), FORM)
    check = shipgym.check_ship_model(again)
    assert check.ok, str(check)
    assert check.asymmetry < 1e-12


@pytest.mark.parametrize(
    ("name", "unstable"),
    [
        ("mariner", ()),
        ("container", ()),
        ("tanker", ("starboard", "port")),
        ("kvlcc2", ("port",)),
    ],
)
def test_straight_line_stability_is_as_the_literature_has_it(name, unstable):
    """Mariner and S175 hold their course, the Esso tanker does not.

    Van Berlekom & Goddard 1972.

    KVLCC2 is called unstable (SIMMAN 2008). Her MMG model of 2015 has another flow at
    the rudder to either side, and at service speed is unstable in the smallest turns to
    port alone.
    """
    found = straight_line_stability(shipgym.load_model(name))
    assert found.unstable_sides == unstable
    assert found.stable is (not unstable)
    assert found.criterion is not None
    assert (
        tuple(side for side, value in found.criterion.items() if value < 0.0)
        == unstable
    )


def test_the_criterion_of_mariner_is_that_of_her_derivatives():
    """C = Y_v (N_r - m xG) - N_v (Y_r - m), where Mariner's table includes the mass."""
    expected = (-1160.0 * -166.0 - -264.0 * -499.0) * 1e-10
    symmetric = replace(
        MARINER,
        coefficients={
            n: 0.0 if n[2] == "0" else value
            for n, value in MARINER.coefficients.items()
        },
    )
    found = straight_line_stability(symmetric)
    assert found.criterion == pytest.approx(
        {"starboard": expected, "port": expected}, rel=1e-3
    )
    assert found.index == pytest.approx(
        control.poles(state_space(symmetric)).real.max(), rel=1e-3
    )


def test_what_has_no_such_form_is_refused():
    with pytest.raises(InputError, match="complex pair"):
        nomoto2_ship(
            nomoto_of(np.array([[-1.0, -2.0], [2.0, -1.0]]), np.array([[0.0], [1.0]])),
            SHIP,
        )
    with pytest.raises(InputError, match="K and T: expected both positive"):
        nomoto1_ship(-0.1, 50.0, SHIP)
    with pytest.raises(InputError, match="got no lag"):
        state_space(replace(MARINER, steering=SteeringGear(35.0, 5.0, 0.0)), gear=True)
    with pytest.raises(
        InputError, match=r"B: expected finite numbers of shape \(2, 1\)"
    ):
        linear_steering_ship(np.eye(2), [1.0, 2.0], SHIP)
    for missing in ("K", "T1", "T2"):
        form = replace(Nomoto(0.1, 10.0, 40.0, 5.0, 20.0), **{missing: 0.0})
        with pytest.raises(InputError, match="expected K, T1 and T2 other than 0"):
            nomoto2_ship(form, Particulars(length=100.0, speed=5.0))
    with pytest.raises(
        InputError, match=r"A: expected finite numbers of shape \(2, 2\)"
    ):
        si_matrices(np.full((2, 2), np.nan), np.zeros((2, 1)), 100.0, 5.0)
    for size in ((0.0, 5.0), (100.0, -1.0)):
        with pytest.raises(InputError, match="expected a number > 0"):
            si_matrices(np.eye(2), np.zeros((2, 1)), *size)
    with pytest.raises(InputError, match="order: expected 2 or 1, got 3"):
        transfer_function(FORM, 3)
