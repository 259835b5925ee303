from dataclasses import replace

import numpy as np
import pytest

from shipgym import InputError
from shipgym.envs.rendering import HULL, PATH, RUDDER, SIZE, Renderer, Scene

LENGTH, BEAM = 160.0, 40.0
SHIP = Scene(5000.0, -300.0, 0.0, 0.0, LENGTH, BEAM, np.radians(35.0), np.zeros((0, 2)))
CHART = slice(150, 520)  # rows without read-outs, compass and gauge
METRES = 14.0 * LENGTH / SIZE


@pytest.fixture(scope="module")
def renderer():
    return Renderer("rgb_array")


def where(picture, colour):
    """Rows and columns of a colour on the chart, from the middle: metres north and east."""
    rows, columns = np.nonzero(np.all(picture[CHART] == colour, axis=-1))
    return METRES * (SIZE / 2 - (rows + CHART.start)), METRES * (columns - SIZE / 2)


def test_the_ship_is_to_scale_and_north_is_up(renderer):
    picture = renderer.draw(SHIP)
    assert picture.shape == (SIZE, SIZE, 3)
    assert picture.dtype == np.uint8
    north, east = where(picture, HULL)
    hull = np.abs(east) > METRES  # without the line ahead
    assert np.ptp(north[hull]) == pytest.approx(0.95 * LENGTH, abs=6 * METRES)
    assert np.ptp(east) == pytest.approx(BEAM, abs=2.5 * METRES)
    _, east = where(renderer.draw(replace(SHIP, heading=np.pi / 2)), HULL)
    assert east.max() == pytest.approx(1.1 * LENGTH, abs=3 * METRES)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_to_starboard_shows_to_starboard(renderer, side):
    _, east = where(renderer.draw(replace(SHIP, rudder=side * 0.5)), RUDDER)
    assert side * east.mean() > METRES


def test_a_path_lies_where_it_is(renderer):
    path = np.array([[4000.0, -100.0], [6000.0, -100.0]])  # 200 m to starboard of the ship
    north, east = where(renderer.draw(replace(SHIP, waypoints=path, corridor=50.0)), PATH)
    assert east.mean() == pytest.approx(200.0, abs=2 * METRES)
    assert np.ptp(north) > 1000.0


def test_the_same_scene_gives_the_same_picture(renderer):
    assert np.array_equal(renderer.draw(SHIP), Renderer("rgb_array").draw(SHIP))


def test_an_unknown_mode_is_refused():
    with pytest.raises(InputError, match="expected one of 'human', 'rgb_array'"):
        Renderer("ansi")
