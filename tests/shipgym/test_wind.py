"""Wind on ships: published coefficients, symmetry, scaling, and gusts against their
spectra.
"""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import InputError, Particulars, Wind, load_model
from shipgym.sea import weather_particulars, wind_curves
from shipgym.sea.wind import gust_filter

AREAS = {
    "length_overall": 180.0,
    "frontal_area": 600.0,
    "lateral_area": 2700.0,
    "lateral_centroid": -4.0,
    "lateral_centroid_height": 9.0,
}
S175 = replace(load_model("container").particulars, **AREAS)
KVLCC2 = load_model("kvlcc2").particulars


def at(curves, degrees):
    """X, Y, N and K where the wind comes from there."""
    i = round(degrees * len(curves.X) / 360)
    return curves.X[i], curves.Y[i], curves.N[i], curves.K[i]


def test_blendermann_at_30_degrees_worked_by_hand():
    # delta 0.4, CDl / CDt = 0.55 * 600 / 2700 / 0.9, sin(60 deg)^2 = 0.75
    denominator = 1.0 - 0.2 * (1.0 - 0.55 * 600.0 / 2700.0 / 0.9) * 0.75
    surge, sway, yaw, _ = at(wind_curves(S175), 30)
    assert surge == pytest.approx(-0.55 * 600.0 * np.cos(np.pi / 6) / denominator)
    assert sway == pytest.approx(-0.9 * 0.5 * 2700.0 / denominator)
    assert yaw == pytest.approx(sway * 180.0 * (-4.0 / 180.0 + 0.18 * np.pi / 3))


@pytest.mark.parametrize("fullness", [0.56, 0.7, 0.81])
def test_wind_pushes_to_lee_and_its_mirror_image_the_other_way(fullness):
    curves = wind_curves(replace(S175, block_coefficient=fullness, mass=None))
    mirror = -np.arange(len(curves.X))
    np.testing.assert_allclose(curves.X, curves.X[mirror], atol=1e-9)
    for odd in (curves.Y, curves.N, curves.K):
        np.testing.assert_allclose(odd, -odd[mirror], atol=1e-6)
    # on the starboard bow: back, to port, bow to port, heeling to port
    assert np.sign(at(curves, 40)).tolist() == [-1, -1, -1, -1]
    assert np.sign(at(curves, 320)).tolist() == [-1, 1, 1, 1]


def test_similar_ships_have_the_same_coefficients():
    ship = {"length": 320.0, "beam": 58.0, "draught": 20.8}
    model = {name: value / 50.0 for name, value in ship.items()}
    large, small = (
        wind_curves(Particulars(**sizes, block_coefficient=0.81))
        for sizes in (ship, model)
    )
    np.testing.assert_allclose(large.Y, small.Y * 50.0**2, atol=1e-6)
    np.testing.assert_allclose(large.N, small.N * 50.0**3, atol=1e-4)


def test_what_is_not_known_above_the_water_is_estimated_as_documented():
    """KVLCC2, 320 x 58 x 20.8 m, CB 0.81.

    A house of 48 x 22.4 m stands at 0.42 L aft, 0.6 B wide.
    """
    ship = weather_particulars(KVLCC2)
    deck, house = 20.8 * (1.3 - 1.05 * 0.81), 48.0 * 22.4
    assert ship.length_overall == pytest.approx(1.03 * 320.0)
    assert ship.frontal_area == pytest.approx(58.0 * (deck + 0.6 * 22.4))
    assert ship.lateral_area == pytest.approx(329.6 * deck + house)
    assert ship.lateral_centroid == pytest.approx(
        -0.42 * 320.0 * house / (329.6 * deck + house)
    )
    height = (329.6 * deck * deck / 2.0 + house * (deck + 11.2)) / (
        329.6 * deck + house
    )
    assert ship.lateral_centroid_height == pytest.approx(height)
    assert ship.metacentric_height == pytest.approx(2.9)
    factor = 0.373 + 0.023 * 58.0 / 20.8 - 0.043 * 3.2  # below 0.3, which counts
    assert factor < 0.3
    assert ship.roll_period == pytest.approx(2.0 * 0.3 * 58.0 / np.sqrt(2.9))
    fine = weather_particulars(
        Particulars(length=120.0, beam=20.0, draught=5.0, block_coefficient=0.6)
    )
    assert fine.lateral_centroid == 0.0  # the house amidships
    factor = 0.373 + 0.023 * 4.0 - 0.043 * 1.2
    assert fine.roll_period == pytest.approx(2.0 * factor * 20.0 / np.sqrt(1.0))
    boat = weather_particulars(
        Particulars(length=12.0, beam=4.0, draught=1.0, block_coefficient=0.5)
    )
    assert boat.roll_period == pytest.approx(
        2.0 * (0.373 + 0.092 - 0.043) * 4.0 / np.sqrt(0.2)
    )


def test_wind_needs_proportions():
    with pytest.raises(
        InputError,
        match=r"weather without the particulars it needs: .* without beam, draught",
    ):
        wind_curves(Particulars(length=100.0))


def test_gusts_have_the_variance_and_the_most_energetic_frequency_of_harris():
    """Turbulence intensity sqrt(6.677 * 0.003); T = 1 / (2 pi f) = 165.4 m / V."""
    for speed in (5.0, 20.0):
        gust = gust_filter(Wind(speed))
        assert gust.standard_deviation / speed == pytest.approx(0.1415, abs=1e-4)
        assert gust.time_constant == pytest.approx(165.4 / speed, rel=1e-3)
    assert gust_filter(Wind(15.0, gust=False)).standard_deviation == 0.0
