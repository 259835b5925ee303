"""The helm and who speaks to it: sources told apart, magnetic bearings, commands."""

import numpy as np
import pytest

from agents import LQ, PID, IntegralLineOfSight
from agents.export.helm import MANUAL, STANDBY, STEERING, Helm
from agents.export.nmea import NmeaReading
from agents.export.sensors import HelmSensors, Limits
from tests.agents.policies import MARINER
from tests.agents.steering import sentence

PID_MARINER = PID.from_model(MARINER)
HERE = "10.0.0.1:1"
MOVING = (
    sentence("TIROT", 0.0, "A"),
    sentence("IIRSA", 0.0, "A", "", "V"),
)
COMPASS = sentence("HEHDT", 0.0, "T")


def hear(helm, now, *lines, source=HERE):
    for line in lines:
        helm.hear(line, source, now)


def steered(others, *, agent=PID_MARINER, heading=0.0, seconds=20.0, **more):
    """A helm that hears a compass, rate and rudder at 2 Hz and what else is sent.

    `others(number)` gives lines with the address that sends them.
    """
    helm = Helm(agent, heading, Limits(), **more)
    for number in range(int(2 * seconds)):
        now = 0.5 * number
        hear(helm, now, COMPASS, *MOVING)
        for line, source in others(number):
            helm.hear(line, source, now + 0.2)
        helm.watch(0.5, now + 0.3)
        if helm.state == MANUAL:
            break
    return helm


def heading_of(kind, degrees, talker="HE"):
    return sentence(talker + kind, degrees, "T" if kind == "HDT" else "A")


@pytest.mark.parametrize(
    ("line", "source", "who"),
    [
        (heading_of("HDT", 60.0), "10.0.0.2:1", "HEHDT from 10.0.0.2:1"),
        (heading_of("HDT", 60.0), "10.0.0.1:2", "HEHDT from 10.0.0.1:2"),
        (heading_of("THS", 60.0), HERE, f"HETHS from {HERE}"),
        (heading_of("HDT", 60.0, "GP"), HERE, f"GPHDT from {HERE}"),
        (heading_of("HDT", 353.0, "GP"), HERE, f"GPHDT from {HERE}"),
    ],
)
def test_sources_are_told_apart_by_talker_sentence_and_address(line, source, who):
    helm = steered(lambda number: [(line, source)])
    assert helm.alarm == f"heading of HEHDT from {HERE} and {who} disagree"
    assert helm.now < 5.0


@pytest.mark.parametrize("every", [1, 3, 5])
def test_two_compasses_that_send_as_one_are_found(every):
    """60 degrees apart; the other one speaks as often as the first, or less."""

    def other(number):
        return [(heading_of("HDT", 60.0), HERE)] if number % every == 0 else []

    helm = steered(other)
    assert (
        helm.alarm == f"two instruments send as HEHDT from {HERE}, each its own heading"
    )
    assert helm.now < 10.0


def test_a_ship_that_yaws_fast_has_one_compass():
    """A boat in quartering seas: 12 degrees to each side in 4 s, read once a second."""
    sensors = HelmSensors(Limits())
    for number in range(600):
        now = 0.1 * number
        phase = 2.0 * np.pi * now / 4.0
        rate = np.radians(12.0) * 2.0 * np.pi / 4.0 * np.cos(phase)
        sensors.take(NmeaReading("yaw_rate", rate, "TI"), now)
        if number % 10 == 3:
            heading = np.radians(12.0) * np.sin(phase)
            sensors.take(NmeaReading("heading", heading, "HE"), now)
        assert sensors.fault(0.0, 0.1, now, {"heading"}) == ""


@pytest.mark.parametrize(
    "others",
    [
        [(sentence("SDDPT", depth, "0"), HERE) for depth in (9.0, 12.0)],
        [(sentence("IIVBW", knots, 0.0, "A", "", "", "V"), HERE) for knots in (9, 19)],
        [(sentence("GPVTG", 5, "T", "", "M", 9, "N"), HERE)],
        [(sentence("GPVTG", 190, "T", "", "M", 1, "N"), "10.0.0.2:1")],
        [("x", "10.0.0.9:9"), ("\xff$", "10.0.0.9:1")],
    ],
)
def test_what_it_does_not_read_takes_no_helm_away(others):
    helm = steered(lambda number: others)
    assert (helm.state, helm.alarm) == (STEERING, "")


def test_a_heading_that_was_heard_once_takes_no_helm_away():
    stray = [(heading_of("HDT", 60.0), "10.0.0.2:1")]
    assert steered(lambda number: stray if number == 20 else []).alarm == ""


def test_a_sender_may_use_a_new_port_for_each_datagram():
    helm = Helm(PID_MARINER, 0.0, Limits())
    for number in range(100):
        now = 0.5 * number
        line = sentence("HEHDT", number / 10.0, "T")
        hear(helm, now, line, *MOVING, source=f"10.0.0.1:{number}")
        helm.watch(0.5, now)
    assert (helm.state, helm.alarm) == (STEERING, "")
    assert np.degrees(helm.inputs(now)["heading"]) == pytest.approx(9.9)


def test_sources_kept_are_few_however_many_speak():
    sensors = HelmSensors(Limits())
    helm = Helm(PID_MARINER, 0.0, Limits())
    for number in range(2000):
        talker = chr(65 + number % 26) + chr(65 + number // 26 % 26)
        line = sentence(f"{talker}HDT", 1.0, "T")
        helm.hear(line, f"10.0.{number % 250}.1:{number}", number / 1000.0)
    assert len(helm.sensors.newest["heading"]) == sensors.most_sources
    first = next(iter(helm.sensors.newest["heading"]))
    assert str(first) == "AAHDT from 10.0.0.1:0"


def waiting(*lines, agent=PID_MARINER, heading=0.0, **more):
    helm = Helm(agent, heading, Limits(), **more)
    hear(helm, 0.0, *lines, *MOVING)
    helm.watch(1.0, 0.0)
    return helm


MAGNETIC = sentence("HCHDM", 350.0, "M")
WEST = sentence(
    "GPRMC", "", "A", *["5400.0", "N", "00700.0", "E"], *[9, 0, "", 4.0, "W"]
)


@pytest.mark.parametrize(
    ("lines", "more", "heading"),
    [
        ([WEST, MAGNETIC], {}, 346.0),
        ([WEST, MAGNETIC], {"variation": 0.1}, 350.0 + np.degrees(0.1)),
        ([sentence("HCHDG", 350.0, 2.0, "E", 3.0, "W")], {}, 349.0),
        ([WEST, sentence("HCHDG", 350.0, "", "", "", "")], {}, 346.0),
        ([WEST, MAGNETIC, sentence("HEHDT", 345.0, "T")], {}, 345.0),
    ],
)
def test_a_magnetic_heading_is_made_true_where_no_true_one_is_heard(
    lines, more, heading
):
    helm = waiting(*lines, **more)
    assert helm.state == STEERING
    assert np.degrees(helm.inputs(0.0)["heading"]) == pytest.approx(heading)


def test_who_hears_only_magnetic_bearings_says_so_and_what_to_do():
    helm = waiting(MAGNETIC)
    assert (helm.state, helm.silent) == (STANDBY, ["heading"])
    assert "only magnetic bearings heard; no variation" in helm.status
    assert "--variation DEG" in helm.status
    plotted = sentence("ECAPB", *"AA", 0, "L", "N", *"VV", 9, "M", 1, 9, "M", 9, "M")
    helm = waiting(COMPASS, plotted, heading=None)
    assert "set point; only magnetic bearings heard; no variation" in helm.status
    helm = waiting(COMPASS, plotted, heading=None, variation=np.radians(2.0))
    assert np.degrees(helm.inputs(0.0)["set_point"]) == pytest.approx(11.0)


def test_a_command_is_followed_where_no_heading_is_given_and_lasts():
    command = sentence("IIHSC", 20.0, "T", "", "", "C")
    helm = waiting(COMPASS, command, heading=None)
    hear(helm, 60.0, COMPASS, *MOVING)
    assert np.degrees(helm.inputs(60.0)["set_point"]) == pytest.approx(20.0)
    assert ",H,N," in helm.sentences()
    assert waiting(COMPASS, command, heading=0.1).inputs(0.0)["set_point"] == 0.1


def test_without_feedback_it_steers_only_on_request():
    helm = Helm(PID_MARINER, 0.1, Limits())
    hear(helm, 0.0, COMPASS, MOVING[0])
    helm.watch(1.0, 0.0)
    assert helm.status.endswith("to steer without RSA start with --no-rudder-feedback")
    for agent in (PID_MARINER, LQ.from_model(MARINER)):
        helm = Helm(agent, 0.1, Limits(), rudder_feedback=False)
        for now in range(20):
            water = sentence("VDVBW", 15.0, 0.0, "A", "", "", "V")
            hear(helm, now, COMPASS, MOVING[0], water)
            helm.watch(1.0, now)
            helm.steer(now)
        assert (helm.state, helm.order > 0.0) == (STEERING, True)


def fields(helm, kind, **more):
    """Fields of one of its sentences, counted from 1 as in the standard."""
    for line in helm.sentences(**more).splitlines():
        if line[3:6] == kind:
            return ["", *line.partition("*")[0].split(",")[1:]]
    return []


def test_heading_control_data_stand_where_the_standard_has_them():
    helm = waiting(sentence("HEHDT", 3.0, "T"), heading=0.1)
    htd = fields(helm, "HTD")
    assert len(htd) == 18
    assert htd[1] == "V"
    assert htd[4:8] == ["S", "N", "40.0", "10.0"]
    assert htd[10] == str(round(np.degrees(0.1), 1))
    assert htd[13:] == ["T", "A", "A", "A", "3.0"]
    assert fields(helm, "ROR") == ["", "0.0", "A", "", "V", "B"]
    helm.order = -helm.pilot.largest
    htd = fields(helm, "HTD")
    assert (htd[2], htd[3], htd[14]) == ("40.0", "L", "V")
    assert all(len(line) <= 80 for line in helm.sentences().splitlines())


def test_a_track_is_commanded_where_one_is_kept():
    plotted = sentence("ECAPB", *"AA", 0, "L", "N", *"VV", 9, "T", 1, 9, "T", 9, "T")
    agent = IntegralLineOfSight.from_model(MARINER)
    water = sentence("VDVBW", 15.0, 0.0, "A", "", "", "V")
    helm = waiting(COMPASS, plotted, water, agent=agent, heading=None)
    assert helm.state == STEERING
    htd = fields(helm, "HTD")
    assert (htd[4], htd[10], htd[11], htd[12]) == ("T", "", "0.108", "9.0")


def test_the_last_word_is_an_invalid_order_and_a_manual_helm():
    helm = waiting(COMPASS, heading=0.2)
    helm.steer(0.0)
    assert fields(helm, "ROR")[2] == "A"
    assert fields(helm, "ROR", last=True)[1:3] == ["0.0", "V"]
    htd = fields(helm, "HTD", last=True)
    assert (htd[4], htd[14:17]) == ("M", ["V", "V", "V"])


def test_a_helm_on_stand_by_waits_for_the_helmsman_and_steers_on():
    helm = waiting(COMPASS, heading=0.2)
    helm.stand_by()
    helm.watch(1.0, 0.1)
    assert (helm.state, helm.status) == (STANDBY, "standby, by the helmsman")
    assert fields(helm, "ROR")[2] == "V"
    helm.engage()
    helm.watch(1.0, 0.2)
    assert (helm.state, helm.heading) == (STEERING, 0.0)  # that of now


def alerts(helm, now):
    helm.watch(1.0, now)
    lines = [line.partition("*")[0] for line in helm.sentences().splitlines()]
    found = {
        kind: [one for one in lines if one[3:6] == kind] for kind in ("ALF", "ALR")
    }
    found["ALC"] = [line for line in lines if line[3:6] == "ALC"]
    return found


def test_alerts_are_given_acknowledged_repeated_and_ended():
    helm = waiting(COMPASS, heading=0.3)  # 17 degrees off
    given = alerts(helm, 0.0)
    assert given["ALF"][0].startswith("$AGALF,1,1,2,")
    assert given["ALF"][0].endswith(",B,W,V,,10002,1,1,0,OFF HEADING")
    assert given["ALR"] == ["$AGALR,,002,A,V,OFF HEADING"]
    assert given["ALC"] == ["$AGALC,01,01,00,1,,10002,1,1"]
    assert alerts(helm, 0.5) == {"ALF": [], "ALR": [], "ALC": []}
    assert len(alerts(helm, 1.0)["ALR"]) == 1

    hear(helm, 1.1, sentence("BNACN", "", "", 10002, 1, "A", "C"), source="bridge")
    given = alerts(helm, 1.2)
    assert ",B,W,A,,10002,1,2,0," in given["ALF"][0]
    assert given["ALR"] == ["$AGALR,,002,A,A,OFF HEADING"]
    hear(helm, 1.3, sentence("BNACN", "", "", 10002, 1, "Q", "C"), source="bridge")
    assert len(alerts(helm, 1.4)["ALF"]) == 1
    hear(helm, 1.5, sentence("BNACN", "", "", 10002, 1, "O", "C"), source="bridge")
    helm.watch(1.0, 1.6)
    assert "$AGARC,,,10002,1,O*" in helm.sentences()

    hear(helm, 2.0, sentence("HEHDT", 15.0, "T"), *MOVING)
    given = alerts(helm, 2.0)
    assert ",B,W,N,,10002,1,3,0," in given["ALF"][0]
    assert given["ALR"] == ["$AGALR,,002,V,V,OFF HEADING"]
    given = alerts(helm, 6.0)
    assert given["ALF"][0].endswith(",B,A,V,,10001,1,1,0,AUTOPILOT FAULT")
    assert given["ALF"][1].endswith(
        ",10001,1,1,0,NO HEADING AND NO YAW RATE AND NO RUDDER FOR"
    )
    assert given["ALR"][0].startswith("$AGALR,,001,A,V,NO HEADING")
    hear(helm, 6.1, sentence("IIACK", "001"), sentence("IIACK", "x"))
    assert ",B,A,A,,10001" in alerts(helm, 6.2)["ALF"][0]
