"""Heading and track control by the topics of ISO 11674 and IEC 62065, in simulation."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, PID, PreviewLQ
from agents.export.steering import Limits
from agents.verification.standards import (
    REQUIREMENTS,
    Requirement,
    heading_control,
    heading_control_in_waves,
    heading_values,
    rate_of_turn,
    standards,
    track_control,
    track_values,
)
from agents.verification.steered import SteeredRun, settled, steer_to_heading
from agents.verification.tracks import keep_track, track_task
from tests.agents.policies import MARINER


@pytest.fixture(scope="module")
def track():
    return keep_track(
        PreviewLQ.from_model(MARINER, task=track_task(MARINER)), [MARINER, MARINER]
    )


def test_the_mariner_under_lq_and_lq_with_preview_meets_every_row(track):
    rows = {
        row.name: row for row in standards(MARINER, LQ.from_model(MARINER), [track])
    }
    assert set(rows) == set(REQUIREMENTS)
    assert [name for name, row in rows.items() if not row.passed] == []
    assert 55.0 <= rows["early_indication"].value <= 62.0
    assert 3.0 <= rows["heading_lost"].value <= 5.0  # silent for 3 s
    assert rows["rudder_limit"].value == pytest.approx(10.0)


def test_an_autopilot_that_is_too_weak_and_a_late_turn_fail_their_rows(track):
    weak = PID.from_model(MARINER)
    weak = replace(
        weak, gains={**weak.gains, "derivative": 0.1 * weak.gains["derivative"]}
    )
    assert (
        heading_control(MARINER, weak)["overshoot"] > REQUIREMENTS["overshoot"]["limit"]
    )
    late = replace(track.controller, gains={**track.controller.gains, "reach": 1.0})
    found = track_control(MARINER, keep_track(late, [MARINER, MARINER]))
    assert found["cross_track"] > REQUIREMENTS["cross_track"]["limit"]


def test_what_was_not_simulated_is_neither_passed_nor_failed():
    rows = [
        Requirement("it", "", "", 1.0, "deg", least, value)
        for least in (False, True)
        for value in (None, 2.0)
    ]
    assert [row.passed for row in rows] == [None, False, None, True]


def test_a_heading_that_falls_silent_is_handed_over_and_the_rest_is_steered():
    found = steer_to_heading(
        MARINER, PID.from_model(MARINER), lost=["heading"], limits=Limits(silence_s=5.0)
    )
    assert found.alarm == "no heading for 5 s"
    assert 65.0 <= found.alarm_at <= 67.0
    assert np.abs(found.error).max() < 1.0


def test_a_course_is_kept_for_forty_ship_lengths_of_which_the_first_ten_do_not_count():
    found = steer_to_heading(MARINER, PID.from_model(MARINER))
    assert (found.alarm, found.alarm_at) == ("", np.inf)
    assert found.t[-1] == pytest.approx(40.0 * MARINER.travel_time, abs=1.0)
    assert settled(found.t)[0] == pytest.approx(10.0 * MARINER.travel_time, abs=1.0)


def test_what_no_simulation_shows_of_a_ship_has_no_value():
    """Neither waves, of which her particulars do not tell, nor a rate of turn."""
    pilot = PID.from_model(MARINER)
    small = replace(MARINER.particulars, beam=None, draught=None)
    unknown = replace(MARINER, particulars=small)
    assert heading_control_in_waves(unknown, pilot) == {}
    straight = replace(
        MARINER, coefficients=MARINER.coefficients | {"N_d": 0.0, "Y_d": 0.0}
    )
    assert rate_of_turn(straight) == {}


def made_up(errors, warnings=None, **more):
    """A run of a second an interval with these heading errors, deg."""
    n = len(errors)
    given, order = more.pop("given", [{}] * n), np.full(n, more.pop("order", 5.0))
    zeros, rest = np.zeros(n), {"alarm": "", "alarm_at": np.inf} | more
    t, warned = np.arange(float(n)), warnings or [[]] * n
    return SteeredRun(t, np.array(errors), zeros, zeros, order, given, warned, **rest)


def test_what_is_largest_without_a_warning_is_that_of_the_quiet_intervals():
    run = made_up([0.0] * 4, [[], ["off track"], ["off heading"], []])
    size = np.array([1.0, 9.0, 7.0, 3.0])
    assert run.unwarned(size, "off track") == 7.0
    assert run.unwarned(size, "off heading") == 9.0
    always = run._replace(warnings=[["off track"]] * 4)
    assert always.unwarned(size, "off track") == 0.0


@pytest.mark.parametrize(
    ("last", "overshoot", "rudder"),
    [(0.95, 0.0, 7.0), (-0.95, 0.95, 7.0), (1.05, 0.0, np.inf)],
)
def test_a_turn_counts_where_it_ends_within_a_degree_of_the_course(
    last, overshoot, rudder
):
    warned = [["off heading"], ["off heading"], [], []]
    turn = made_up([30.0, 12.0, 11.0, last], warned, order=-7.0)
    straight = made_up([9.0, 0.3, -0.4, 0.2])  # the first quarter does not count
    silent = made_up([0.0] * 4, alarm="no heading", alarm_at=63.5)
    assert heading_values(turn, turn, straight, silent) == pytest.approx(
        {
            "heading_calm": 0.4,
            "overshoot": overshoot,
            "rudder_limit": rudder,
            "off_heading": 11.0 - 10.0,
            "heading_lost": 3.5,
        }
    )


@pytest.mark.parametrize(
    ("warned", "lead"),
    [([], 1.0), ([3, 4, 5], 2.0), ([1, 2, 3], 4.0), ([0, 1, 2, 3], 0.0)],
)
def test_a_turn_is_announced_from_the_last_quiet_interval_on(warned, lead, track):
    """A turn begins where the reach is passed, in the fifth interval.

    One that was never quiet tells no lead. The route ends four intervals after the
    last, of 10 m each.
    """
    guide = track.controller
    to_go = guide.turn_reach(0.5) + 10.0 * np.array([4.0, 3.0, 2.0, 1.0, 0.0, -1.0])
    given = [{"next_turn_distance": one, "next_turn_angle": 0.5} for one in to_go]
    given += [
        {"next_turn_distance": one, "next_turn_angle": 0.0}
        for one in (60.0, 50.0, 40.0)
    ]
    warnings = [["course change ahead"] if k in warned else [] for k in range(9)]
    end = {"alarm": "the end of the route is reached", "alarm_at": 13.0}
    along = made_up([0.0] * 9, warnings, given=given, **end)
    off = [{"cross_track": one} for one in (150.0, -53.0, 9.0)]
    aside = made_up([0.0] * 3, [["off track"], [], []], given=off)
    silent = made_up([0.0] * 3, alarm="no latitude", alarm_at=63.0)

    found = track_values(guide, along, aside, silent)
    assert found["early_indication"] == lead
    assert found["off_track"] == pytest.approx(53.0 - 50.0)
    assert found["position_lost"] == 3.0
    dt = guide.design["dt"]
    assert found["route_ended"] == pytest.approx(13.0 - (8.0 + 4.0 * dt))
    along = along._replace(alarm="no heading")
    assert track_values(guide, along, aside, silent)["route_ended"] == np.inf
