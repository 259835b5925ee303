"""Linear steering: Mariner's published time constants, and small motions of the full
model.
"""

from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.signal import lsim

from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.models.linear import (
    StraightRunning,
    is_course_stable,
    linearise,
    nomoto,
    straight_running,
)

MARINER = load_model("mariner")
LENGTH, SPEED = MARINER.particulars["length"], MARINER.particulars["speed"]
PRIME_A = np.array([[LENGTH / SPEED, 1 / SPEED], [LENGTH**2 / SPEED, LENGTH / SPEED]])
PRIME_B = np.array([[LENGTH / SPEED**2], [LENGTH**2 / SPEED**2]])


def with_coefficients(factors=None, **values):
    changed = {
        name: MARINER.coefficients[name] * factor
        for name, factor in (factors or {}).items()
    }
    return replace(MARINER, coefficients={**MARINER.coefficients, **changed, **values})


COURSE_UNSTABLE = with_coefficients({"N_v": 1.7, "N_uv": 1.7})


def test_linear_coefficients_of_mariner_are_those_of_its_derivatives():
    A, B = linearise(MARINER, StraightRunning(SPEED, 0.0, 0.0))
    inertia = np.array(
        [[798 + 748, 798 * -0.023 + 9.354], [798 * -0.023 - 4.646, 39.2 + 43.8]]
    )
    forces = np.array([[-1160.0, -499.0, -278.0], [-264.0, -166.0, 139.0]])
    expected = np.linalg.solve(inertia, forces)
    np.testing.assert_allclose(A * PRIME_A, expected[:, :2], rtol=1e-6)
    np.testing.assert_allclose(B * PRIME_B, expected[:, 2:], rtol=1e-6)
    np.testing.assert_allclose(
        A * PRIME_A, [[-0.770, -0.335], [-3.394, -2.093]], atol=6e-4
    )
    np.testing.assert_allclose(B * PRIME_B, [[-0.170], [1.627]], atol=6e-4)


def test_mariner_runs_straight_with_one_degree_of_port_rudder():
    neutral = straight_running(MARINER)
    # Y_v v + Y_d d = -Y_0, N_v v + N_d d = -N_0
    sway, rudder = np.linalg.solve([[-1160.0, -278.0], [-264.0, 139.0]], [4.0, -3.0])
    assert neutral.rudder == pytest.approx(rudder, rel=2e-3)
    assert neutral.sway == pytest.approx(sway * SPEED, rel=2e-3)
    assert np.degrees(neutral.rudder) == pytest.approx(-1.11, abs=0.01)
    trial = MARINER.simulate(
        np.full((2000, 1), neutral.rudder), 0.5, neutral.state(MARINER)
    )
    assert np.abs(trial["psi"]).max() < 1e-8


def test_time_constants_of_mariner_are_the_published_ones():
    """Fossen 2011, table 7.2, after Chislett & Strom-Tejsen 1965."""
    found = nomoto(MARINER)
    published = {
        "K": 0.185,
        "T1": 118.0,
        "T2": 7.8,
        "T3": 18.5,
        "T": 118.0 + 7.8 - 18.5,
    }
    assert asdict(found) == pytest.approx(published, rel=5e-3)
    assert found.rudder_effect == pytest.approx(
        published["K"] / published["T"], rel=5e-3
    )
    assert is_course_stable(MARINER)


@pytest.mark.parametrize(
    "model", [MARINER, COURSE_UNSTABLE], ids=["stable", "unstable"]
)
def test_small_rudder_steps_follow_the_transfer_function(model):
    neutral, found, dt, n = straight_running(model), nomoto(model), 0.1, 600
    step, lag = np.radians(0.02), model.steering.time_constant
    state = [0.0, 0.0, 0.0, neutral.surge, neutral.sway, 0.0, neutral.rudder]
    trial = model.simulate(np.full((n, 1), neutral.rudder + step), dt, state)
    denominator = np.polymul(np.polymul([found.T1, 1.0], [found.T2, 1.0]), [lag, 1.0])
    _, r, _ = lsim(
        ([found.K * found.T3, found.K], denominator), np.full(n + 1, step), trial.t
    )
    assert trial["r"][-1] > 0.0  # rudder to starboard turns to starboard
    assert np.abs(trial["r"] - r).max() < 2e-3 * np.abs(r).max()


def test_a_ship_unstable_on_its_course_has_negative_gain_and_time_constant():
    found = nomoto(COURSE_UNSTABLE)
    assert not is_course_stable(COURSE_UNSTABLE)
    assert found.K < 0.0
    assert found.T < 0.0
    assert found.T1 < 0.0 < found.T2
    assert found.rudder_effect == pytest.approx(nomoto(MARINER).rudder_effect, rel=0.05)
    neutral = straight_running(COURSE_UNSTABLE)
    state = [0.0, 0.0, 0.0, neutral.surge, neutral.sway, 1e-6, neutral.rudder]
    trial = COURSE_UNSTABLE.simulate(np.full((1000, 1), neutral.rudder), 0.5, state)
    growth = np.log(trial["r"][-1] / trial["r"][400]) / (trial.t[-1] - trial.t[400])
    assert growth == pytest.approx(-1.0 / found.T1, rel=0.02)


@pytest.mark.parametrize("name", ["container", "kvlcc2"])
def test_the_other_ships_run_straight_and_answer_small_rudder_as_linearised(name):
    """Roll follows the turn.

    The rudder of KVLCC2 works differently in turns to either side.
    """
    model = load_model(name)
    neutral, found = straight_running(model), nomoto(model)
    length, speed = model.particulars["length"], model.particulars["speed"]
    dt, n, order = 0.01 * length / speed, 300, np.radians(0.02)
    commands = np.tile(model.service_command, (n, 1))
    commands[:, 0] = neutral.rudder
    straight = model.simulate(commands, dt, neutral.state(model))
    assert np.abs(straight["psi"]).max() < 1e-7
    denominator = np.polymul([found.T1, 1.0], [found.T2, 1.0])
    turns = []
    for side in (1.0, -1.0):
        commands[:, 0] = neutral.rudder + side * order
        trial = model.simulate(commands, dt, neutral.state(model))
        rudder = trial["delta"] - neutral.rudder
        _, r, _ = lsim(([found.K * found.T3, found.K], denominator), rudder, trial.t)
        turns.append(trial["r"][-1] / r[-1])
    assert min(turns) > 0.8  # a rudder to starboard turns to starboard
    assert np.mean(turns) == pytest.approx(1.0, abs=0.03)


def test_a_model_without_straight_course_is_refused_by_name():
    with pytest.raises(
        InputError,
        match=r"model 'mariner': expected a straight course with less than 20 deg",
    ):
        straight_running(with_coefficients(N_0=0.01))
