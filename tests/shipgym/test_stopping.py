"""Stopping straight ahead."""

import numpy as np
import pytest

from shipgym import InputError, Trial
from shipgym.manoeuvres import crash_stop, stopping_indices


def test_the_tanker_stops_full_astern_in_9_lengths():
    """Within the 15 lengths of MSC.137(76) 5.3.4.

    It swings 33 deg to starboard meanwhile.
    """
    trial = crash_stop("tanker")
    indices = stopping_indices(trial)
    assert trial["u"][-2] > 0.0 >= trial["u"][-1]
    assert indices.track_reach_lengths == pytest.approx(8.95, abs=0.01)
    assert indices.head_reach_lengths == pytest.approx(8.93, abs=0.01)
    assert indices.heading_change_deg == pytest.approx(32.6, abs=0.5)
    assert indices.time_s == pytest.approx(619.0, abs=2.0)


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


def test_a_ship_that_cannot_be_ordered_astern_is_refused():
    with pytest.raises(InputError, match="hold for a shaft astern, got others"):
        crash_stop("container")
