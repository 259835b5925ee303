"""What a helmsman asks of a helm, and when it does what he asks for."""

import math

import numpy as np
import pytest

from agents import LQ, PID, IntegralLineOfSight, TurnRate, WheelOver
from agents.export.helm import Helm
from agents.export.helm_commands import MANUAL, STANDBY, STEERING
from agents.export.nmea import NmeaReading
from agents.export.route import Route
from agents.export.sensors import Limits
from shipgym.errors import InputError
from shipgym.tasks.task import Task
from tests.agents.policies import MARINER
from tests.agents.steering import sentence

PID_MARINER = PID.from_model(MARINER)
ROUTE = np.array([[54.0, 7.5], [54.1, 7.5], [54.1, 7.7]])


def tell(helm, now, rudder=0.0, **more):
    """Take in what its instruments say, and watch."""
    said = {"heading": 0.4, "yaw_rate": 0.0, "rudder": rudder, **more}
    for quantity, value in said.items():
        helm.sensors.take(NmeaReading(quantity, value, "II"), now)
    helm.watch(1.0, now)


def steering(agent=PID_MARINER, heading=0.5, route=None, rate=None, **said):
    helm = Helm(agent, heading, Limits(), route, rate)
    tell(helm, 0.0, **said)
    assert helm.state == STEERING
    return helm


def test_on_stand_by_orders_are_invalid_until_the_helmsman_steers_again():
    helm = steering()
    helm.steer(0.0)
    helm.stand_by()
    for now in (1.0, 2.0, 3.0):
        tell(helm, now, heading=0.4 + 0.01 * now, rudder=0.2)
        helm.steer(now)
        assert helm.state == STANDBY
        assert "AGROR,0.0,V" in helm.sentences()
    helm.engage()
    assert helm.state == STEERING
    assert helm.heading == pytest.approx(0.43)  # she keeps the heading that she has now
    assert helm.order == 0.2  # and begins at the rudder that she has now
    helm.steer(3.0)
    assert helm.order == pytest.approx(0.2, abs=0.01)
    assert ",A,,V" in helm.sentences()


@pytest.mark.parametrize(
    ("override", "mode", "state"),
    [
        ("V", "M", STANDBY),
        ("V", "R", STANDBY),
        ("A", "H", STANDBY),
        ("V", "H", STEERING),
        ("V", "", STEERING),
    ],
)
def test_a_command_to_steer_by_hand_is_obeyed(override, mode, state):
    helm = steering()
    helm.hear(sentence("IIHTC", override, "", "", mode, "N"), "a:1", 1.0)
    tell(helm, 1.0)
    assert helm.state == state


def test_the_heading_of_the_start_is_kept_until_it_has_been_steered():
    helm = Helm(PID_MARINER, 0.5, Limits())
    helm.stand_by()
    tell(helm, 0.0)
    assert helm.state == STANDBY
    helm.engage()
    assert (helm.state, helm.heading) == (STEERING, 0.5)


def test_after_an_alarm_it_steers_when_asked_to_and_all_has_been_well():
    helm = steering()
    helm.watch(1.0, 5.0)
    alarm = "no heading and no yaw rate and no rudder for 3 s"
    assert (helm.state, helm.alarm) == (MANUAL, alarm)
    with pytest.raises(InputError, match="cannot steer: no heading"):
        helm.engage()
    tell(helm, 6.0)
    with pytest.raises(InputError, match="cannot steer: all has to be well for 10 s"):
        helm.engage()
    for now in np.arange(7.0, 17.0):
        tell(helm, now)
    helm.stand_by()
    assert (helm.state, helm.alarm) == (MANUAL, alarm)
    helm.engage()
    assert (helm.state, helm.alarm, helm.obstacle) == (STEERING, "", "")


def test_a_rudder_that_was_put_over_by_hand_raises_no_alarm_later():
    helm = steering()
    helm.stand_by()
    for now in np.arange(1.0, 5.0):
        tell(helm, now, rudder=0.15)
        assert helm.obstacle == ""
    helm.engage()
    for now in np.arange(5.0, 10.0):
        helm.steer(now)
        tell(helm, now, rudder=helm.order)
    assert helm.state == STEERING


def test_two_compasses_that_differ_keep_it_from_steering():
    helm = steering()
    helm.stand_by()
    for now in np.arange(1.0, 6.0):
        helm.sensors.take(NmeaReading("heading", 1.0, "HE"), now)
        tell(helm, now)
    with pytest.raises(InputError, match=r"cannot steer: heading of .* disagree"):
        helm.engage()


@pytest.mark.parametrize("degrees", [-10.0, -1.0, 1.0, 10.0])
def test_the_set_point_is_changed_over_north_too(degrees):
    helm = steering(heading=0.0)
    helm.change_heading(math.radians(degrees))
    assert math.degrees(helm.heading) == pytest.approx(degrees % 360.0)


def test_a_set_point_never_comes_near_to_the_opposite_of_the_heading():
    """From there she might turn to the other side."""
    helm = steering(heading=0.4)
    for _ in range(17):
        helm.change_heading(math.radians(10.0))
    with pytest.raises(InputError, match="more than 170° from the heading"):
        helm.change_heading(math.radians(10.0))
    assert math.degrees(helm.heading - 0.4) == pytest.approx(170.0)
    helm.change_heading(math.radians(-10.0))
    with pytest.raises(InputError, match="change of heading: expected a number"):
        helm.change_heading(math.nan)


def test_no_heading_is_changed_where_none_is_steered():
    wheel_over = WheelOver.from_model(MARINER, task=Task.of("PathFollowing"))
    route = Route(ROUTE, 600.0)
    place = {"latitude": np.radians(54.01), "longitude": np.radians(7.5)}
    speeds = {"surge": 7.0, "sway": 0.0, "course": 0.0, "speed": 7.0}
    along = steering(wheel_over, None, route, **place, **speeds)
    turning = steering(TurnRate.from_model(MARINER), None, rate=0.002)
    waiting = Helm(PID_MARINER, 0.5, Limits())
    waiting.watch(1.0, 0.0)
    for helm, reason in (
        (along, "it steers a track"),
        (turning, "it steers a rate of turn"),
        (waiting, "not steering"),
    ):
        with pytest.raises(InputError, match=f"no change of heading: {reason}"):
            helm.change_heading(0.1)


def test_the_next_leg_of_a_route_is_taken_when_it_is_confirmed():
    wheel_over = WheelOver.from_model(MARINER, task=Task.of("PathFollowing"))
    place = {"latitude": np.radians(54.01), "longitude": np.radians(7.5)}
    speeds = {"surge": 7.0, "sway": 0.0, "course": 0.0, "speed": 7.0}
    helm = steering(wheel_over, None, Route(ROUTE, 600.0), **place, **speeds)
    with pytest.raises(InputError, match="ask for the next leg first"):
        helm.next_leg(confirm=True)
    helm.next_leg()
    assert str(helm.question) == "next leg 090.0°, 90° to starboard"
    assert helm.inputs(0.0)["set_point"] == pytest.approx(0.0)
    helm.next_leg(confirm=True)
    inputs = helm.inputs(0.0)
    assert inputs["set_point"] == pytest.approx(np.pi / 2, abs=1e-3)
    assert inputs["cross_track"] == pytest.approx(0.09 * 111300.0, rel=0.01)
    with pytest.raises(InputError, match="no next leg: none is known"):
        helm.next_leg()


def test_a_question_is_open_for_a_quarter_of_a_minute_and_closed_by_other_keys():
    helm = steering(to_steer=1.0)
    for now in np.arange(1.0, 17.0):
        tell(helm, now, to_steer=1.0)
        if now == 1.0:
            helm.next_leg()
        assert helm.question is not None
    tell(helm, 17.0, to_steer=1.0)
    assert helm.question is None
    helm.next_leg()
    helm.change_heading(0.1)
    with pytest.raises(InputError, match="nothing to confirm"):
        helm.next_leg(confirm=True)


def test_a_heading_of_ones_own_goes_back_to_the_plotters():
    helm = steering(heading=None, to_steer=1.0)
    assert helm.inputs(0.0)["set_point"] == 1.0
    helm.change_heading(-0.2)
    assert helm.heading == pytest.approx(0.8)
    helm.next_leg()
    assert str(helm.question) == "next leg 057.3°, 11° to starboard"
    helm.next_leg(confirm=True)
    assert helm.inputs(0.0)["set_point"] == 1.0


@pytest.mark.parametrize("attended", [False, True])
def test_the_plotters_next_leg_waits_for_a_helmsman_if_there_is_one(attended):
    agent = IntegralLineOfSight.from_model(MARINER, autopilot=LQ.from_model(MARINER))
    speeds = {"surge": 7.0, "sway": 0.0}
    helm = steering(agent, None, leg=0.4, cross_track=5.0, **speeds)
    helm.plotted.attended = attended
    tell(helm, 1.0, leg=0.45, cross_track=6.0, **speeds)  # the same leg
    assert helm.inputs(1.0)["set_point"] == 0.45
    tell(helm, 2.5, leg=1.2, cross_track=300.0, **speeds)
    inputs = helm.inputs(2.5)
    if not attended:
        assert (inputs["set_point"], inputs["cross_track"]) == (1.2, 300.0)
        return
    assert (inputs["set_point"], inputs["cross_track"]) == (0.45, 0.0)
    assert helm.warnings == ["next leg waits to be confirmed"]
    assert "NEXT LEG" in helm.sentences()
    helm.next_leg()
    helm.next_leg(confirm=True)
    tell(helm, 3.0, leg=1.2, cross_track=300.0, **speeds)
    inputs = helm.inputs(3.0)
    assert (inputs["set_point"], inputs["cross_track"]) == (1.2, 300.0)
    assert helm.warnings == ["off track"]
