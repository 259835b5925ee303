"""Spectra, filters and first-order motion of the sea against theory."""

import numpy as np
import pytest

from shipgym import InputError, Particulars, Waves, load_model
from shipgym.constants import GRAVITY
from shipgym.sea import (
    encounter_frequency,
    jonswap,
    pierson_moskowitz,
    sea_states,
    wave_filter,
    wave_motion,
)
from shipgym.sea.drift import wave_drift
from shipgym.sea.estimates import weather_particulars
from shipgym.sea.harmonics import circle
from shipgym.sea.motions import heading_response, roll_response
from shipgym.sea.waves import over_directions
from tests.shipgym.harmonics import evaluate_cosines

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


@pytest.mark.parametrize("gamma", GAMMAS)
def test_the_peak_is_at_the_peak_period(gamma):
    w = np.linspace(0.3, 3.0, 27_001)
    assert w[np.argmax(jonswap(w, 2.0, 9.0, gamma))] == pytest.approx(
        2.0 * np.pi / 9.0, abs=1e-4
    )


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


@pytest.mark.parametrize("gamma", GAMMAS)
def test_zero_crossing_period_is_that_of_the_rule_book(gamma):
    # DNV-RP-C205, 3.5.5.5, an approximation for gamma from 1 to 7
    ratio = 0.6673 + 0.05037 * gamma - 0.006230 * gamma**2 + 0.0003341 * gamma**3
    zero_crossing = 2.0 * np.pi * np.sqrt(moment(0, 8.0, gamma) / moment(2, 8.0, gamma))
    assert zero_crossing / 8.0 == pytest.approx(ratio, rel=0.005)


def test_waves_are_met_faster_ahead_and_not_at_all_when_sailing_with_them():
    assert encounter_frequency(0.8, 0.0, 1.0) == pytest.approx(0.8)
    assert encounter_frequency(0.8, 10.0, 0.0) == pytest.approx(
        0.8 + 0.64 * 10.0 / GRAVITY
    )
    assert encounter_frequency(0.8, GRAVITY / 0.8, np.pi) == pytest.approx(
        0.0, abs=1e-12
    )
    assert encounter_frequency(0.8, 10.0, np.pi / 2) == pytest.approx(0.8)


@pytest.mark.parametrize("Tp", [6.0, 12.0])
@pytest.mark.parametrize("gamma", GAMMAS)
def test_the_wave_filter_has_unit_variance(gamma, Tp):
    from scipy.linalg import solve_continuous_lyapunov

    w0, damping, gain = wave_filter(Waves(2.0, Tp, peak_enhancement=gamma))
    A = np.array([[0.0, 1.0], [-w0 * w0, -2.0 * damping * w0]])
    covariance = solve_continuous_lyapunov(
        A, -np.diag([0.0, gain * gain])
    )  # output is the second state
    assert covariance[1, 1] == pytest.approx(1.0)
    w = np.geomspace(1e-4, 1e4, 40_000)
    filtered = wave_filter(Waves(2.0, Tp, peak_enhancement=gamma)).spectrum(w)
    assert np.trapezoid(w * filtered, np.log(w)) == pytest.approx(1.0, rel=1e-4)
    assert w0 == pytest.approx(2.0 * np.pi / Tp)


def test_damping_of_the_filter_is_that_of_the_handbook():
    # Fossen 2011, 8.2.6: about 0.1 for JONSWAP and 0.26 for Pierson-Moskowitz, fitted
    # at equal peaks
    assert wave_filter(Waves(2.0, 8.0)).damping == pytest.approx(0.1, abs=0.01)
    fully_developed = wave_filter(Waves(2.0, 8.0, spectrum="pierson-moskowitz")).damping
    assert fully_developed == pytest.approx(0.26, abs=0.05)
    assert (
        fully_developed == wave_filter(Waves(4.0, 14.0, peak_enhancement=1.0)).damping
    )


@pytest.mark.parametrize(("gamma", "bound"), [(1.0, 0.20), (3.3, 0.08), (7.0, 0.07)])
def test_the_filter_stays_near_the_spectrum(gamma, bound):
    w = np.linspace(0.02, 4.0, 2000)
    target = jonswap(w, 4.0, 2.0 * np.pi, gamma)
    error = np.abs(
        wave_filter(Waves(1.0, 2.0 * np.pi, peak_enhancement=gamma)).spectrum(w)
        - target
    )
    assert error.max() < bound * target.max()


def test_simulated_waves_have_the_spectrum_of_the_filter():
    from scipy.signal import bilinear, lfilter, welch

    w0, damping, gain = wave_filter(Waves(3.0, 9.0))
    step, n = 0.1, 2**18
    b, a = bilinear([gain, 0.0], [1.0, 2.0 * damping * w0, w0 * w0], 1.0 / step)
    output = lfilter(b, a, np.random.default_rng(2).standard_normal(n) / np.sqrt(step))
    assert output.var() == pytest.approx(1.0, rel=0.04)
    f, density = welch(output, 1.0 / step, nperseg=2048)
    band = (f > 0.05) & (f < 0.5)
    theory = 2.0 * np.pi * wave_filter(Waves(3.0, 9.0)).spectrum(2.0 * np.pi * f[band])
    assert np.abs(density[band] - theory).max() < 0.2 * theory.max()


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
    assert roll_response(omega, chi, MARINER, 0.0) == pytest.approx(
        k * np.sin(chi), rel=0.03
    )


def test_roll_resonates_with_its_natural_period():
    natural = 2.0 * np.pi / MARINER.roll_period
    k = natural**2 / GRAVITY
    slope = (
        k * np.exp(-k * MARINER.draught / 2) * np.sinc(0.5 * k * MARINER.beam / np.pi)
    )
    assert roll_response(natural, np.pi / 2, MARINER, 7.0) == pytest.approx(
        slope / (2.0 * 0.1), rel=1e-9
    )


def test_estimated_roll_period_is_that_of_the_container_ships_equations():
    from shipgym.ships import container as numbers

    inertia = (
        (numbers.PUBLISHED.Ix + numbers.PUBLISHED.Jx) * 0.5 * 1025.0 * numbers.LENGTH**5
    )
    stiffness = 1025.0 * numbers.WEIGHT * numbers.GM
    own = 2.0 * np.pi * np.sqrt(inertia / stiffness)
    estimated = weather_particulars(load_model("container").particulars)
    assert estimated.roll_period == pytest.approx(own, rel=0.05)
    assert "roll_period" in estimated.estimated
    assert "metacentric_height" not in estimated.estimated


def test_long_crested_waves_from_ahead_neither_turn_nor_heel():
    motion = wave_motion(Waves(3.0, 9.0, spreading="long-crested"), MARINER)
    assert motion.heading_variance[[0, 180]] == pytest.approx(0.0, abs=1e-20)
    assert motion.roll_variance[[0, 180]] == pytest.approx(0.0, abs=1e-20)
    assert motion.roll_variance[90] > 100.0 * motion.roll_variance[5]


def test_spreading_keeps_the_mean_over_all_directions():
    chi = circle()
    curve, sea = np.sin(chi) ** 4, Waves(1.0, 8.0)
    assert over_directions(curve, sea).mean() == pytest.approx(curve.mean())
    # (2 / pi) integral of cos(mu)^2 cos(2 mu) over half a circle is 1 / 2
    np.testing.assert_allclose(
        over_directions(np.cos(2 * chi), sea), 0.5 * np.cos(2 * chi), atol=1e-4
    )


def test_variances_grow_with_the_square_of_the_height():
    small, large = (wave_motion(Waves(height, 8.0), MARINER) for height in (1.0, 3.0))
    np.testing.assert_allclose(large.heading_variance, 9.0 * small.heading_variance)
    np.testing.assert_allclose(large.roll_variance, 9.0 * small.roll_variance)


@pytest.mark.parametrize("ship", SHIPS)
@pytest.mark.parametrize("state", ["slight", "moderate", "rough"])
def test_eight_harmonics_of_the_variances_suffice_in_a_spread_sea(ship, state):
    sea = sea_states()[state]
    motion = wave_motion(
        Waves(sea.significant_height, sea.peak_period), load_model(ship).particulars
    )
    for curve, series in (
        (motion.heading_variance, motion.heading_variance_harmonics(8)),
        (motion.roll_variance, motion.roll_variance_harmonics(8)),
    ):
        assert (
            np.abs(evaluate_cosines(series, motion.chi) - curve).max()
            < 0.003 * curve.max()
        )


def test_motion_of_a_simulated_sea_has_the_variance_of_the_integral():
    rng, sea = np.random.default_rng(3), Waves(2.5, 9.0, spreading="long-crested")
    omega = np.linspace(0.25, 4.0, 1500)
    t = np.arange(0.0, 3000.0, 0.5)
    amplitude = np.sqrt(2.0 * jonswap(omega, 2.5, 9.0) * (omega[1] - omega[0]))
    response = heading_response(omega, np.radians(60.0), MARINER) * amplitude
    heading = (
        np.cos(np.outer(t, omega) + rng.uniform(0.0, 2.0 * np.pi, len(omega)))
        @ response
    )
    assert heading.var() == pytest.approx(
        wave_motion(sea, MARINER).heading_variance[60], rel=0.08
    )


def test_series_of_the_motion_have_eight_harmonics():
    motion = wave_motion(Waves(2.0, 8.0), MARINER)
    assert (
        len(motion.heading_variance_harmonics())
        == len(motion.roll_variance_harmonics())
        == 9
    )
    drift = wave_drift(Waves(2.0, 8.0), MARINER).harmonics()
    assert [len(series) for series in drift] == [9, 8, 8, 8]
    assert not drift.K.any()


def test_without_a_service_speed_a_ship_lies_still_in_waves():
    ship = Particulars(length=160.0, beam=23.0, draught=8.0, block_coefficient=0.6)
    waves = Waves(2.0, 8.0)
    for look, curve in ((wave_motion, "roll_variance"), (wave_drift, "X")):
        unknown, still, under_way = (
            getattr(look(waves, ship, speed), curve) for speed in (None, 0.0, 7.0)
        )
        np.testing.assert_array_equal(unknown, still)
        assert np.abs(under_way - still).max() > 1e-3 * np.abs(still).max()


def test_motion_needs_proportions():
    with pytest.raises(
        InputError, match="weather without the particulars it needs: beam"
    ):
        wave_motion(Waves(2.0, 8.0), Particulars(length=100.0, draught=5.0, mass=5e6))
