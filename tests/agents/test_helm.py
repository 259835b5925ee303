"""The helm: when it steers, what by, when it warns, and when it hands over for good."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from agents import LQ, PID, PreviewLQ, TurnRate, WheelOver, load_agent
from agents.export.helm import MANUAL, STANDBY, STEERING, Helm
from agents.export.nmea import NmeaReading
from agents.export.route import Route
from agents.export.sensors import HelmSensors, Limits
from shipgym.errors import InputError
from shipgym.tasks.task import Task
from tests.agents.policies import MARINER
from tests.agents.steering import sentence

PID_MARINER, LQ_MARINER = PID.from_model(MARINER), LQ.from_model(MARINER)
TURN_RATE = TurnRate.from_model(MARINER)
WHEEL_OVER = WheelOver.from_model(MARINER, task=Task.of("PathFollowing"))
PREVIEW = PreviewLQ.from_model(MARINER, task=Task.of("PathFollowing"))


def helm(agent=PID_MARINER, **limits):
    """One that steers, told everything at time 0."""
    found = Helm(agent, 0.5, Limits(**limits))
    tell(found, 0.0)
    found.watch(1.0, 0.0)
    assert found.state == STEERING
    return found


def tell(found, now, heading=0.4, rudder=0.0, talker="HE"):
    for one in (("heading", heading), ("yaw_rate", 0.0), ("rudder", rudder)):
        found.sensors.take(NmeaReading(*one, talker), now)


def test_it_waits_for_all_that_it_reads():
    found = Helm(PID_MARINER, 0.5, Limits())
    found.hear(sentence("HEHDT", 20.0, "T"), "", 0.0)
    found.watch(1.0, 0.0)
    found.steer(0.0)
    assert (found.state, found.order) == (STANDBY, 0.0)
    assert "ROR,0.0,V" in found.sentences()


def test_it_steers_to_its_set_point():
    found = helm()
    for _ in range(120):  # after the transfer
        found.steer(0.0)
    gains = PID_MARINER.gains
    error_integral = 119.0 * 0.1
    of_integral = gains["integral"] * error_integral
    of_error = gains["proportional"] * 0.1
    expected = PID_MARINER.neutral_rudder + of_error + of_integral
    assert found.order == pytest.approx(expected)
    assert f"AGROR,{round(np.degrees(found.order), 4)},A" in found.sentences()


def test_it_hands_over_for_good_when_a_sensor_falls_silent():
    found = helm(silence_s=2.0)
    found.sensors.take(NmeaReading("heading", 0.4, "HE"), 2.5)
    found.watch(1.0, 2.5)
    assert (found.state, found.alarm) == (MANUAL, "no yaw rate and no rudder for 2 s")
    tell(found, 3.0)
    found.watch(1.0, 3.0)
    assert found.state == MANUAL
    assert "V" in found.sentences().split(",")
    assert "ALR" in found.sentences()


def test_it_hands_over_when_two_compasses_disagree_for_long():
    found = helm(persistence_s=2.0)
    for now in np.arange(0.0, 5.0, 0.5):
        tell(found, now, heading=-0.05)
        found.sensors.take(
            NmeaReading("heading", 2 * np.pi - 0.01, "GP"), now
        )  # the same but for 2.3 degrees
        found.watch(0.5, now)
    assert found.state == STEERING
    for now in np.arange(5.0, 8.0, 0.5):
        tell(found, now, heading=-0.05)
        found.sensors.take(NmeaReading("heading", 0.1, "GP"), now)
        assert (found.state == MANUAL) == (now > 7.5)
        found.watch(0.5, now)
    assert found.alarm == "heading of HE and GP disagree"


@pytest.mark.parametrize(
    ("rate_deg_s", "state"), [(0.0, MANUAL), (-1.0, MANUAL), (3.0, STEERING)]
)
def test_it_hands_over_when_the_rudder_does_not_follow(rate_deg_s, state):
    found = helm(rudder_deg=5.0, rudder_rate_deg_s=2.3)
    found.order = np.radians(20.0)
    for now in np.arange(0.0, 12.0):
        tell(found, now, rudder=np.radians(min(rate_deg_s * now, 20.0)))
        found.watch(1.0, now)
    assert found.state == state
    assert found.alarm == (
        "" if state == STEERING else "the rudder does not follow its order"
    )


def test_the_rudder_ordered_is_limited_and_the_helmsman_is_warned():
    found = helm(order_deg=2.0, off_heading_deg=3.0)
    for _ in range(120):  # after the transfer
        found.steer(0.0)
    assert found.order == pytest.approx(np.radians(2.0))
    assert found.status == "steering, off heading"
    assert "AGALR,,002,A,V,OFF HEADING" in found.sentences()
    assert found.state == STEERING
    for one in (("speed", 8.0), ("waypoint_distance", 400.0)):
        found.sensors.take(NmeaReading(*one, "EC"), 0.0)
    found.watch(1.0, 0.0)
    assert found.warnings == ["off heading", "course change ahead"]


@pytest.mark.parametrize("guide", [WHEEL_OVER, PREVIEW], ids=lambda one: one.kind)
def test_a_course_change_is_announced_by_the_time_to_turn_or_waypoint(guide):
    found = Helm(
        guide,
        None,
        Limits(),
        Route(np.array([[54.0, 7.5], [54.1, 7.5], [54.1, 7.6]]), 600.0),
    )
    reach = guide.turn_reach(0.5)

    def seconds(next_m, next_angle, second_m, second_angle):
        given = {"next_turn_distance": reach + next_m, "next_turn_angle": next_angle}
        given |= {
            "second_turn_distance": reach + second_m,
            "second_turn_angle": second_angle,
        }
        return found.seconds_to_turn(given, 0.0)

    assert seconds(400.0, 0.5, 1000.0, -0.5) == math.inf  # without way
    found.sensors.take(NmeaReading("speed", 8.0, "GP"), 0.0)
    assert seconds(400.0, -0.5, 1000.0, 0.5) == pytest.approx(50.0)
    assert (
        seconds(400.0, 0.0, 1000.0, 0.5)
        == seconds(-1.0, 0.5, 1000.0, 0.5)
        == pytest.approx(125.0)
    )
    assert seconds(400.0, 0.0, 1000.0, 0.0) == math.inf
    plotted = helm()
    assert plotted.seconds_to_turn({}, 0.0) == math.inf
    for one in (("speed", 8.0), ("waypoint_distance", 488.0)):
        plotted.sensors.take(NmeaReading(*one, "EC"), 0.0)
    assert plotted.seconds_to_turn({}, 0.0) == pytest.approx(61.0)


def test_warnings_are_given_beyond_their_limits():
    found = Helm(PID_MARINER, 0.1, Limits(off_heading_deg=3.0, off_track_m=50.0))
    for heading, cross_track, told in (
        (0.151, 0.0, []),
        (0.153, 0.0, ["off heading"]),
        (0.047, 0.0, ["off heading"]),
        (2.0 * np.pi + 0.06, 49.0, []),
        (0.1, -51.0, ["off track"]),
        (0.1, 51.0, ["off track"]),
    ):
        given = {
            "heading": heading,
            "set_point": 0.1,
            "cross_track": cross_track,
            "rate_of_turn": 0.0,
        }
        assert found.warnings_of(given, 0.0) == told
    assert (
        found.warnings_of(
            given | {"heading": 1.0, "cross_track": None, "rate_of_turn": 0.01}, 0.0
        )
        == []
    )


def test_a_plotters_bearing_to_the_waypoint_is_steered_if_it_was_heard_first():
    found = Helm(PID_MARINER, None, Limits())
    tell(found, 0.0)
    for one in (("waypoint_bearing", 0.7), ("to_steer", 0.9)):
        found.sensors.take(NmeaReading(*one, "EC"), 0.0)
    assert found.inputs(0.0)["set_point"] == 0.7


@pytest.mark.parametrize(
    ("heading", "rate", "set_point"), [(None, -0.004, 0.0), (1.0, 0.002, 1.0)]
)
def test_a_rate_of_turn_is_steered_or_limits_the_way_to_a_heading(
    heading, rate, set_point
):
    found = Helm(TURN_RATE, heading, Limits(), rate=rate)
    tell(found, 0.0)
    given = found.inputs(0.0)
    assert given["set_point"] == set_point
    assert given["rate_of_turn"] == (rate if heading is None else 0.0)
    assert found.pilot.agent.gains["rate"] == (
        TURN_RATE.gains["rate"] if heading is None else rate
    )


def test_what_steers_no_route_and_no_rate_is_refused():
    route = Route(np.array([[54.0, 7.5], [54.1, 7.5]]), 600.0)
    with pytest.raises(
        InputError, match=r"route: expected 'preview-lq', .* got 'pid' with a route"
    ):
        Helm(PID_MARINER, None, Limits(), route)
    with pytest.raises(InputError, match="got 'wheel-over' without a route"):
        Helm(WHEEL_OVER, None, Limits())
    with pytest.raises(
        InputError, match="rate of turn: expected autopilot 'turn-rate', got 'lq'"
    ):
        Helm(LQ_MARINER, None, Limits(), rate=0.01)
    with pytest.raises(
        InputError, match=r"rate of turn: expected .* \(rad/s, to a heading\), got 1"
    ):
        Helm(TURN_RATE, 0.5, Limits(), rate=1.0)


def test_speeds_are_those_over_ground_where_no_log_tells_them():
    found = Helm(LQ_MARINER, 0.5, Limits())
    for one in (("heading", 0.0), ("course", 0.1), ("speed", 7.0)):
        found.sensors.take(NmeaReading(*one, "GP"), 0.0)
    numbers = found.sensors.numbers(["surge", "sway"], 0.0)
    assert numbers == pytest.approx(
        {"surge": 7.0 * np.cos(0.1), "sway": 7.0 * np.sin(0.1)}
    )


def test_what_no_sentence_tells_is_refused():
    with pytest.raises(
        InputError, match=r"what sentences of NMEA 0183 have, got .*roll, roll_rate"
    ):
        Helm(load_agent("roll-limit-ppo-s0"), None, Limits())


def test_limits_are_those_of_the_page():
    page = (Path(__file__).parents[2] / "docs" / "deployment.md").read_text(
        encoding="utf-8"
    )
    told = {"persistence_s": 2.0, "order_deg": 90.0}  # in words beside the tables
    for limit, names in re.findall(
        r"^\| .* \| (.*\d.*) \| (.*`.*) \|$", page, re.MULTILINE
    ):
        numbers = map(float, re.findall(r"\d+(?:\.\d+)?", limit))
        told |= dict(zip(re.findall(r"`(\w+)`", names), numbers, strict=False))
    limits = Limits()
    assert vars(limits) == {name: told[name] for name in vars(limits)}
    with pytest.raises(InputError, match="late_s: expected a number > 0"):
        Limits(late_s=0.0)


def test_instruments_disagree_when_it_lasts_and_while_both_speak():
    sensors = HelmSensors(Limits())

    def fault(seconds, second):
        sensors.take(NmeaReading("heading", math.radians(179.0), "HE"), seconds)
        sensors.take(NmeaReading("heading", math.radians(second), "HC"), seconds)
        return sensors.fault(0.0, 1.0, seconds)

    assert fault(0.0, -177.1) == ""  # 3.9 degrees over south
    assert fault(5.0, -175.9) == ""
    assert fault(7.0, -175.9) == ""  # not longer than two seconds
    assert fault(7.1, -175.9) == "heading of HE and HC disagree"
    assert fault(8.0, -177.0) == ""
    assert fault(9.0, -175.9) == ""  # counted anew
    sensors.take(NmeaReading("heading", math.radians(179.0), "HE"), 12.1)
    assert sensors.fault(0.0, 1.0, 12.1) == ""  # the second one is silent
    assert sensors.value("heading", 15.1) == pytest.approx(math.radians(179.0))
    assert sensors.value("heading", 15.2) is None
