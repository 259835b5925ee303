"""Stopping straight ahead."""

import numpy as np
import pytest

from shipgym import ManoeuvreError, Trial, load_model
from shipgym.manoeuvres import stopping, stopping_indices

FULL_ASTERN = -80.0 / 60.0  # 1/s


def test_the_tanker_stops_full_astern_in_9_lengths():
    """Within the 15 lengths of MSC.137(76) 5.3.4.

    It swings 33 deg to starboard meanwhile.
    """
    trial = stopping(load_model("tanker"), FULL_ASTERN, speed_ratio=0.0)
    indices = stopping_indices(trial)
    assert trial["u"][-2] > 0.0 >= trial["u"][-1]
    assert indices.track_reach_lengths == pytest.approx(8.95, abs=0.01)
    assert indices.head_reach_lengths == pytest.approx(8.93, abs=0.01)
    assert indices.heading_change_deg == pytest.approx(32.6, abs=0.5)
    assert indices.time_s == pytest.approx(619.0, abs=2.0)


def test_a_container_ship_without_thrust_halves_its_speed_in_13_lengths():
    """udot = X_uu u^2 / L / (m + mx), so each halving takes ln 2 (m + mx) / -X_uu ship
    lengths.
    """
    model = load_model("container")
    numbers = model.coefficients
    quarter, eighth = (
        stopping_indices(stopping(model, speed_ratio=ratio)).track_reach_lengths
        for ratio in (0.25, 0.125)
    )
    halving = np.log(2.0) * (numbers["m"] + numbers["mx"]) / -numbers["X_uu"]
    assert eighth - quarter == pytest.approx(halving, abs=1 / 40)  # a step


def test_stopping_distance_of_a_stop_drawn_by_hand():
    """From 10 m/s at 0.1 m/s2 to the east.

    500 m to standstill.
    """
    t = np.arange(101.0)
    ahead = 10.0 * t - 0.05 * t**2
    still = np.zeros(101)
    channels = {
        "x": still,
        "y": ahead,
        "psi": still + np.pi / 2,
        "u": 10.0 - 0.1 * t,
        "v": still,
    }
    trial = Trial(t, channels, length=50.0)
    assert stopping_indices(trial).track_reach_lengths == pytest.approx(10.0)
    assert stopping_indices(trial).head_reach_lengths == pytest.approx(10.0)
    assert stopping_indices(trial).side_reach_lengths == pytest.approx(0.0, abs=1e-12)
    assert stopping_indices(trial).time_s == pytest.approx(100.0)


def test_a_ship_that_does_not_stop_says_so_with_its_trial():
    tanker = load_model("tanker")
    with pytest.raises(
        ManoeuvreError, match=r"expected a surge speed of 0\.0823 m/s"
    ) as error:
        stopping(tanker, speed_ratio=0.01)
    assert 0.0823 < error.value.trial["u"][-1] < 0.5
