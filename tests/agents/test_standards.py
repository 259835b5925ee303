"""Heading and track control by the topics of ISO 11674 and IEC 62065, in simulation."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, PID, WheelOver
from agents.deployment.steering import Limits
from agents.verification.standards import REQUIREMENTS, Row, heading_control, kept, standards, track_control
from agents.verification.tracks import keep_track, track_task
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
