"""Manoeuvres and their indices."""

import numpy as np
import pytest

import shipgym
from shipgym import InputError, ManoeuvreError, Trial, load_model, manoeuvres


@pytest.fixture(scope="module")
def mariner():
    return shipgym.load_model("mariner")


def test_the_rudder_reverses_at_the_very_heading(mariner):
    """With the switch inside a step it does not matter where the steps lie."""
    coarse = manoeuvres.zigzag(mariner, 20, 20, dt=0.5)
    fine = manoeuvres.zigzag(mariner, 20, 20, dt=0.05)
    np.testing.assert_allclose(coarse["psi"], fine["psi"][::10], atol=2e-4)
    on_steps = manoeuvres.zigzag(mariner, 20, 20, dt=0.5, switch="step")
    assert np.abs(on_steps["psi"] - fine["psi"][::10]).max() > 1e-3


@pytest.fixture(scope="module")
def triangle() -> Trial:
    """A zigzag drawn by hand, 1 deg/s.

    Reversals at 10 and -10 deg, the heading turns back at 16 and -18.
    """
    corners = np.array([(0, 0), (5, 0), (21, 16), (55, -18), (100, 27)], dtype=float)
    t = np.arange(0.0, 100.5, 0.5)
    psi = np.interp(t, *corners.T)
    rudder = np.where(t < 5, 0.0, np.where(t < 15, 10.0, np.where(t < 47, -10.0, 10.0)))
    channels = {
        "psi": np.radians(psi),
        "delta": np.radians(rudder),
        "u": np.full(201, 4.0),
        "v": np.zeros(201),
    }
    return Trial(t, channels, length=20.0)


def test_indices_of_a_zigzag_drawn_by_hand(triangle):
    indices = manoeuvres.zigzag_indices(triangle)
    assert indices.overshoot_1_deg == pytest.approx(6.0)
    assert indices.overshoot_2_deg == pytest.approx(8.0)
    assert indices.initial_turning_lengths == pytest.approx(10.0 * 4.0 / 20.0, rel=0.06)
    assert indices.period_s is None


@pytest.mark.parametrize(
    ("rudder", "reversal", "seen", "ordered"),
    [(20, 2.5, 24, 20), (20, 40.0, 25, 25), (10, 1.5, 13.6, 10)],
)
def test_a_rudder_moves_after_the_heading_of_its_order(rudder, reversal, seen, ordered):
    """A zigzag is named by the heading of the order: fast boats turn on meanwhile."""
    t = np.arange(-5.0, 3.0 * reversal, 0.1)
    psi = np.interp(t, [0.0, reversal, t[-1]], [0.0, seen, -seen])
    sides = (t >= 0.0) - 2.0 * (t >= reversal)
    trial = Trial(t, {"psi": np.radians(psi), "delta": np.radians(rudder * sides)})
    assert manoeuvres.switch_heading_deg(trial) == ordered


def test_a_perfect_circle():
    """R = 300 m at 6 m/s from the start, until the rudder is released.

    Advance R, transfer R, tactical and steady diameter 2 R.
    """
    t = np.arange(0.0, 700.0, 0.5)
    psi = t * 6.0 / 300.0
    held = t < 600.0
    for side in (1, -1):
        channels = {
            "x": 300.0 * np.sin(psi),
            "y": side * 300.0 * (1.0 - np.cos(psi)),
            "psi": side * psi,
            "u": np.full(t.size, 6.0),
            "v": np.zeros(t.size),
            "r": side * 0.02 * held,
            "delta_command": side * 0.6 * held,
        }
        indices = manoeuvres.turning_indices(Trial(t, channels), length=100.0)
        assert indices.advance_lengths == pytest.approx(3.0, abs=1e-3)
        assert indices.transfer_lengths == pytest.approx(3.0, abs=1e-3)
        assert indices.tactical_diameter_lengths == pytest.approx(6.0, abs=1e-3)
        assert indices.steady_diameter_lengths == pytest.approx(6.0)
        assert indices.steady_speed_ratio == pytest.approx(1.0)


def test_imo_assessment_of_mariner(mariner):
    """The toolbox's Mariner turns too wide at 35 deg (6.65 L to port) and is steady
    otherwise.
    """
    criteria = manoeuvres.imo_assessment(mariner)
    assert [
        name for name, criterion in criteria.items() if criterion.passed is False
    ] == ["tactical_diameter"]
    assert criteria["tactical_diameter"].value == pytest.approx(6.65, abs=0.01)
    assert criteria["advance"].value == pytest.approx(3.71, abs=0.01)
    second = 160.93 / 7.7175  # per length: between 10 and 30 s
    assert {name: criterion.limit for name, criterion in criteria.items()} == {
        "advance": 4.5,
        "tactical_diameter": 5.0,
        "initial_turning": 2.5,
        "overshoot_1_10_10": pytest.approx(5.0 + 0.5 * second),
        "overshoot_2_10_10": pytest.approx(17.5 + 0.75 * second),
        "overshoot_1_20_20": 25.0,
        "stopping": 15.0,
    }
    assert "do not hold for a shaft turning astern" in criteria["stopping"].note


def test_a_zigzag_that_never_reaches_its_heading_says_so_with_its_trial(mariner):
    with pytest.raises(
        ManoeuvreError, match=r"expected the heading to change by 40 deg, .* in 60 s"
    ) as error:
        manoeuvres.zigzag(mariner, 5, 40, duration=60)
    trial = error.value.trial
    assert trial.kind == "zigzag"
    assert 0.0 < trial["psi"].max() < np.radians(40)
    assert manoeuvres.zigzag_indices(trial).overshoot_1_deg is None
    assert (
        manoeuvres.zigzag(mariner, 5, 40, duration=60, must_reverse=False).sha256
        == trial.sha256
    )


def test_what_a_trial_lacks_is_named():
    trial = Trial([0, 1, 2], {"psi": [0, 0, 0.0]})
    with pytest.raises(InputError, match="no channel 'delta'"):
        manoeuvres.zigzag_indices(trial)
    turn = manoeuvres.turning_circle(load_model("mariner"), 35)
    with pytest.raises(InputError, match="length is not known; give length in m"):
        manoeuvres.turning_indices(
            Trial(turn.t, {name: turn[name] for name in turn.channels})
        )
    with pytest.raises(InputError, match="no channel 'delta'"):
        manoeuvres.turning_indices(trial, 100.0)


def test_a_little_helm_on_the_approach_is_no_order(mariner):
    """Steady running at the neutral rudder for 30 s, then the turn.

    The same advance as without approach.
    """
    approach, turn = np.full((300, 1), -0.0193), np.full((6000, 1), np.radians(35.0))
    trial = mariner.simulate(np.vstack([approach, turn]), 0.1).with_(
        kind="turning-circle"
    )
    indices = manoeuvres.turning_indices(trial)
    assert indices.advance_lengths == pytest.approx(3.54, abs=0.03)


def test_a_ship_turns_wider_in_shallow_water():
    """The tanker, where there is little water under her keel."""
    deep, shallow = (
        manoeuvres.turning_indices(
            manoeuvres.turning_circle("tanker", 35.0, 1500.0, 0.5, water_depth=depth)
        )
        for depth in (np.inf, 25.0)
    )
    assert shallow.tactical_diameter_lengths > 1.2 * deep.tactical_diameter_lengths
    with pytest.raises(InputError, match="'mariner' is a deep-water model"):
        manoeuvres.turning_circle("mariner", water_depth=25.0)


@pytest.mark.parametrize(
    ("headings", "overshoot"),
    [
        ((10.0, 12.0, 14.0, 13.0), 4.0),
        ((10.0, 12.0, 14.0), None),  # it still grows
        ((10.0, 12.0, 11.0), 2.0),
        ((10.0, 9.0), None),  # too few to tell
        ((10.5, 10.2, 10.1), 0.5),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_overshoot_is_the_furthest_beyond_the_switch_before_the_end(
    headings, overshoot, side
):
    """Of a ship whose heading was 3 deg before the first order."""
    psi = np.radians(3.0 + side * np.array([0.0, 0.0, 5.0, *headings]))
    t = np.arange(float(len(psi)))
    order = np.full(len(t), -side)  # reversed at 3 s
    order[:3] = [0.0, side, side]
    channels = {"psi": psi, "delta_command": 0.2 * order, "u": 0.0 * t, "v": 0.0 * t}
    found = manoeuvres.zigzag_indices(Trial(t, channels), 100.0, 10.0)
    assert found.overshoot_1_deg == (overshoot and pytest.approx(overshoot))
    assert found.overshoot_2_deg is None
