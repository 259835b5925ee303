"""A rudder sequence for identification."""

import numpy as np
import pytest

from shipgym import load_model
from shipgym.manoeuvres import prbs_rudder

SAMPLES = 20  # of a clock period


@pytest.fixture(scope="module")
def tanker():
    return load_model("tanker")


def test_a_binary_rudder_has_two_angles_and_no_long_memory(tanker):
    """Over 1023 clock periods: mean 1/1023, autocorrelation -1/1023 at each lag."""
    clock = 0.5 * tanker.travel_time
    trial = prbs_rudder(tanker, 5.0, seed=3, duration=1023 * clock, dt=clock / SAMPLES)
    bits = trial["delta_command"][:-1] / np.radians(5.0)
    periods = bits.reshape(1023, SAMPLES)
    bits = periods[:, 0]
    np.testing.assert_allclose(periods, np.repeat(bits[:, None], SAMPLES, axis=1))
    np.testing.assert_allclose(np.abs(bits), 1.0)
    assert bits.mean() == pytest.approx(1 / 1023)
    spectrum = np.abs(np.fft.fft(bits)) ** 2
    correlation = np.fft.ifft(spectrum).real / 1023
    np.testing.assert_allclose(correlation[1:], -1 / 1023, atol=1e-12)
