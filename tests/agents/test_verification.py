"""What is said of a verified autopilot, from numbers made up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from agents import WheelOver
from agents.verification.chain import build_autopilot
from agents.verification.refusal import lost_track
from agents.verification.result import track_metrics
from agents.verification.tracks import keep_track, track_task
from shipgym import InputError, load_model


def track(largest, rms, arrived):
    controller = SimpleNamespace(gains={"heading": np.float64(1.5)})
    return SimpleNamespace(
        controller=controller,
        largest=np.array(largest),
        rms=np.array(rms),
        arrived=np.array(arrived),
    )


def test_the_first_ship_of_a_track_is_the_identified_one_and_the_others_are_drawn():
    found = track_metrics(
        track(
            [40.0, *range(101)], [9.0, *range(101)], [True, *[False] * 3, *[True] * 98]
        )
    )
    assert found == {
        "gains": {"heading": 1.5},
        "cross_track_largest_m": 40.0,
        "cross_track_rmse_m": 9.0,
        "cross_track_largest_m_quantile_95": 95.0,
        "arrived": True,
        "not_arrived": 3,
    }
    alone = track_metrics(track([40.0], [9.0], [False]))
    assert (
        alone["cross_track_largest_m_quantile_95"],
        alone["arrived"],
        alone["not_arrived"],
    ) == (
        40.0,
        False,
        0,
    )


def test_a_path_autopilot_that_does_not_arrive_on_the_identified_model_is_refused():
    """One that is lost in the first turn, on a ship whose rudder hardly moves."""
    ship = load_model("mariner")
    guide = WheelOver.from_model(ship, task=track_task(ship))
    gains = guide.gains | {"turn_reach": 1.0, "path_radius": 1.0}
    stuck = replace(ship, steering=replace(ship.steering, rudder_limit_deg=0.5))
    good = keep_track(guide, [ship])
    assert lost_track(good) is None
    lost = keep_track(replace(guide, gains=gains), [stuck])
    assert not lost.arrived[0]
    assert lost_track(lost) == (
        "it does not reach the end of the track on the identified model"
    )
    drawn = replace(good, arrived=np.arange(41) < 38)
    assert lost_track(drawn).startswith(
        "it does not reach the end of the track with 3 of 40 models drawn"
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"seed": -1}, "seed: expected"),
        ({"seed": 2**32 + 1}, "seed: expected.*got 4"),
        ({"designs": ("lqq",)}, "lqq"),
    ],
)
def test_what_is_wrong_is_said_before_a_file_is_read(given, message, tmp_path):
    with pytest.raises(InputError, match=message):
        build_autopilot("no such ship.toml", tmp_path / "out", **given)
    assert list(tmp_path.iterdir()) == []
