"""Heading and track control by the topics of ISO 11674 and IEC 62065, in simulation."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, PID, WheelOver
from agents.controllers.linear_loop import length_time
from agents.deployment.steering import Limits
from agents.verification import standards as module
from agents.verification.standards import REQUIREMENTS, Row, heading_control, kept, standards, track_control
from agents.verification.tracks import keep_track, track_task
from shipgym.errors import InputError
from tests.agents.policies import MARINER


@pytest.fixture(scope="module")
def track():
    return keep_track(WheelOver.from_model(MARINER, task=track_task(MARINER)), [MARINER, MARINER])


def test_the_mariner_under_lq_and_wheel_over_meets_every_row(track):
    rows = {row.name: row for row in standards(MARINER, LQ.from_model(MARINER), [track])}
    assert set(rows) == set(REQUIREMENTS)
    assert [name for name, row in rows.items() if not row.passed] == []
    assert 55.0 <= rows["early_indication"].value <= 62.0
    assert 3.0 <= rows["heading_lost"].value <= 5.0  # silent for 3 s
    assert rows["rudder_limit"].value == pytest.approx(10.0)


def test_an_autopilot_that_is_too_weak_and_a_late_turn_fail_their_rows(track):
    weak = PID.from_model(MARINER)
    weak = replace(weak, gains={**weak.gains, "derivative": 0.1 * weak.gains["derivative"]})
    assert heading_control(MARINER, weak)["overshoot"] > REQUIREMENTS["overshoot"]["limit"]
    late = replace(track.controller, gains={**track.controller.gains, "turn_reach": 1.0})
    found = track_control(MARINER, keep_track(late, [MARINER, MARINER]))
    assert found["cross_track"] > REQUIREMENTS["cross_track"]["limit"]


def test_what_was_not_simulated_is_neither_passed_nor_failed():
    rows = [Row("it", "", "", 1.0, "deg", least, value) for least in (False, True) for value in (None, 2.0)]
    assert [row.passed for row in rows] == [None, False, None, True]


def test_a_heading_that_falls_silent_is_handed_over_and_the_rest_is_steered():
    found = kept(MARINER, PID.from_model(MARINER), lost=["heading"], limits=Limits(silence_s=5.0))
    assert found.alarm == "no heading for 5 s"
    assert 65.0 <= found.alarm_at <= 67.0
    assert np.abs(found.error).max() < 1.0


def test_a_course_is_kept_for_forty_ship_lengths_of_which_the_first_ten_do_not_count():
    found = kept(MARINER, PID.from_model(MARINER))
    assert (found.alarm, found.alarm_at) == ("", np.inf)
    assert found.t[-1] == pytest.approx(40.0 * length_time(MARINER), abs=1.0)
    assert module._settled(found.t)[0] == pytest.approx(10.0 * length_time(MARINER), abs=1.0)


def test_what_no_simulation_shows_of_a_ship_has_no_value(monkeypatch):
    """Neither waves, of which her particulars do not tell, nor a rate of turn."""

    def unknown(*_, **__):
        raise InputError("not known")

    monkeypatch.setattr(module, "kept", unknown)
    monkeypatch.setattr(module.TurnRate, "from_model", unknown)
    assert module._sea(MARINER, PID.from_model(MARINER)) == {}
    assert module._rate_of_turn(MARINER) == {}


def test_what_is_largest_without_a_warning_is_that_of_the_quiet_intervals():
    run = module.Run(*[np.zeros(4)] * 5, [], [[], ["off track"], ["off heading"], []], "", np.inf)
    size = np.array([1.0, 9.0, 7.0, 3.0])
    assert module._unwarned(run, size, "off track") == 7.0
    assert module._unwarned(run, size, "off heading") == 9.0
    always = run._replace(warnings=[["off track"]] * 4)
    assert module._unwarned(always, size, "off track") == 0.0
