"""Wind on ships: published coefficients, symmetry, scaling, and gusts against their
spectra.
"""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import InputError, Particulars, Wind, load_model
from shipgym.sea import (
    WindTable,
    gust_filter,
    gust_spectrum,
    gust_variance,
    wind_curves,
)
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.gusts import GaussMarkov
from shipgym.sea.wind_coefficients import (
    BLENDERMANN,
    ISHERWOOD,
    blendermann_type,
    coefficient_names,
    isherwood_coefficients,
)
from tests.shipgym.harmonics import evaluate_cosines, evaluate_sines

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
    i = round(degrees * len(curves.angle) / 360)
    return curves.X[i], curves.Y[i], curves.N[i], curves.K[i]


def test_blendermanns_resistances_stand_ahead_abeam_and_astern():
    row = BLENDERMANN["container-loaded"]
    curves = wind_curves(S175, "blendermann-container-loaded")
    assert at(curves, 0)[0] == pytest.approx(-row.CD_l_bow * 600.0)
    assert at(curves, 180)[0] == pytest.approx(row.CD_l_stern * 600.0)
    assert at(curves, 90)[1] == pytest.approx(-row.CD_t * 2700.0)
    assert at(curves, 90)[2] == pytest.approx(
        row.CD_t * 2700.0 * 4.0
    )  # lever of the centroid
    assert at(curves, 90)[3] == pytest.approx(-row.kappa * row.CD_t * 2700.0 * 9.0)
    loaded = wind_curves(S175, "blendermann-cargo-loaded").X / 600.0
    row = BLENDERMANN["cargo-loaded"]
    assert row.CD_l_bow != row.CD_l_stern
    assert (loaded[0], loaded[len(loaded) // 2]) == pytest.approx(
        (-row.CD_l_bow, row.CD_l_stern)
    )


def test_blendermann_at_30_degrees_worked_by_hand():
    # delta 0.4, CDl / CDt = 0.55 * 600 / 2700 / 0.9, sin(60 deg)^2 = 0.75
    denominator = 1.0 - 0.2 * (1.0 - 0.55 * 600.0 / 2700.0 / 0.9) * 0.75
    surge, sway, yaw, _ = at(wind_curves(S175, "blendermann-container-loaded"), 30)
    assert surge == pytest.approx(-0.55 * 600.0 * np.cos(np.pi / 6) / denominator)
    assert sway == pytest.approx(-0.9 * 0.5 * 2700.0 / denominator)
    assert yaw == pytest.approx(sway * 180.0 * (-4.0 / 180.0 + 0.18 * np.pi / 3))


def test_isherwood_worked_by_hand():
    length, beam, lateral, frontal = 180.0, 25.4, 2700.0, 600.0
    perimeter = length + 2.0 * lateral / length + 2.0 * 0.07 * 175.0
    CX_60 = -(
        0.913
        - 4.68 * 2.0 * lateral / length**2
        - 0.104 * length / beam
        + 0.482 * perimeter / length
        + 0.104
    )
    CY_90 = 0.889 + 0.138 * 2.0 * frontal / beam**2 - 0.66 * (90.0 + 4.0) / length
    CN_90 = 0.2627 - 0.508 * (90.0 + 4.0) / length
    curves = wind_curves(S175, "isherwood")
    assert at(curves, 60)[0] == pytest.approx(CX_60 * frontal)
    assert at(curves, 90)[1] == pytest.approx(-CY_90 * lateral)
    assert at(curves, 90)[2] == pytest.approx(-CN_90 * lateral * length)
    assert at(curves, 90)[3] == pytest.approx(
        at(curves, 90)[1] * 9.0
    )  # heels about the waterline
    house = 0.15 * 0.07 * 175.0**2
    CY_130 = (
        1.014
        + 0.191 * 2.0 * frontal / beam**2
        - 0.280 * perimeter / length
        - 0.69 * 94.0 / length
    )
    assert at(curves, 130)[1] == pytest.approx(
        -(CY_130 + 0.44 * house / lateral) * lateral
    )
    low = replace(
        S175, lateral_area=300.0
    )  # of which a house of 322 m2 cannot be more than nine tenths
    given = 180.0, 25.4, 300.0, 600.0, 180.0 + 600.0 / 180.0 + 24.5, 94.0, 2.0, 270.0
    assert at(wind_curves(low, "isherwood"), 130)[1] == pytest.approx(
        -isherwood_coefficients(*given)[1][13] * 300.0
    )


def test_isherwoods_superstructure_is_felt_on_the_quarter_only():
    hull = {
        "length": 180.0,
        "beam": 25.4,
        "lateral_area": 2700.0,
        "frontal_area": 600.0,
        "perimeter": 234.5,
    }
    bare, housed = (
        isherwood_coefficients(
            **hull, bow_to_centroid=94.0, masts=2.0, superstructure_area=area
        )
        for area in (0.0, 0.5 * 2700.0)
    )
    angles = np.arange(0, 181, 10)
    more = dict(
        zip(angles.tolist(), (housed[1] - bare[1]).round(12).tolist(), strict=True)
    )
    assert {angle: value for angle, value in more.items() if value} == {
        120: 0.17,
        130: 0.22,
        140: 0.19,
        150: 0.135,
    }
    np.testing.assert_array_equal(bare[0], housed[0])
    np.testing.assert_array_equal(bare[2], housed[2])


def test_published_tables_keep_their_numbers():
    """Sums of the columns of Isherwood's three tables and of Blendermann's."""
    found = [table.sum(axis=0).round(6).tolist() for table in ISHERWOOD.values()]
    assert found == [
        [6.664, -13.63, 0.929, -0.633, -2.477, 4.63, 0.115],
        [11.104, 7.43, 1.686, 0.003, -1.283, -7.54, 1.43],
        [2.3069, 2.589, -0.2483, 0.086, 0.4644, -6.981],
    ]
    sums = np.sum(list(BLENDERMANN.values()), axis=0)
    assert sums.round(6).tolist() == [14.65, 10.35, 10.525, 9.0, 24.8]


@pytest.mark.parametrize("coefficients", coefficient_names())
def test_wind_pushes_to_lee_and_its_mirror_image_the_other_way(coefficients):
    curves = wind_curves(S175, coefficients)
    mirror = -np.arange(len(curves.angle))
    np.testing.assert_allclose(curves.X, curves.X[mirror], atol=1e-9)
    for odd in (curves.Y, curves.N, curves.K):
        np.testing.assert_allclose(odd, -odd[mirror], atol=1e-6)
    # on the starboard bow: back, to port, bow to port, heeling to port
    assert np.sign(at(curves, 40)).tolist() == [-1, -1, -1, -1]
    assert np.sign(at(curves, 320)).tolist() == [-1, 1, 1, 1]


@pytest.mark.parametrize("coefficients", coefficient_names())
@pytest.mark.parametrize("ship", [S175, KVLCC2])
def test_eight_harmonics_stay_near_the_curve(coefficients, ship):
    curves = wind_curves(ship, coefficients)
    series = curves.harmonics()
    assert [len(row) for row in series] == [9, 8, 8, 8]
    allowed = 0.09 if coefficients == "isherwood" else 0.015
    for name in "XYNK":
        curve = getattr(curves, name)
        sums = evaluate_cosines if name == "X" else evaluate_sines
        error = np.abs(sums(getattr(series, name), curves.angle) - curve).max()
        assert error < allowed * np.abs(curve).max()


def test_similar_ships_have_the_same_coefficients():
    ship = {"length": 320.0, "beam": 58.0, "draught": 20.8}
    model = {name: value / 50.0 for name, value in ship.items()}
    large, small = (
        wind_curves(Particulars(**sizes, block_coefficient=0.81))
        for sizes in (ship, model)
    )
    np.testing.assert_allclose(large.Y, small.Y * 50.0**2, atol=1e-6)
    np.testing.assert_allclose(large.N, small.N * 50.0**3, atol=1e-4)


def test_fullness_picks_the_type_of_ship():
    np.testing.assert_array_equal(
        wind_curves(KVLCC2).X, wind_curves(KVLCC2, "blendermann-tanker-loaded").X
    )
    np.testing.assert_array_equal(
        wind_curves(S175).X, wind_curves(S175, "blendermann-container-loaded").X
    )
    types = [
        blendermann_type("blendermann", fullness)
        for fullness in (0.64, 0.65, 0.66, 0.74, 0.75, 0.76)
    ]
    assert types == ["container-loaded", *["cargo-loaded"] * 3, *["tanker-loaded"] * 2]
    assert blendermann_type("blendermann-ferry", 0.9) == "ferry"


def test_the_house_of_a_full_hull_stands_aft():
    """From a block coefficient of 0.75 on."""
    for fullness, aft in ((0.74, False), (0.75, True), (0.76, True)):
        hull = Particulars(
            length=120.0, beam=20.0, draught=6.0, block_coefficient=fullness
        )
        assert (weather_particulars(hull).lateral_centroid < 0.0) == aft


def test_frequencies_of_norsoks_gusts_are_those_it_is_given_for():
    """From 1/2400 Hz to 0.5 Hz."""
    f = np.geomspace(1.0 / 2400.0, 0.5, 20_000)
    integral = np.trapezoid(f * gust_spectrum(f, 20.0, "norsok"), np.log(f))
    assert gust_variance(20.0, "norsok") == pytest.approx(integral, rel=1e-5)


def test_estimates_are_marked_and_given_areas_are_used():
    assert wind_curves(S175).estimated == ()
    assert wind_curves(KVLCC2).estimated == tuple(sorted(AREAS))
    estimated = weather_particulars(KVLCC2)
    assert estimated.lateral_centroid < 0.0  # a tanker's house stands aft
    # depth 30.0 m less draught 20.8 m, by length overall, is less than the lateral area
    # with the house
    assert 330.0 * 9.2 < estimated.lateral_area < 1.5 * 330.0 * 9.2


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


def test_a_table_of_ones_own_is_followed():
    table = WindTable(
        (0, 90, 180),
        (-0.6, 0.0, 0.5),
        (0.0, 0.8, 0.0),
        (0.0, 0.05, 0.0),
        (0.0, 1.2, 0.0),
    )
    curves = wind_curves(S175, table)
    assert at(curves, 45) == pytest.approx(
        (-0.3 * 600, -0.4 * 2700, -0.025 * 2700 * 180, -0.6 * 2700 * 2700 / 180)
    )
    np.testing.assert_array_equal(wind_curves(S175, replace(table, CK=None)).K, 0.0)


def test_coefficients_that_are_not_known_are_refused():
    with pytest.raises(InputError, match=r"wind coefficients: .* got 'isherwod'"):
        wind_curves(S175, "isherwod")


def test_wind_needs_proportions():
    with pytest.raises(
        InputError,
        match="weather without the particulars it needs: beam, draught, block_coef",
    ):
        wind_curves(Particulars(length=100.0))


@pytest.mark.parametrize("speed", [5.0, 20.0])
@pytest.mark.parametrize("spectrum", ["harris", "davenport"])
def test_variance_of_gusts_is_the_integral_of_their_spectrum(spectrum, speed):
    f = np.geomspace(1e-9, 1e5, 40_000)
    integral = np.trapezoid(f * gust_spectrum(f, speed, spectrum), np.log(f))
    assert gust_variance(speed, spectrum) == pytest.approx(integral, rel=1e-4)


def test_gusts_are_as_strong_as_over_a_rough_sea():
    # turbulence intensity: sqrt(6.677 * 0.003) and sqrt(6 * 0.003); NORSOK's own
    # formula 0.06 (1 + 0.043 V)
    assert gust_filter(Wind(15.0)).standard_deviation / 15.0 == pytest.approx(
        0.1415, abs=1e-4
    )
    assert gust_filter(
        Wind(15.0, spectrum="davenport")
    ).standard_deviation / 15.0 == pytest.approx(0.1342, abs=1e-4)
    norsok = gust_filter(Wind(15.0, spectrum="norsok")).standard_deviation / 15.0
    assert norsok == pytest.approx(0.06 * (1.0 + 0.043 * 15.0), rel=0.15)
    assert gust_filter(Wind(15.0, gust=False)).standard_deviation == 0.0


def test_time_constants_of_gusts_are_those_of_their_most_energetic_frequency():
    """T = 1 / (2 pi f): 165.4 m and 110.3 m by the wind speed, Harris and Davenport."""
    for speed in (5.0, 20.0):
        assert gust_filter(Wind(speed)).time_constant == pytest.approx(
            165.4 / speed, rel=1e-3
        )
        davenport = gust_filter(Wind(speed, spectrum="davenport")).time_constant
        assert davenport == pytest.approx(110.3 / speed, rel=1e-3)


@pytest.mark.parametrize(
    ("spectrum", "bound"), [("harris", 0.18), ("davenport", 0.21), ("norsok", 0.65)]
)
@pytest.mark.parametrize("speed", [5.0, 10.0, 25.0])
def test_the_filter_has_the_energy_of_the_spectrum_where_it_is(spectrum, bound, speed):
    wind = Wind(speed, spectrum=spectrum)
    f = np.geomspace(1.0 / 2400.0, 0.5, 500)
    energy, filtered = (
        f * gust_spectrum(f, speed, spectrum),
        f * gust_filter(wind).spectrum(f),
    )
    assert f[np.argmax(filtered)] == pytest.approx(f[np.argmax(energy)], rel=0.03)
    assert np.abs(filtered - energy).max() < bound * energy.max()


def test_a_simulated_gust_has_the_spectrum_of_the_filter():
    from scipy.signal import lfilter, welch

    gust, step, n = gust_filter(Wind(12.0)), 0.5, 2**18
    decay = np.exp(-step / gust.time_constant)
    noise = (
        np.random.default_rng(1).standard_normal(n)
        * gust.standard_deviation
        * np.sqrt(1.0 - decay**2)
    )
    wind = lfilter([1.0], [1.0, -decay], noise)
    assert wind.var() == pytest.approx(gust.standard_deviation**2, rel=0.03)
    f, density = welch(wind, 1.0 / step, nperseg=2048)
    low = (f > 0) & (f < 0.1)  # well below the Nyquist frequency of 1 Hz
    np.testing.assert_allclose(density[low], gust.spectrum(f[low]), rtol=0.25)
    assert density[low].sum() == pytest.approx(gust.spectrum(f[low]).sum(), rel=0.03)


def test_the_spectrum_of_a_process_holds_its_variance_and_halves_at_its_corner():
    process = GaussMarkov(30.0, 2.0)
    f = np.concatenate([[0.0], np.geomspace(1e-7, 1e4, 200_000)])
    assert np.trapezoid(process.spectrum(f), f) == pytest.approx(4.0, rel=1e-4)
    assert process.spectrum(1.0 / (2.0 * np.pi * 30.0)) == pytest.approx(
        0.5 * process.spectrum(0.0)
    )
