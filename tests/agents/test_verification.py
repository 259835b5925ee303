"""What is said of a verified autopilot, from numbers made up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from agents import WheelOver
from agents.verification.chain import build_autopilot
from agents.verification.page import headline, is_certain
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


def criterion(passed, decided=True):
    return SimpleNamespace(passed=passed, decided=decided, manoeuvre="", run="")


@pytest.mark.parametrize(
    ("criteria", "runaway", "lost", "said"),
    [
        (
            {"advance": True},
            0,
            0,
            (
                "is stable and meets all IMO criteria. LQ steers best and keeps control"
                " of all 9"
            ),
        ),
        (
            {"advance": True, "tactical_diameter": False},
            0,
            0,
            "is stable but misses the IMO criterion of tactical",
        ),
        (
            {"advance": True, "tactical_diameter": None},
            0,
            0,
            "misses no IMO criterion that these trials decide. Not",
        ),
        (
            {"advance": None},
            0,
            0,
            "Not decided by these trials: advance. LQ steers best",
        ),
        (
            {"advance": True},
            2,
            0,
            "all IMO criteria. 2 of 9 models drawn run away in a manoeuvre. LQ steers",
        ),
        (
            {"advance": True},
            0,
            4,
            "LQ steers best and loses control of 4 of 9 models drawn.",
        ),
    ],
)
def test_the_verdict_says_what_is_met_missed_and_not_decided(
    criteria, runaway, lost, said
):
    best = SimpleNamespace(
        name="LQ", episodes=SimpleNamespace(terminated=np.arange(9) < lost)
    )
    made = {
        name: criterion(passed, passed is not None) for name, passed in criteria.items()
    }
    manoeuvres = SimpleNamespace(criteria=made, unstable=np.arange(9) < runaway)
    found = SimpleNamespace(draws=9, pilots=[best], manoeuvres=manoeuvres, left_out=0)
    told = headline(found)
    assert told.startswith("The model ")
    assert said in told


@pytest.mark.parametrize(
    ("passed", "runaway", "lost", "certain"),
    [
        ((True, True), 0, 0, True),
        ((True, None), 0, 0, False),
        ((False, True), 0, 0, False),
        ((True, True), 1, 0, False),
        ((True, True), 0, 1, False),
        ((False, None), 2, 3, False),
    ],
)
def test_a_verdict_is_certain_if_all_is_met_and_no_model_drawn_is_lost(
    passed, runaway, lost, certain
):
    best = SimpleNamespace(episodes=SimpleNamespace(terminated=np.arange(9) < lost))
    criteria = dict(enumerate(map(criterion, passed)))
    manoeuvres = SimpleNamespace(criteria=criteria, unstable=np.arange(9) < runaway)
    found = SimpleNamespace(pilots=[best], manoeuvres=manoeuvres, left_out=0)
    assert is_certain(found) == certain


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
