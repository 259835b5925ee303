"""PID with reference filter, anti-windup and wave filter: what each of them does."""

from dataclasses import replace

import numpy as np
import pytest

from agents import PID, FilteredPID, check_controller, load_agent, sail, step_response
from agents.controllers.filtered_pid import notch_band
from agents.controllers.linear_loop import ERROR, SIGNALS, YAW_RATE
from agents.controllers.memory import records
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.tasks.task import course_keeping_task, observation_scales

MARINER = load_model("mariner")
INFINITE = float("inf")


@pytest.fixture(scope="module")
def filtered():
    return FilteredPID.from_model(MARINER)


def test_its_loop_has_the_margins_of_the_plain_pid(filtered):
    plain = PID.from_model(MARINER)
    assert filtered.gains == plain.gains
    assert filtered.margins.gain_margin == pytest.approx(
        plain.margins.gain_margin, rel=1e-6
    )
    assert filtered.margins.phase_margin_deg == pytest.approx(
        plain.margins.phase_margin_deg, rel=1e-6
    )


def test_the_reference_is_the_step_response_of_three_equal_poles():
    """1 - (1 + w t + (w t)^2 / 2) exp(-w t), for a course change that the ship has not followed yet."""
    pid = FilteredPID.from_model(MARINER, frequency=0.005, reference_share=1.0)
    scales, state, reference = observation_scales(MARINER), None, []
    for k in range(1600):
        error = np.radians(20.0) if k else 0.0
        seen = (
            np.array([np.sin(error), np.cos(error), 0.0, 0.0, 7.0, 0.0, 0.0, 0.0])
            / scales
        )
        _, state = pid.predict(seen, state)
        reference.append(np.radians(20.0) + records(state, pid.record)["lead"])
    t = 0.005 * np.arange(1599)
    expected = np.radians(20.0) * (1.0 - (1.0 + t + 0.5 * t**2) * np.exp(-t))
    assert np.abs(np.array(reference[1:]) - expected).max() < np.radians(0.08)


def test_by_default_its_reference_is_three_times_as_fast_and_the_integral_gives_back_within_two_lengths(
    filtered,
):
    design, time = (
        filtered.design,
        MARINER.particulars["length"] / MARINER.particulars["speed"],
    )
    assert design["reference_frequency"] == pytest.approx(3.0 * design["frequency"])
    assert design["tracking_rate"] == pytest.approx(0.5 / time)
    assert (
        design["largest_turn_rate"] == design["wave_frequency"] == 0.0
    )  # neither limit nor filter
    slow = {
        "largest_turn_rate_deg_s": 0.01,
        "reference_share": 0.05,
        "tracking_lengths": 0.05,
    }
    design = FilteredPID.from_model(MARINER, **slow).design
    assert design["largest_turn_rate"] == pytest.approx(np.radians(0.01))
    assert design["tracking_rate"] == pytest.approx(20.0 / time)


def test_the_reference_turns_no_faster_than_asked():
    pid = FilteredPID.from_model(MARINER, largest_turn_rate_deg_s=0.2)
    response = step_response(pid, MARINER, 60.0, duration=900.0)
    steady = np.diff(np.degrees(response.heading[0]))[100:250]
    assert steady == pytest.approx(0.2, abs=0.02)
    assert np.degrees(response.heading[0, -1]) == pytest.approx(60.0, abs=0.3)


def test_a_gentler_reference_needs_less_rudder(filtered):
    gentle = FilteredPID.from_model(MARINER, reference_share=1.5)
    largest = [
        np.abs(step_response(pid, MARINER, 30.0).rudder).max()
        for pid in (gentle, filtered)
    ]
    assert largest[0] < 0.7 * largest[1]


def test_with_the_reference_it_costs_less_than_the_plain_pid(filtered):
    ours, theirs = (
        sail(pilot, MARINER, seeds=np.arange(16))
        for pilot in (filtered, PID.from_model(MARINER))
    )
    assert ours.cost.mean() < theirs.cost.mean()


def test_anti_windup_halves_the_overshoot_of_a_weak_rudder():
    """A course change with the rudder at its limit for long: the integral gives back what is cut off."""
    overshoots = []
    for tracking in (2.0, INFINITE):
        pid = FilteredPID.from_model(
            MARINER,
            integral_lengths=6.0,
            reference_share=INFINITE,
            tracking_lengths=tracking,
        )
        heading = step_response(pid, MARINER, 60.0, duration=1500.0).heading[0]
        overshoots.append(np.degrees(heading.max()) - 60.0)
    assert overshoots[0] < 0.6 * overshoots[1]


def test_without_its_filters_it_steers_as_the_plain_pid():
    bare = FilteredPID.from_model(
        MARINER, reference_share=INFINITE, tracking_lengths=INFINITE
    )
    assert bare.design["reference_frequency"] == bare.design["tracking_rate"] == 0.0
    ours, theirs = (
        step_response(pid, MARINER, 10.0, duration=600.0).heading
        for pid in (bare, PID.from_model(MARINER))
    )
    assert np.degrees(np.abs(ours - theirs).max()) < 0.05


def test_the_notch_takes_its_frequency_and_leaves_steady_signals():
    band, once, twice = notch_band(0.7)

    def passes(turn):
        z = np.exp(1j * turn)
        return 1.0 - band * (1.0 - z**-2) / (1.0 + once / z + twice / z**2)

    assert passes(0.7) == pytest.approx(0.1 / 0.7, rel=1e-9)
    assert abs(passes(1e-6)) == pytest.approx(1.0, abs=1e-5)
    assert abs(passes(np.pi)) == pytest.approx(1.0, abs=1e-5)


def test_in_time_it_is_the_loop_of_which_its_margins_are_and_a_new_course_is_no_wave():
    pid = FilteredPID.from_model(
        MARINER,
        dt=0.5,
        wave_period=9.0,
        reference_share=INFINITE,
        tracking_lengths=INFINITE,
    )
    rate = 2e-4 * np.sin(0.35 * np.arange(60))
    error = -np.r_[
        0.0, np.cumsum(0.25 * (rate[1:] + rate[:-1]))
    ]  # as the ship's own turning makes it
    loop, within, expected = pid.loop(), np.zeros((len(pid.loop().A), 1)), []
    for one, turning in zip(error, rate, strict=True):
        signals = np.zeros((len(SIGNALS), 1))
        signals[[ERROR, YAW_RATE], 0] = one, turning
        expected.append(float((loop.C @ within + loop.D @ signals)[0, 0]))
        within = loop.A @ within + loop.B @ signals
    scales, state, orders = observation_scales(MARINER), None, []
    for one, turning in zip(
        np.r_[error, error[-1] + 0.2], np.r_[rate, rate[-1]], strict=True
    ):
        seen = (
            np.array([np.sin(one), np.cos(one), turning, 0.0, 7.0, 0.0, 0.0, 0.0])
            / scales
        )
        action, state = pid.predict(seen, state)
        orders.append(float(action[0]) * MARINER.steering.limit - pid.neutral_rudder)
    assert pid.design["wave_frequency"] == pytest.approx(2.0 * np.pi / 9.0)
    assert orders[:-1] == pytest.approx(expected, abs=2e-8)
    gain = pid.gains["proportional"] + 0.5 * pid.gains["integral"]
    assert orders[-1] - orders[-2] == pytest.approx(0.2 * gain, rel=0.02)


def test_a_heading_opposite_to_the_course_is_filtered_as_any_other():
    """Through 180 degrees of error, where its sign changes: what the notch takes away is the same."""
    pid = FilteredPID.from_model(
        MARINER, wave_period=9.0, reference_share=INFINITE, tracking_lengths=INFINITE
    )
    pid = replace(pid, gains={**pid.gains, "integral": 0.0})
    rates, orders = 0.01 * np.sin(0.7 * np.arange(12)), []
    for error in (0.01, np.pi + 0.01):  # to which she turns back
        memory, angle, found = np.zeros((1, pid.memory_size)), error, []
        for k, rate in enumerate(rates):
            angle -= 0.5 * (rate + rates[k - 1]) if k else 0.0
            seen = {
                "heading_error_sin": np.sin([angle]),
                "heading_error_cos": np.cos([angle]),
            }
            order, memory = pid.steer(
                seen | {"yaw_rate": np.array([rate])}, memory, np.array([k == 0])
            )
            found.append(order[0])
        orders.append(np.array(found))
    turned = (orders[1] - orders[0]) / pid.gains["proportional"]
    assert np.cos(turned) == pytest.approx(-1.0, abs=1e-9)


def test_the_wave_filter_spares_the_rudder(filtered):
    deaf = FilteredPID.from_model(MARINER, wave_period=9.0)
    task = course_keeping_task(sea="moderate")
    ours, theirs = (
        sail(pilot, MARINER, task, np.arange(16)) for pilot in (deaf, filtered)
    )
    assert ours.rudder_travel_deg_min.mean() < 0.7 * theirs.rudder_travel_deg_min.mean()
    assert ours.cost.mean() < theirs.cost.mean()
    assert 35.0 < deaf.margins.phase_margin_deg < filtered.margins.phase_margin_deg


def test_a_steady_course_is_reached_without_error(filtered):
    heading = step_response(filtered, MARINER, 20.0, duration=2500.0).heading[0]
    assert np.degrees(heading[-1]) == pytest.approx(20.0, abs=0.01)


@pytest.mark.parametrize("period", [None, 9.0])
def test_it_is_a_controller_and_a_file(period, tmp_path):
    pid = FilteredPID.from_model(MARINER, wave_period=period)
    check_controller(pid, MARINER, course_keeping_task(noise=1.0), n_steps=20)
    pid.save(tmp_path / "pid.json")
    again = load_agent(tmp_path / "pid.json", MARINER)
    shown = np.random.default_rng(0).uniform(-0.3, 0.3, (4, 8))
    _, state = pid.predict(shown)
    assert np.array_equal(again.predict(shown, state)[0], pid.predict(shown, state)[0])
    assert state.shape == (4, pid.memory_size)
    assert np.all(records(state, pid.record)["turn"] != 0.0)


def test_the_least_integral_that_a_number_can_be_leaves_commands_finite(filtered):
    tiny = replace(filtered, gains={**filtered.gains, "integral": 5e-324})
    none = replace(filtered, gains={**filtered.gains, "integral": 0.0})
    seen, state, other = np.full((1, 8), 0.9), None, None
    for _ in range(3):
        order, state = tiny.predict(seen, state)
        same, other = none.predict(seen, other)
        assert np.array_equal(order, same)


def test_impossible_designs_are_refused():
    for arguments in (
        {"reference_share": 0.0},
        {"tracking_lengths": -1.0},
        {"wave_period": 1.0},
    ):
        with pytest.raises(InputError, match=f"{next(iter(arguments))}: expected"):
            FilteredPID.from_model(MARINER, **arguments)
    with pytest.raises(InputError, match=r"wave_period: expected a number > 1 "):
        FilteredPID.from_model(MARINER, dt=0.5, wave_period=0.9)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("largest_turn_rate_deg_s", 0.0),
        ("reference_share", 0.0),
        ("tracking_lengths", -1.0),
    ],
)
def test_numbers_beyond_their_bounds_are_refused(name, value):
    with pytest.raises(InputError, match=rf"{name}: expected"):
        FilteredPID.from_model(MARINER, **{name: value})
