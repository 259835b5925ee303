"""Second-order wave forces against published curves, limits and Newman's approximation;
mobility.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shipgym import InputError, Particulars, Waves, load_model
from shipgym.constants import GRAVITY
from shipgym.sea import wave_drift, wave_motion, weather_particulars
from shipgym.sea.added_resistance import added_resistance
from shipgym.sea.drift import reflection_coefficients
from shipgym.sea.mobility import mobility_matrix
from shipgym.sea.waves import draught_attenuation, slow_drift, wave_spectrum
from shipgym.ships import get_structure
from shipgym.ships.inertia import inertia

SHIPS = ["mariner", "container", "tanker", "kvlcc2", "kvlcc2-l7"]
KVLCC2 = weather_particulars(load_model("kvlcc2").particulars)
S175 = weather_particulars(load_model("container").particulars)


def head_sea_curve(ship, froude):
    """Added resistance by rho g a^2 B^2 / L over wave by ship length."""
    lengths = np.linspace(0.3, 2.0, 171)
    omega = np.sqrt(2.0 * np.pi * GRAVITY / (lengths * ship.length))
    scale = ship.water_density * GRAVITY * ship.beam**2 / ship.length
    return (
        lengths,
        added_resistance(omega, 0.0, ship, froude * np.sqrt(GRAVITY * ship.length))
        / scale,
    )


@pytest.mark.parametrize(
    ("ship", "froude", "peak", "at"),
    [
        (
            KVLCC2,
            0.142,
            7.0,
            1.1,
        ),  # Sadat-Hosseini et al. 2013; Guo & Steen 2011: 6 to 8 near 1.1
        (S175, 0.25, 10.0, 1.15),  # Fujii & Takahashi 1975: 9 to 11 near 1.1 to 1.2
    ],
)
def test_added_resistance_peaks_where_model_tests_have_it(ship, froude, peak, at):
    lengths, curve = head_sea_curve(ship, froude)
    assert curve.max() == pytest.approx(peak, rel=0.15)
    assert lengths[np.argmax(curve)] == pytest.approx(at, abs=0.1)


@pytest.mark.parametrize(
    ("ship", "omega", "expected"),
    [
        (S175, 0.35, [2377.198, 2219.951, 143.2162, 43.28321, 288.3504, 68.41627]),
        (S175, 0.5, [120590.6, 117177.9, 21183.12, 3694.124, 12731.17, 11403.04]),
        (S175, 0.8, [71929.49, 84009.93, 146427.4, 88832.96, 17073.15, 12750.02]),
        (KVLCC2, 0.35, [273021.3, 262928.6, 86164.03, 2219.593, 10982.83, -2151.524]),
        (KVLCC2, 0.5, [328523.7, 339018.4, 640982.9, 230369.0, 42751.31, 14362.18]),
        (KVLCC2, 0.8, [307547.7, 314728.1, 467820.5, 111276.0, -45473.85, 34603.28]),
    ],
)
def test_added_resistance_is_that_of_the_procedure(ship, omega, expected):
    """ITTC 7.5-04-01-01.1, appendix G, at service speed, N/m2.

    Worked out apart, equation by equation.

    Waves from 0, 0.15, 1, 2, 2.6 and pi rad from the bow: all branches of its parts.
    """
    chi = np.array([0.0, 0.15, 1.0, 2.0, 2.6, np.pi])
    np.testing.assert_allclose(
        added_resistance(omega, chi, ship, ship.speed), expected, rtol=1e-5
    )


def test_a_wall_abeam_reflects_all_there_is():
    # waterplane coefficient to 1: a box, of which each metre takes up rho g a^2 / 2
    box = replace(KVLCC2, block_coefficient=0.999, mass=None)
    sway, yaw = reflection_coefficients(np.array([np.pi / 2]), box)
    assert sway == pytest.approx(-1.0, abs=0.01)
    assert yaw == pytest.approx(0.0, abs=1e-9)
    along, _ = reflection_coefficients(np.array([0.0, np.pi]), box)
    np.testing.assert_allclose(along, 0.0, atol=1e-12)


@pytest.mark.parametrize("ship", SHIPS)
def test_waves_push_to_lee_and_turn_the_ship_beam_on(ship):
    drift = wave_drift(Waves(2.0, 8.0), load_model(ship).particulars)
    bow, beam, quarter = 45, 90, 135  # from 45, 90 and 135 degrees to starboard
    assert drift.Y[[bow, beam, quarter]].max() < 0.0
    assert drift.N[bow] < 0.0 < drift.N[quarter]
    assert drift.X[[0, bow]].max() < 0.0
    mirror = -np.arange(len(drift.X))
    np.testing.assert_allclose(
        drift.X, drift.X[mirror], rtol=1e-9, atol=1e-9 * abs(drift.X[0])
    )
    np.testing.assert_allclose(
        drift.Y, -drift.Y[mirror], atol=1e-9 * abs(drift.Y[beam])
    )
    np.testing.assert_allclose(drift.N, -drift.N[mirror], atol=1e-9 * abs(drift.N[bow]))


def newman_spectrum(sea, draught, mu):
    """8 integral S(w) S(w + mu) c(w) c(w + mu) dw, over the square of the mean, 2
    integral S c dw.
    """
    w = np.linspace(0.15, 6.0, 4000)
    weighted = [
        wave_spectrum(sea, w + m) * draught_attenuation(w + m, draught)
        for m in (0.0, *mu)
    ]
    mean = 2.0 * np.trapezoid(weighted[0], w)
    return (
        np.array(
            [8.0 * np.trapezoid(weighted[0] * shifted, w) for shifted in weighted[1:]]
        )
        / mean**2
    )


@pytest.mark.parametrize("Tp", [7.5, 9.7, 14.0])
def test_slow_drift_has_the_variance_and_low_frequencies_of_newmans_integral(Tp):
    sea = Waves(2.0, Tp)
    slow = slow_drift(sea, S175)
    mu = np.linspace(1e-6, 4.0, 500)
    density = newman_spectrum(sea, S175.draught, mu)
    assert np.trapezoid(density, mu) == pytest.approx(
        slow.standard_deviation**2, rel=0.01
    )
    T = slow.time_constant
    filtered = 2.0 / np.pi * T / (1.0 + (mu * T) ** 2)  # per rad/s
    assert filtered[0] == pytest.approx(density[0], rel=0.01)
    below = mu < 0.1  # rad/s, to which a ship answers
    np.testing.assert_allclose(filtered[below], density[below], rtol=0.3)


@pytest.mark.parametrize("ship", ["mariner", "tanker", "kvlcc2", "kvlcc2-l7"])
def test_mobility_is_the_inverse_of_inertia(ship):
    model = load_model(ship)
    matrix = mobility_matrix(model)
    np.testing.assert_allclose(
        matrix[:3, :3] @ inertia(model)[:3, :3], np.eye(3), atol=1e-9
    )
    assert np.abs(matrix[3]).max() == np.abs(matrix[:, 3]).max() == 0.0


def test_a_structure_without_surge_and_sway_only_turns():
    mariner = load_model("mariner")
    table = get_structure("nomoto")
    coefficients = dict.fromkeys(table.coefficient_names, 0.1)
    model = replace(mariner, structure="nomoto", coefficients=coefficients)
    matrix = mobility_matrix(model)
    assert matrix[2, 2] == pytest.approx(1.0 / inertia(mariner)[2, 2])
    assert np.count_nonzero(matrix) == 1


def test_weather_tells_which_particulars_it_needs():
    model = load_model("mariner")
    bare = replace(model.particulars, beam=None, mass=None, block_coefficient=None)
    with pytest.raises(
        InputError,
        match=r"weather without the particulars it needs: .* without beam, block",
    ):
        mobility_matrix(replace(model, particulars=bare))


@given(
    length=st.floats(2.0, 400.0),
    slender=st.floats(4.0, 9.0),
    flat=st.floats(2.0, 6.0),
    fullness=st.floats(0.5, 0.9),
    froude=st.floats(0.0, 0.6),
    period=st.floats(0.5, 25.0),
    steepness=st.floats(0.001, 0.06),
)
@settings(max_examples=10, deadline=None)
def test_drift_and_motion_are_finite_for_any_ship_in_any_sea(
    length, slender, flat, fullness, froude, period, steepness
):
    speed = min(froude * (GRAVITY * length) ** 0.5, 40.0) or None
    beam = length / slender
    ship = Particulars(
        length=length,
        beam=beam,
        draught=beam / flat,
        block_coefficient=fullness,
        speed=speed,
    )
    sea = Waves(min(steepness * GRAVITY * period**2 / (2.0 * np.pi), 20.0), period)
    drift, motion = wave_drift(sea, ship), wave_motion(sea, ship)
    for curve in (
        drift.X,
        drift.Y,
        drift.N,
        *motion,
    ):
        assert np.isfinite(curve).all()
    for variance in motion:
        assert variance.min() >= -1e-9 * variance.max()
