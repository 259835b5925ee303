"""Batched physics of bare ships, and the mathematics that lets its loops
be vectorised."""

import math

import numpy as np
import pytest

import shipgym
from shipgym.engine.compiling import compiled
from shipgym.engine.loops import ship_loop
from shipgym.engine.mathematics import (
    arctan,
    arctan2,
    clip,
    exponential,
    nearest,
    pick,
    power_of_two,
    sin_cos,
    small_cosine,
    small_sin_cos,
    turn_sin_cos,
    two_to,
    wrap,
)
from shipgym.engine.records import LANES

SHIPS = ("mariner", "container", "tanker", "kvlcc2")


def loop(x, y, out):
    for i in range(x.size):
        out[0, i], out[1, i], out[2, i] = (
            exponential(x[i]),
            arctan(x[i]),
            arctan2(y[i], x[i]),
        )


def over(x, y):
    """Our functions as loops compile them."""
    out = np.empty((3, x.size))
    compiled(
        loop, "void(float64[::1], float64[::1], float64[:, ::1])", {}, "mathematics"
    )(x, y, out)
    return out


def test_the_exponential_is_exact_to_rounding_over_its_whole_range():
    x = np.concatenate(
        [np.linspace(-708.0, 709.7, 200_001), np.linspace(-1.0, 1.0, 20_001)]
    )
    np.testing.assert_allclose(over(x, x)[0], np.exp(x), rtol=5e-16)
    subnormal = np.linspace(-745.0, -708.0, 1001)
    np.testing.assert_allclose(
        over(subnormal, subnormal)[0], np.exp(subnormal), rtol=5e-16, atol=1e-323
    )


def test_the_exponential_ends_as_numpy_s():
    x = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, 800.0, -800.0])
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(over(x, x)[0], np.exp(x))


def test_the_arc_tangent_is_exact_to_rounding_over_its_whole_range():
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((2, 100_000)) * 10.0 ** rng.uniform(
        -12.0, 12.0, (2, 100_000)
    )
    _, single, double = over(x, y)
    np.testing.assert_allclose(single, np.arctan(x), rtol=5e-16)
    np.testing.assert_allclose(double, np.arctan2(y, x), rtol=5e-16)


@pytest.mark.parametrize("y", [0.0, -0.0, 1.0, -1.0])
@pytest.mark.parametrize("x", [0.0, -0.0, 1.0, -1.0])
def test_the_arc_tangent_knows_the_axes(x, y):
    found = over(np.array([x]), np.array([y]))[2, 0]
    assert found == pytest.approx(math.atan2(y, x), rel=3e-16)
    assert math.copysign(1.0, found) == math.copysign(1.0, math.atan2(y, x))


@pytest.mark.parametrize("shared", [True, False], ids=["one ship", "a ship a lane"])
@pytest.mark.parametrize("name", SHIPS)
def test_a_ship_in_a_batch_sails_as_it_does_alone(name, shared):
    """Every lane with a rudder of its own, against one simulation for three of them."""
    model = shipgym.load_model(name)
    n_state = len(model.state_names)
    h, steps, tiles = (
        0.02 * model.particulars["length"] / model.particulars["speed"],
        60,
        2,
    )
    rudders = np.radians(np.linspace(-30.0, 30.0, tiles * LANES))
    states = np.repeat(np.tile(model.service_state, (tiles, 1)), LANES, 1)
    commands = np.empty((tiles, 2, LANES))
    commands[:, 0], commands[:, 1] = (
        rudders.reshape(tiles, -1),
        model.service_shaft_speed,
    )
    advance = ship_loop(model.compiled, "shared_ship" if shared else "per_ship")
    ships = np.repeat(model.ship_numbers(), 1 if shared else LANES)
    advance(states, commands.reshape(tiles, -1), h, steps, ships[None])
    lanes = (
        states.reshape(tiles, n_state, LANES).transpose(0, 2, 1).reshape(-1, n_state)
    )
    for lane in (0, 40, 127):
        held = np.tile(model.service_command, (steps, 1))
        held[:, 0] = rudders[lane]
        alone = model.simulate(held, h)
        for channel, value in zip(model.state_names, lanes[lane], strict=True):
            assert value == pytest.approx(alone[channel][-1], rel=1e-10, abs=1e-12), (
                channel
            )


def test_powers_of_two_are_exact_to_two_parts_in_a_hundred_million_million():
    x = np.concatenate([np.linspace(-30.0, 0.0, 1201), [-999.75, -513.4, -1e-9]])
    np.testing.assert_allclose([two_to(one) for one in x], np.exp2(x), rtol=2e-14)
    assert two_to(-5000.0) == two_to(-1000.0) == pytest.approx(2.0**-1000, rel=2e-14)
    whole = np.array([-1022.0, -60.0, -1.0, 0.0, 1.0, 40.0, 1023.0])
    assert [power_of_two(one) for one in whole] == np.exp2(whole).tolist()


def test_the_nearest_whole_number_is_even_at_a_half():
    x = [-1.6, -1.5, -0.5, 0.4, 0.5, 1.5, 2.5, 1e15 + 0.5]
    assert [nearest(one) for one in x] == np.round(x).tolist()


@pytest.mark.parametrize(
    ("largest", "error"), [(0.6, 2e-16), (np.pi / 4, 2e-14), (np.pi / 2, 1e-9)]
)
def test_sine_and_cosine_of_a_turn_within_a_step_have_their_stated_error(
    largest, error
):
    x = np.linspace(-largest, largest, 1001)
    found = np.array([turn_sin_cos(angle) for angle in x])
    np.testing.assert_allclose(
        found, np.stack([np.sin(x), np.cos(x)], axis=1), rtol=0.0, atol=error
    )


def test_a_number_is_clipped_to_its_bounds_and_one_of_two_is_picked():
    assert [clip(one, -1.0, 2.0) for one in (-3.0, -1.0, 0.5, 2.0, 9.0)] == [
        -1.0,
        -1.0,
        0.5,
        2.0,
        2.0,
    ]
    assert (pick(True, 1.0, 2.0), pick(False, 1.0, 2.0)) == (1.0, 2.0)


def test_angles_at_the_seam_are_wrapped_to_minus_half_a_turn():
    for turns in (-7, -1, 0, 1, 4):
        assert wrap(2 * turns * math.pi + 0.25) == pytest.approx(0.25, abs=1e-12)
    assert wrap(math.pi) == -math.pi
    assert wrap(-math.pi) == -math.pi


def test_sine_and_cosine_to_the_last_digits():
    angles = np.linspace(-500.0, 500.0, 20001)
    found = np.array([sin_cos(angle) for angle in angles])
    expected = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-15)


def test_small_angles_have_the_sine_and_cosine_of_the_library():
    x = np.linspace(-np.pi / 2, np.pi / 2, 2001)
    found = np.array([small_sin_cos(angle) for angle in x])
    expected = np.stack([np.sin(x), np.cos(x)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=4e-16)
    cosines = [small_cosine(angle) for angle in x]
    np.testing.assert_allclose(cosines, np.cos(x), rtol=0.0, atol=4e-16)
    assert small_sin_cos(np.pi) == pytest.approx((0.0, -1.0), abs=3e-9)


def test_wrapped_angles_are_the_same_direction():
    angles = np.linspace(-30.0, 30.0, 997)
    wrapped = np.array([wrap(angle) for angle in angles])
    assert np.all((wrapped >= -np.pi) & (wrapped < np.pi))
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)
