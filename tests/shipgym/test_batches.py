"""Batched physics of bare ships, and the mathematics that lets its loops
be vectorised."""

import numpy as np
import pytest

import shipgym
from shipgym.engine.compiling import compiled
from shipgym.engine.loops import ship_loop
from shipgym.engine.mathematics import (
    arctan,
    arctan2,
    exponential,
    sin_cos,
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


def test_the_arc_tangent_is_exact_to_rounding_over_its_whole_range():
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((2, 100_000)) * 10.0 ** rng.uniform(
        -12.0, 12.0, (2, 100_000)
    )
    _, single, double = over(x, y)
    np.testing.assert_allclose(single, np.arctan(x), rtol=5e-16)
    np.testing.assert_allclose(double, np.arctan2(y, x), rtol=5e-16)


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


def test_sine_and_cosine_to_the_last_digits():
    angles = np.linspace(-500.0, 500.0, 20001)
    found = np.array([sin_cos(angle) for angle in angles])
    expected = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-15)


def test_wrapped_angles_are_the_same_direction():
    angles = np.linspace(-30.0, 30.0, 997)
    wrapped = np.array([wrap(angle) for angle in angles])
    assert np.all((wrapped >= -np.pi) & (wrapped < np.pi))
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)
