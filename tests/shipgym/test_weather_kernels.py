"""Weather in simulations, manoeuvres and the course-keeping environment."""

from dataclasses import replace

import numpy as np
import pytest
from sensors import Sensors

import shipgym
from shipgym import InputError
from shipgym.envs.engine import Engine
from shipgym.sea import (
    AIR_DENSITY,
    Current,
    Waves,
    Weather,
    Wind,
    wave_motion,
    wind_curves,
)
from shipgym.sea.harmonics import circle
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.wind import gust_filter
from shipgym.tasks import course_keeping_task

GALE = Weather(
    current=Current(1.0, 90.0, 0.2, 300.0),
    wind=Wind(12.0, 45.0),
    waves=Waves(3.25, 9.7, 45.0),
    name="gale",
)
STATE = ("x", "y", "psi", "u", "v", "r", "delta")


@pytest.fixture(scope="module")
def mariner():
    return shipgym.load_model("mariner")


def ahead(model, weather=None, steps=1200, dt=0.5, seed=0, state=None, rudder=0.0):
    orders = np.full((steps, 1), rudder)
    return model.simulate(orders, dt, state, weather=weather, seed=seed)


def inert(model, speed=1e-9):
    """The ship's body without any force of water on it, and its state at a speed."""
    state = model.service_state.copy()
    state[3] = speed
    return replace(model, coefficients=dict.fromkeys(model.coefficients, 0.0)), state


def steady_wind(from_deg, speed=15.0):
    return Weather(wind=Wind(speed, from_deg, gust=False))


def sampling_error(correlation_time, duration):
    """Relative standard error of a variance from a record of a Gauss-Markov process
    (Bendat & Piersol).
    """
    return np.sqrt(2.0 * correlation_time / duration)


@pytest.mark.parametrize(
    "weather", ["calm", Weather(), Weather(current=Current(0.0), wind=Wind(0.0))]
)
def test_calm_weather_is_no_weather(mariner, weather):
    there, here = ahead(mariner, weather, rudder=0.1), ahead(mariner, rudder=0.1)
    assert there.channels.keys() == here.channels.keys()
    for name in here.channels:
        np.testing.assert_array_equal(there[name], here[name])


def test_a_constant_current_is_a_moving_frame(mariner):
    drifting = ahead(mariner, Weather(current=Current(1.5, 60.0)), rudder=0.2)
    still = ahead(mariner, rudder=0.2)
    for name in (
        "psi",
        "u",
        "v",
        "r",
    ):  # two compiled loops, whose last digits may differ
        np.testing.assert_allclose(drifting[name], still[name], rtol=1e-12)
    way = 1.5 * still.t
    np.testing.assert_allclose(
        drifting["x"], still["x"] + way * np.cos(np.radians(60.0)), atol=1e-9
    )
    np.testing.assert_allclose(
        drifting["y"], still["y"] + way * np.sin(np.radians(60.0)), atol=1e-9
    )


@pytest.mark.parametrize("from_deg", [0.0, 30.0, 90.0, 150.0, -120.0])
def test_the_first_push_of_the_wind_is_its_force_by_the_inertia(mariner, from_deg):
    body, at_rest = inert(mariner)
    dt, speed = 1e-3, 15.0
    trial = ahead(body, steady_wind(from_deg, speed), 2, dt, state=at_rest)
    curves = wind_curves(mariner.particulars)
    pressure = 0.5 * AIR_DENSITY * speed**2
    forces = [
        pressure * np.interp(np.radians(from_deg % 360.0), circle(), curve)
        for curve in (curves.X, curves.Y, curves.N, curves.K)
    ]
    expected = mobility_matrix(mariner) @ forces
    felt = [(trial[name][1] - trial[name][0]) / dt for name in "uvr"]
    scale = np.abs(mobility_matrix(mariner)) @ [
        pressure * np.abs(curve).max()
        for curve in (curves.X, curves.Y, curves.N, curves.K)
    ]
    assert np.all(np.abs(felt - expected[:3]) < 0.04 * scale[:3])  # six harmonics


def test_weather_from_port_is_the_mirror_image_of_that_from_starboard(mariner):
    crooked = [name for name in mariner.coefficients if name[:3] in ("Y_0", "N_0")]
    symmetric = replace(
        mariner, coefficients=mariner.coefficients | dict.fromkeys(crooked, 0.0)
    )
    port, starboard = (
        ahead(symmetric, steady_wind(side * 70.0), rudder=side * 0.05)
        for side in (-1.0, 1.0)
    )
    sign = {"y": -1.0, "psi": -1.0, "v": -1.0, "r": -1.0, "delta": -1.0}
    for name in STATE:
        np.testing.assert_allclose(
            port[name], sign.get(name, 1.0) * starboard[name], rtol=1e-9, atol=1e-9
        )


@pytest.mark.parametrize("dt", [0.2, 1.0])
def test_heading_in_waves_has_the_variance_and_the_rhythm_of_the_filter(mariner, dt):
    """In waves too low to push a ship off her course.

    Variance, correlation and yaw rate.
    """
    waves, steps = Waves(1e-3, 9.7, 60.0), 40000
    model, state = inert(mariner, mariner.particulars["speed"])
    trial = ahead(model, Weather(waves=waves), steps, dt, state=state)
    assert np.ptp(trial["psi"]) < 0.01
    variance = wave_motion(waves, model.particulars)[0][60]
    w0 = 2.0 * np.pi / 9.7
    w = w0 + w0**2 / 9.80665 * model.particulars["speed"] * np.cos(np.radians(60.0))
    damping = 0.1056
    error = sampling_error(0.5 / (damping * w), steps * dt)
    assert trial["psi_wave"].var() == pytest.approx(variance, rel=0.03 + 4.0 * error)
    assert trial["r_wave"].var() == pytest.approx(
        variance * w**2, rel=0.03 + 4.0 * error
    )
    lag = round(4.0 / dt)
    theta, s = w * lag * dt, np.sqrt(1.0 - damping**2)
    expected = np.exp(-damping * theta) * (
        np.cos(s * theta) - damping / s * np.sin(s * theta)
    )
    psi = trial["psi_wave"]
    assert np.mean(psi[lag:] * psi[:-lag]) / psi.var() == pytest.approx(
        expected, abs=4.0 * error
    )


def test_a_simulation_is_a_function_of_its_seed(mariner):
    first, second, other = (ahead(mariner, GALE, 50, seed=seed) for seed in (4, 4, 5))
    for name in first.channels:
        np.testing.assert_array_equal(first[name], second[name])
    assert not np.array_equal(first["psi_wave"], other["psi_wave"])
    through = mariner.simulate(np.zeros((50, 1)), 0.5, weather=GALE, seed=4)
    np.testing.assert_array_equal(through["psi"], first["psi"])


def test_instruments_show_the_motion_in_waves(mariner):
    trial = ahead(mariner, GALE, 50)
    logged = Sensors({}).measure(trial)
    np.testing.assert_allclose(
        logged["psi"], trial["psi"] + trial["psi_wave"], atol=1e-14
    )
    np.testing.assert_allclose(logged["r"], trial["r"] + trial["r_wave"], atol=1e-14)
    assert set(logged.channels) == {*STATE, "delta_command"}


def engine(model, lanes, sea="rough", **task):
    return Engine(model, lanes, course_keeping_task(sea=sea, **task))


def test_the_environment_shows_the_measured_and_rewards_the_slow_heading(mariner):
    rough = engine(mariner, 8)
    rough.reset(np.arange(8))
    for _ in range(30):
        observations, *_ = rough.step(np.zeros((8, 1)))
    state = rough.physical_state()
    shown = state["set_point"] - state["psi"] - state["psi_wave"]
    np.testing.assert_allclose(observations[:, 0], np.sin(shown), atol=1e-6)
    scale = mariner.particulars["speed"] / mariner.particulars["length"]
    np.testing.assert_allclose(
        observations[:, 2] * scale, state["r"] + state["r_wave"], atol=1e-7
    )
    cost = (state["set_point"] - state["psi"] + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(
        -rough.info("reward_heading"), (cost / np.radians(30.0)) ** 2, rtol=1e-9
    )


def test_wrong_weather(mariner):
    bare = replace(mariner, particulars=replace(mariner.particulars, beam=None))
    with pytest.raises(InputError, match="weather without the particulars it needs"):
        ahead(bare, "rough", 2)
    with pytest.raises(InputError, match="weather without the particulars it needs"):
        engine(bare, 1)
    with pytest.raises(
        InputError, match=r"weather: .*got 'rugh'.*Did you mean 'rough'"
    ):
        ahead(mariner, "rugh", 2)
    with pytest.raises(InputError, match="sea: expected a Weather"):
        course_keeping_task(sea=7)
    with pytest.raises(InputError, match=r"seed: expected .*got -1"):
        ahead(mariner, "rough", 2, seed=-1)


def test_current_and_gusts_have_their_variance(mariner):
    T, steps, dt = 50.0, 20000, 2.0
    weather = Weather(current=Current(1.0, 0.0, 0.3, T), wind=Wind(12.0, 0.0))
    trial = ahead(mariner, weather, steps, dt)
    error = 4.0 * sampling_error(T, steps * dt)
    assert trial["current_north"].mean() == pytest.approx(1.0, abs=0.3 * error)
    assert trial["current_east"].var() == pytest.approx(0.09, rel=error)
    lag = round(T / dt)
    east = trial["current_east"]
    correlation = np.mean(east[:-lag] * east[lag:]) / 0.09
    assert correlation == pytest.approx(np.exp(-1.0), abs=error)
    gust = gust_filter(Wind(12.0, 0.0))
    assert trial["wind_speed"].std() == pytest.approx(
        gust.standard_deviation, rel=error
    )
