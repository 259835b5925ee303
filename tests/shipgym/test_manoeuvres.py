"""Manoeuvres and their indices."""

from dataclasses import replace

import numpy as np
import pytest

import shipgym
from shipgym import InputError, ManoeuvreError, Trial, load_model, manoeuvres
from shipgym.manoeuvres.execution import (
    departure,
    execute_time,
    number_of_steps,
    reached,
    reversals,
)
from shipgym.manoeuvres.imo_rules import overshoot_limits_deg


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


def test_port_first_starts_to_port(mariner):
    trial = manoeuvres.zigzag(mariner, 10, 15, port_first=True)
    assert trial["delta_command"][0] == pytest.approx(-np.radians(10))
    assert trial["psi"][100] < 0
    assert manoeuvres.switch_heading_deg(trial) == 15.0


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
    assert manoeuvres.switch_heading_deg(triangle) == 10.0
    assert indices.overshoot_1_deg == pytest.approx(6.0)
    assert indices.overshoot_2_deg == pytest.approx(8.0)
    assert indices.initial_turning_lengths == pytest.approx(10.0 * 4.0 / 20.0, rel=0.06)
    assert indices.period_s is None


def test_a_zigzag_cut_short_has_no_second_overshoot(triangle):
    short = triangle.t <= 40.0
    cut = Trial(
        triangle.t[short],
        {name: values[short] for name, values in triangle.channels.items()},
        length=20,
    )
    indices = manoeuvres.zigzag_indices(cut)
    assert indices.overshoot_1_deg == pytest.approx(6.0)
    assert indices.overshoot_2_deg is None


def test_measured_rudder_and_ordered_rudder_tell_the_same(mariner):
    trial = manoeuvres.zigzag(mariner, 20, 20, dt=0.5)
    measured = Trial(
        trial.t, {n: trial[n] for n in ("psi", "u", "v", "delta")}, length=trial.length
    )
    ordered, seen = (
        manoeuvres.zigzag_indices(trial),
        manoeuvres.zigzag_indices(measured),
    )
    assert seen.overshoot_1_deg == pytest.approx(ordered.overshoot_1_deg, abs=1e-6)
    assert seen.overshoot_2_deg == pytest.approx(ordered.overshoot_2_deg, abs=1e-6)
    assert seen.initial_turning_lengths == pytest.approx(
        ordered.initial_turning_lengths, abs=0.05
    )


def test_orders_count_by_the_rudder_that_is_exceeded_a_quarter_of_the_time():
    """Here 10 degrees: helm on the approach below half of it is no order, below nine
    tenths no reversal.
    """
    ordered = np.repeat([4.9, 10.0, -8.9, 10.0, -9.1, 30.0], [10, 40, 10, 10, 10, 20])
    trial = Trial(np.arange(100.0), {"delta_command": np.radians(ordered)})
    assert execute_time(trial) == 10.0
    assert reversals(trial) == (10.0, [70.0, 80.0])


def test_a_measured_rudder_is_traced_back_along_its_slope():
    way = np.array([0.0, 0.0, 1.0, 1.05, 4.0, 5.2, *[10.0] * 10, *[30.0] * 4])
    t = np.arange(20.0)
    way[4] = 3.0  # a tenth is exceeded at 3 s, half at 5 s, by 4.15 degrees within 2 s
    assert departure(t, way, 10.0, 0.0) == pytest.approx(5.0 - 5.2 * 2.0 / 4.15)
    fine = np.interp(
        0.5 * np.arange(80.0), [0.0, 3.0, 8.0, 30.0, 31.0], [0.0, 0.0, 10.0, 10.0, 20.0]
    )
    assert departure(0.5 * np.arange(80.0), fine, 10.0, 99.0) == pytest.approx(3.0)
    for delta in (fine, 3.0 - fine):  # it mostly is 10 degrees from where it began
        assert execute_time(
            Trial(0.5 * np.arange(80.0), {"delta": np.radians(delta)})
        ) == pytest.approx(3.0)
    assert departure(t[5:9], np.zeros(4), 0.0, 0.0) == 5.0


def test_a_little_helm_or_noise_on_the_approach_is_not_the_execution():
    t = np.arange(200.0)
    order = np.where(t < 60.0, 0.0, np.where(t < 100.0, 10.0, -10.0))
    helm = np.where(t < 60.0, 1.5 * np.sin(t / 3.0), order)
    noisy = order + 0.5 * np.random.default_rng(0).standard_normal(len(t))
    for delta in (helm, noisy):
        assert 59.0 <= execute_time(Trial(t, {"delta": np.radians(delta)})) <= 60.0


def test_between_few_samples_a_measured_rudder_moves_at_the_fastest_rate():
    """A rudder of 2.5 deg/s, ordered at 4 s, then from 20 to -20 degrees at 28 s, and
    back at 63 s.
    """
    t, way = np.arange(0.0, 100.0, 5.0), np.array([0.0, 0.0, 5.0, 17.5, 30.0, 40.0])
    assert departure(t[:6], way, 40.0, 0.0) == pytest.approx(8.0)
    assert departure(
        t[:4], np.array([0.0, 0.0, 30.0, 40.0]), 40.0, 2.5
    ) == pytest.approx(10.0 - 12.0)
    corners, angles = (
        [4.0, 12.0, 28.0, 44.0, 63.0, 79.0],
        np.radians([0.0, 20.0, 20.0, -20.0, -20.0, 20.0]),
    )
    start, turns = reversals(Trial(t, {"delta": np.interp(t, corners, angles)}))
    assert [start, *turns] == pytest.approx([4.0, 28.0, 63.0])


def test_a_sample_that_shows_a_measured_rudder_moving_is_not_before_it_moves():
    """At 3 deg/s from 4 s on to 10 degrees.

    At 6 s it is at 6 of them, and where it is held at 9 s.
    """
    t, way = np.array([0.0, 3.0, 6.0, 9.0]), np.array([0.0, 0.0, 4.0, 10.0])
    assert departure(t, way, 10.0, 3.0) == pytest.approx(6.0 - 4.0 / 3.0)
    helm = np.array(
        [0.0, 0.0, 1.4, 10.0]
    )  # little beyond a tenth: noise, or helm on the approach
    assert departure(t, helm, 10.0, 3.0) == pytest.approx(9.0 - 10.0 / 3.0)


@pytest.mark.parametrize("offset", [-1.2, 1.2])
def test_a_measured_rudder_whose_zero_is_off_reverses_when_ordered(
    offset,
):
    run = manoeuvres.zigzag(load_model("mariner"), 10, 10, dt=1.0)
    start, turns = reversals(Trial(run.t, {"delta": run["delta"]}))
    assert len(turns) == len(reversals(run)[1])
    found, moved = reversals(Trial(run.t, {"delta": run["delta"] + np.radians(offset)}))
    assert [found, *moved] == pytest.approx([start, *turns], abs=0.01)


@pytest.mark.parametrize("name", ["mariner", "container", "kvlcc2", "tanker"])
def test_a_measured_rudder_reverses_when_it_was_ordered_to(name):
    """It is traced back to the angle at which it was held, not to where it passed nine
    tenths of it.
    """
    ordered = manoeuvres.zigzag(load_model(name), 10, 10, dt=0.1)
    measured = Trial(ordered.t, {"psi": ordered["psi"], "delta": ordered["delta"]})
    assert (
        np.max(np.abs(np.subtract(reversals(measured)[1], reversals(ordered)[1])))
        <= 0.1 + 1e-9
    )


def test_a_threshold_is_reached_between_two_samples_at_the_first_or_never():
    values, other = np.array([0.0, 1.0, 5.0]), np.array([0.0, 10.0, 30.0])
    found = [
        reached(values, threshold, other)
        for threshold in (-1.0, 0.5, 1.0, 2.0, 5.0, 5.1)
    ]
    assert found == [0.0, 5.0, 10.0, 15.0, 30.0, None]


def test_a_duration_has_two_steps_at_least():
    assert (number_of_steps(1.0, 0.5), number_of_steps(100.0, 0.3)) == (2, 333)
    with pytest.raises(
        InputError,
        match=r"duration: expected at least two steps of dt = 0\.5 s, got 0\.7 s",
    ):
        number_of_steps(0.7, 0.5)


def test_a_perfect_circle():
    """R = 300 m at 6 m/s from the start.

    Advance R, transfer R, tactical and steady diameter 2 R.
    """
    t = np.arange(0.0, 700.0, 0.5)
    psi = t * 6.0 / 300.0
    for side in (1, -1):
        channels = {
            "x": 300.0 * np.sin(psi),
            "y": side * 300.0 * (1.0 - np.cos(psi)),
            "psi": side * psi,
            "u": np.full(t.size, 6.0),
            "v": np.zeros(t.size),
            "r": np.full(t.size, side * 0.02),
            "delta_command": np.full(t.size, side * 0.6),
        }
        indices = manoeuvres.turning_indices(Trial(t, channels), length=100.0)
        assert indices.advance_lengths == pytest.approx(3.0, abs=1e-3)
        assert indices.transfer_lengths == pytest.approx(3.0, abs=1e-3)
        assert indices.tactical_diameter_lengths == pytest.approx(6.0, abs=1e-3)
        assert indices.steady_diameter_lengths == pytest.approx(6.0)
        assert indices.steady_speed_ratio == pytest.approx(1.0)


def test_a_turn_that_ends_early_has_no_tactical_diameter(mariner):
    indices = manoeuvres.turning_indices(
        manoeuvres.turning_circle(mariner, 35, duration=150)
    )
    assert indices.advance_lengths is not None
    assert indices.tactical_diameter_lengths is None


def test_imo_limits_between_10_and_30_seconds_per_length():
    """MSC.137(76) 5.3.3: 10 and 25 deg below 10 s, 20 and 40 above 30 s, linear
    between.
    """
    assert overshoot_limits_deg(5.0) == (10.0, 25.0)
    assert overshoot_limits_deg(20.0) == (15.0, 32.5)
    assert overshoot_limits_deg(35.0) == (20.0, 40.0)


def test_imo_limits_are_those_of_the_resolution(mariner):
    """MSC.137(76), annex, 5.3; L/V of the Mariner is 20.9 s."""
    criteria = manoeuvres.imo_assessment(mariner)
    second = 160.93 / 7.7175
    assert {
        name: (c.limit, c.source.rpartition(" ")[2]) for name, c in criteria.items()
    } == {
        "advance": (4.5, "5.3.1"),
        "tactical_diameter": (5.0, "5.3.1"),
        "initial_turning": (2.5, "5.3.2"),
        "overshoot_1_10_10": (pytest.approx(5.0 + 0.5 * second), "5.3.3.1"),
        "overshoot_2_10_10": (pytest.approx(17.5 + 0.75 * second), "5.3.3.2"),
        "overshoot_1_20_20": (25.0, "5.3.3.3"),
        "stopping": (15.0, "5.3.4"),
    }
    assert criteria["stopping"].passed is None
    assert "cannot be ordered astern" in criteria["stopping"].note
    stop = manoeuvres.imo_assessment(load_model("tanker"))["stopping"]
    assert stop.value == pytest.approx(8.95, abs=0.01)
    assert stop.passed
    assert (
        "ahead only"
        in manoeuvres.imo_assessment(load_model("container"))["stopping"].note
    )


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
    assert all("MSC.137(76)" in criterion.source for criterion in criteria.values())


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


def test_a_ship_that_does_not_answer_its_rudder_fails_the_zigzag_criteria(mariner):
    """With rudder derivatives of nothing it turns neither 10 nor 90 degrees.

    Every criterion fails.
    """
    numb = {
        name: 0.0 if "d" in name.split("_")[1] else value
        for name, value in mariner.coefficients.items()
    }
    numb |= {
        "Y_0": 0.0,
        "N_0": 0.0,
        "Y_0u": 0.0,
        "N_0u": 0.0,
        "Y_0uu": 0.0,
        "N_0uu": 0.0,
    }
    criteria = manoeuvres.imo_assessment(replace(mariner, coefficients=numb))
    assert all(
        criterion.value is None and not criterion.passed
        for criterion in criteria.values()
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: manoeuvres.zigzag(m, -20), "rudder_deg: expected .*got -20"),
        (
            lambda m: manoeuvres.zigzag(m, 20, 20, duration=0),
            "duration: expected .*got 0",
        ),
        (
            lambda m: manoeuvres.zigzag(m, 20, 20, dt=float("nan")),
            "dt: expected .*got nan",
        ),
        (
            lambda m: manoeuvres.zigzag(m, 20, 20, switch="later"),
            "switch: expected .*got 'later'",
        ),
        (
            lambda m: manoeuvres.turning_circle(m, 0.0),
            "expected an angle that turns the ship",
        ),
        (
            lambda m: manoeuvres.turning_circle(m, 120.0),
            "rudder_deg: expected .*got 120",
        ),
    ],
)
def test_wrong_arguments(mariner, call, message):
    with pytest.raises(InputError, match=message):
        call(mariner)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"heading_deg": 0.0}, "heading_deg: expected .*got 0"),
        ({"heading_deg": 181.0}, "heading_deg: expected .*got 181"),
        ({"rudder_deg": 91.0}, "rudder_deg: expected .*got 91"),
        ({"switch": "insde"}, "Did you mean 'inside'"),
    ],
)
def test_zigzags_that_cannot_be_are_refused(mariner, options, message):
    with pytest.raises(InputError, match=message):
        manoeuvres.zigzag(
            mariner, **{"rudder_deg": 10.0, "heading_deg": 10.0} | options
        )


def test_what_a_trial_lacks_is_named():
    trial = Trial([0, 1, 2], {"psi": [0, 0, 0.0]})
    with pytest.raises(InputError, match="'delta' is missing"):
        manoeuvres.zigzag_indices(trial)
    with pytest.raises(
        InputError, match="'delta' is missing, it shows when the rudder moved"
    ):
        manoeuvres.zigzag_indices(Trial(np.arange(5.0), {"psi": np.zeros(5)}))
    turn = manoeuvres.turning_circle(load_model("mariner"), 35)
    with pytest.raises(InputError, match="length is not known; give length in m"):
        manoeuvres.turning_indices(
            Trial(turn.t, {name: turn[name] for name in turn.channels})
        )
    with pytest.raises(InputError, match="'x' is missing"):
        manoeuvres.turning_indices(trial)


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


def test_the_standard_manoeuvres_in_shallow_water():
    """The tanker turns wider and later where there is little water under her keel."""
    tanker = load_model("tanker")
    name = "turning circle 35 deg to starboard"
    deep, shallow = (
        manoeuvres.standard_manoeuvres(tanker, h)[name].evaluate(tanker)
        for h in (np.inf, 25.0)
    )
    assert shallow.tactical_diameter_lengths > 1.2 * deep.tactical_diameter_lengths
    by_hand = manoeuvres.turning_circle(tanker, 35.0, 1500.0, 0.5, water_depth=25.0)
    assert shallow.advance_lengths == pytest.approx(
        manoeuvres.turning_indices(by_hand).advance_lengths, rel=1e-3
    )
    with pytest.raises(InputError, match="'mariner' is a deep-water model"):
        manoeuvres.standard_manoeuvres(load_model("mariner"), 25.0)


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


@pytest.mark.parametrize(("turned", "steady"), [(1.49, False), (1.51, True)])
def test_a_turn_is_steady_after_three_quarters_of_a_circle(turned, steady):
    """Speed and drift are those of the last quarter turn."""
    psi = np.linspace(0.0, turned * np.pi, 1501)
    last = psi >= psi[-1] - np.pi / 2
    t, none = psi / 0.02, 0.0 * psi
    channels = {
        "x": none,
        "y": none,
        "psi": psi,
        "u": np.where(last, 4.0, 8.0),
        "v": np.where(last, -3.0, 0.0),
        "r": np.where(last, 0.02, 0.05),
        "delta_command": none + 0.6,
    }
    found = manoeuvres.turning_indices(Trial(t, channels), length=100.0)
    if not steady:
        assert (
            found.steady_diameter_lengths
            is found.steady_speed_ratio
            is found.steady_drift_deg
            is None
        )
        return
    assert found.steady_diameter_lengths == pytest.approx(2.0 * 5.0 / 0.02 / 100.0)
    assert found.steady_speed_ratio == pytest.approx(5.0 / 8.0)
    assert found.steady_drift_deg == pytest.approx(np.degrees(np.arctan2(3.0, 4.0)))


@pytest.mark.parametrize(
    ("reached_deg", "switch_deg"),
    [
        (9.4, 9.4),
        (9.6, 10.0),
        (12.9, 10.0),
        (13.1, 13.1),
        (14.3, 15.0),
        (0.94, 0.94),
        (0.96, 1.0),
        (3.9, 1.0),
    ],
)
def test_a_measured_zigzag_was_switched_at_the_last_usual_heading(
    reached_deg, switch_deg
):
    """Usual are 1 and multiples of 5 deg, which a helmsman may take for reached 5 per
    cent before.
    """
    t = np.arange(101.0)
    psi = np.radians(
        np.interp(t, [0.0, 5.0, 50.0, 100.0], [0.0, 0.0, reached_deg, 0.0])
    )
    rudder = np.interp(
        t,
        [0.0, 4.0, 5.0, 50.0, 51.0, 52.0, 100.0],
        [0.0, 0.0, 10.0, 10.0, 0.0, -10.0, -10.0],
    )
    trial = Trial(t, {"psi": psi, "delta": np.radians(rudder)})
    assert manoeuvres.switch_heading_deg(trial) == pytest.approx(switch_deg)
