"""Spectra, filters and first-order motion of the sea against theory."""

from dataclasses import replace

import numpy as np
import pytest

from shipgym import Particulars, Waves, load_model
from shipgym.constants import GRAVITY
from shipgym.sea import (
    jonswap,
    wave_drift,
    wave_motion,
    weather_particulars,
)
from shipgym.sea.motions import effective_wave_slope, heading_response
from shipgym.sea.waves import pierson_moskowitz, wave_filter

GAMMAS = [1.0, 2.0, 3.3, 7.0]
SHIPS = ["mariner", "container", "tanker", "kvlcc2", "kvlcc2-l7"]
MARINER = weather_particulars(load_model("mariner").particulars)


def moment(order, Tp, gamma):
    w = np.geomspace(0.2, 200.0, 60_000) / Tp * 2.0 * np.pi
    return np.trapezoid(w ** (order + 1) * jonswap(w, 3.0, Tp, gamma), np.log(w))


@pytest.mark.parametrize("Tp", [4.0, 8.0, 15.0])
@pytest.mark.parametrize("gamma", GAMMAS)
def test_the_variance_is_that_of_the_significant_height(gamma, Tp):
    assert moment(0, Tp, gamma) == pytest.approx(3.0**2 / 16.0, rel=1e-5)


def test_pierson_moskowitz_is_jonswap_without_enhancement():
    w = np.linspace(0.0, 4.0, 200)
    np.testing.assert_array_equal(
        pierson_moskowitz(w, 2.0, 7.0), jonswap(w, 2.0, 7.0, 1.0)
    )
    assert pierson_moskowitz(0.0, 2.0, 7.0) == 0.0
    # by the wind, as in 1964: 0.0081 g^2 / w^5 exp(-0.74 (g / (U w))^4), Hs = 2
    # sqrt(0.0081 / 0.74) U^2 / g
    U = 12.0
    peak = (0.8 * 0.74) ** 0.25 * GRAVITY / U
    Hs = 2.0 * np.sqrt(0.0081 / 0.74) * U**2 / GRAVITY
    by_wind = (
        0.0081 * GRAVITY**2 / w[1:] ** 5 * np.exp(-0.74 * (GRAVITY / (U * w[1:])) ** 4)
    )
    np.testing.assert_allclose(
        pierson_moskowitz(w[1:], Hs, 2.0 * np.pi / peak), by_wind, rtol=1e-9, atol=1e-30
    )


def test_damping_of_the_filter_is_that_of_the_handbook():
    # Fossen 2011, 8.2.6: about 0.1 for JONSWAP and 0.26 for Pierson-Moskowitz, fitted
    # at equal peaks
    assert wave_filter(Waves(2.0, 8.0)).damping == pytest.approx(0.1, abs=0.01)
    fully_developed = wave_filter(Waves(2.0, 8.0, peak_enhancement=1.0)).damping
    assert fully_developed == pytest.approx(0.26, abs=0.05)


@pytest.mark.parametrize(("gamma", "bound"), [(1.0, 0.20), (3.3, 0.08), (7.0, 0.07)])
def test_the_filter_stays_near_the_spectrum(gamma, bound):
    w = np.linspace(0.02, 4.0, 2000)
    target = jonswap(w, 4.0, 2.0 * np.pi, gamma)
    error = np.abs(
        wave_filter(Waves(1.0, 2.0 * np.pi, peak_enhancement=gamma)).spectrum(w)
        - target
    )
    assert error.max() < bound * target.max()


@pytest.mark.parametrize("chi_deg", [20.0, 70.0, 135.0])
def test_heading_is_the_mean_slope_of_the_waters_path_along_the_hull(chi_deg):
    chi, omega = np.radians(chi_deg), 0.7
    L, T = MARINER.length, MARINER.draught
    k = omega**2 / GRAVITY
    x = np.linspace(-L / 2, L / 2, 20_001)
    sideways = np.sin(chi) * np.exp(-k * T / 2) * np.sin(k * x * np.cos(chi))
    fitted = np.trapezoid(x * sideways, x) / (
        L**3 / 12.0
    )  # least squares for a straight line
    assert heading_response(omega, chi, MARINER) == pytest.approx(abs(fitted), rel=1e-6)


def test_in_long_waves_the_ship_follows_the_slope():
    omega, chi = 0.05, np.radians(60.0)
    k = omega**2 / GRAVITY
    assert heading_response(omega, chi, MARINER) == pytest.approx(
        k * np.sin(chi) * np.cos(chi), rel=2e-3
    )
    assert effective_wave_slope(omega, chi, MARINER) == pytest.approx(
        k * np.sin(chi), rel=0.03
    )


def test_long_crested_waves_from_ahead_neither_turn_nor_heel():
    heading, slope = wave_motion(Waves(3.0, 9.0, spreading="long-crested"), MARINER)
    assert heading[[0, 180]] == pytest.approx(0.0, abs=1e-20)
    assert slope[[0, 180]] == pytest.approx(0.0, abs=1e-20)
    assert slope[90] > 100.0 * slope[5]


def test_without_a_service_speed_a_ship_lies_still_in_waves():
    ship = Particulars(length=160.0, beam=23.0, draught=8.0, block_coefficient=0.6)
    still, slow, under_way = (
        wave_drift(Waves(2.0, 8.0), replace(ship, speed=speed)).X
        for speed in (None, 1e-6, 7.0)
    )
    np.testing.assert_allclose(still, slow, rtol=1e-4)
    assert np.abs(under_way - still).max() > 1e-3 * np.abs(still).max()
