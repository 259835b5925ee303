"""An autopilot on NMEA 0183: what it understands, when it hands over, and a ship that it steers over TCP."""

import asyncio
import os
import selectors
import socket

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import LQ, PID, IntegralLineOfSight, load_agent
from agents.cli import app
from agents.deployment.nmea import Link, Reading, readings, sentences
from agents.deployment.simulated import SimulatedShip, simulate_ship
from agents.deployment.steering import MANUAL, STANDBY, STEERING, Helm, Limits, steer
from shipgym.errors import InputError
from tests.agents.policies import MARINER


def sentence(address, *fields):
    """One with its checksum."""
    return sentences(",".join([address, *map(str, fields)]))


PID_MARINER, LQ_MARINER = PID.from_model(MARINER), LQ.from_model(MARINER)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("$HEHDT,180.0,T*26", [("heading", np.pi, "HE")]),
        (sentence("HETHS", 90.0, "A"), [("heading", np.pi / 2, "HE")]),
        (sentence("HETHS", 90.0, "V"), []),
        (sentence("TIROT", -60.0, "A"), [("yaw_rate", -np.pi / 180.0, "TI")]),
        (sentence("IIRSA", -10.0, "A", "", "V"), [("rudder", -np.pi / 18.0, "II")]),
        (sentence("ECXTE", "A", "A", "0.5", "L", "N", "A"), [("cross_track", 926.0, "EC")]),
        (sentence("ECXTE", "A", "A", "0.5", "R", "N", "A"), [("cross_track", -926.0, "EC")]),
        (
            sentence("GPVTG", 90.0, "T", "", "M", 10.0, "N"),
            [("course", np.pi / 2, "GP"), ("speed", 5.1444, "GP")],
        ),
        (sentence("GPGLL", "5400.0", "N", "00700.0", "E"), []),
        (sentence("HEHDT", "", "T"), []),
        (sentence("HEHDT", 999.0, "T"), []),
        ("$PGRME,15.0,M*1A", []),
    ],
)  # fmt: skip
def test_sentences_are_understood_in_si_units(line, expected):
    found = readings(line)
    assert [(one.quantity, one.talker) for one in found] == [(name, talker) for name, _, talker in expected]
    assert [one.value for one in found] == pytest.approx([value for _, value, _ in expected], abs=1e-4)


@pytest.mark.parametrize(
    "line", ["$HEHDT,180.0,T*27", "$HEHDT,180.0,T", "garbage", "", "\x00\xff", "$HEHDT,x,T*79", "$HEHDT*55"]
)
def test_what_is_damaged_is_told_apart(line):
    assert readings(line) is None


def helm(agent=PID_MARINER, **limits):
    """One that steers, told everything at time 0."""
    found = Helm(agent, 0.5, Limits(**limits))
    tell(found, 0.0)
    found.watch(1.0, 0.0)
    assert found.state == STEERING
    return found


def tell(found, now, heading=0.4, rudder=0.0, talker="HE"):
    for one in (("heading", heading), ("yaw_rate", 0.0), ("rudder", rudder)):
        found.sensors.take(Reading(*one, talker), now)


def test_it_waits_for_all_that_it_reads():
    found = Helm(PID_MARINER, 0.5, Limits())
    found.hear(sentence("HEHDT", 20.0, "T"), 0.0)
    found.watch(1.0, 0.0)
    found.steer(0.0)
    assert (found.state, found.order) == (STANDBY, 0.0)
    assert "ROR,0.0,V" in found.sentences()


def test_it_steers_to_its_set_point():
    found = helm()
    found.steer(0.0)
    assert found.order == pytest.approx(PID_MARINER.gains["proportional"] * 0.1 + PID_MARINER.neutral_rudder)
    assert f"AGROR,{round(np.degrees(found.order), 4)},A" in found.sentences()


def test_it_hands_over_for_good_when_a_sensor_falls_silent():
    found = helm(silence_s=2.0)
    found.sensors.take(Reading("heading", 0.4, "HE"), 2.5)
    found.watch(1.0, 2.5)
    assert (found.state, found.alarm) == (MANUAL, "no yaw rate and no rudder for 2 s")
    tell(found, 3.0)
    found.watch(1.0, 3.0)
    assert found.state == MANUAL
    assert "V" in found.sentences().split(",")
    assert "ALR" in found.sentences()


def test_it_hands_over_when_two_compasses_disagree_for_long():
    found = helm(disagreement_deg=5.0, persistence_s=2.0)
    for now in np.arange(0.0, 5.0, 0.5):
        tell(found, now, heading=-0.05)
        found.sensors.take(Reading("heading", 2 * np.pi - 0.01, "GP"), now)  # the same but for 2.3 degrees
        found.watch(0.5, now)
    assert found.state == STEERING
    for now in np.arange(5.0, 8.0, 0.5):
        tell(found, now, heading=-0.05)
        found.sensors.take(Reading("heading", 0.1, "GP"), now)
        assert (found.state == MANUAL) == (now > 7.5)
        found.watch(0.5, now)
    assert found.alarm == "heading of HE and GP disagree"


@pytest.mark.parametrize(("rate_deg_s", "state"), [(0.0, MANUAL), (-1.0, MANUAL), (3.0, STEERING)])
def test_it_hands_over_when_the_rudder_does_not_follow(rate_deg_s, state):
    found = helm(rudder_deg=5.0, rudder_rate_deg_s=2.3)
    found.order = np.radians(20.0)
    for now in np.arange(0.0, 12.0):
        tell(found, now, rudder=np.radians(min(rate_deg_s * now, 20.0)))
        found.watch(1.0, now)
    assert found.state == state
    assert found.alarm == ("" if state == STEERING else "the rudder does not follow its order")


def test_speeds_are_those_over_ground_where_no_log_tells_them():
    found = Helm(LQ_MARINER, 0.5, Limits())
    for one in (("heading", 0.0), ("course", 0.1), ("speed", 7.0)):
        found.sensors.take(Reading(*one, "GP"), 0.0)
    numbers = found.sensors.numbers(["surge", "sway"], 0.0)
    assert numbers == pytest.approx({"surge": 7.0 * np.cos(0.1), "sway": 7.0 * np.sin(0.1)})


def test_what_no_sentence_tells_is_refused():
    with pytest.raises(InputError, match=r"roll, roll_rate.*which no sentence of NMEA 0183 tells it"):
        Helm(load_agent("container-roll-path-ppo"), None, Limits())


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


class NoisyShip(SimulatedShip):
    """Her line carries what no sentence is, and a compass whose checksums are wrong."""

    def sentences(self):
        return super().sentences() + "\x00" + "x" * 600 + "\r\n$HEHDT,270.0,T*00\r\n$HEHDT,\r\n"


class NoWaiting(selectors.DefaultSelector):
    """Time goes on when there is nothing to do, and only then: tests do not depend on the computer."""

    now = 0.0

    def select(self, timeout=None):
        events = super().select(0)
        self.now += 0.0 if events else timeout or 0.0
        return events


def no_waiting():
    """A loop of its own time."""
    loop = asyncio.SelectorEventLoop(selector := NoWaiting())
    loop.time = lambda: selector.now
    return loop


def sailed(agent, kind=SimulatedShip, seconds=120.0, drop=None, **more):
    """Helm and ship after a passage over TCP, in which the ship is sent garbage too."""
    ship, address, told = kind(MARINER, leg=0.3), f"tcp:127.0.0.1:{free_port()}", []

    async def both():
        other = asyncio.create_task(simulate_ship(ship, address, duration=seconds + 60.0, drop=drop))
        await asyncio.sleep(0.05)
        _, writer = await asyncio.open_connection("127.0.0.1", int(address.rpartition(":")[2]))
        writer.write(b"\xff\x00$AGROR,35,A,,V,B*00\r\n" + b"x" * 5000)
        await writer.drain()
        writer.close()
        found = await steer(agent, address, duration=seconds, told=told.append, **more)
        other.cancel()
        return found

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        return runner.run(both()), ship, told


def test_a_ship_is_steered_over_tcp_though_garbage_is_sent():
    found, ship, told = sailed(LQ_MARINER, NoisyShip, heading=0.3)
    assert (found.state, found.alarm, found.counts["damaged"] > 1000) == (STEERING, "", True)
    assert ship.now["psi"] == pytest.approx(0.3, abs=0.02)
    assert told[0].startswith("0.0 s: standby, waits for heading, yaw rate, sway, rudder")
    assert told[-1].endswith(" s: steering")


def test_a_ship_is_led_along_the_leg_of_the_plotter():
    found, ship, _ = sailed(IntegralLineOfSight.from_model(MARINER), seconds=300.0)
    assert (found.state, found.alarm) == (STEERING, "")
    assert ship.now["psi"] == pytest.approx(0.3, abs=0.1)


def test_a_sensor_that_is_dropped_ends_in_an_alarm_and_a_rudder_amidships():
    found, ship, told = sailed(PID_MARINER, drop={"ROT": 30.0}, heading=0.3)
    assert (found.state, found.alarm) == (MANUAL, "no yaw rate for 3 s")
    assert told[-1].endswith("manual: ALARM, no yaw rate for 3 s: take the wheel")
    assert ship.order == 0.0


def test_datagrams_and_a_serial_line_carry_it_too():
    master, slave = os.openpty()
    port, heard = free_port(), []

    async def talk():
        ends = [Link(heard.append), Link(lambda line: None)]
        await ends[0].open(f"udp:127.0.0.1:{port}")
        await ends[1].open(f"udp:127.0.0.1:{port}", serve=True)
        ends[1].send(sentence("HEHDT", 1.0, "T"))
        serial = Link(heard.append)
        await serial.open(f"serial:{os.ttyname(slave)}@38400")
        os.write(master, sentence("HEHDT", 2.0, "T").encode())
        while len(heard) < 2:
            await asyncio.sleep(0.01)
        serial.send("order\r\n")
        for one in (*ends, serial):
            one.close()

    asyncio.run(asyncio.wait_for(talk(), 20.0))
    assert {line[7:8] for line in heard} == {"1", "2"}
    assert os.read(master, 100).startswith(b"order")
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("serial:/dev/no-such-port", "serial:/dev/no-such-port: cannot be opened"),
        ("tcp:127.0.0.1:1", "tcp:127.0.0.1:1: cannot be opened"),
        ("tcp:somewhere", "expected tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE"),
        ("usb:1", "expected tcp:HOST:PORT"),
        ("udp:127.0.0.1:99999999", "expected tcp:HOST:PORT"),
    ],
)
def test_an_address_that_cannot_be_opened_is_refused_by_the_command(address, message, tmp_path):
    PID_MARINER.save(tmp_path / "pid.json")
    found = CliRunner().invoke(app, ["steer", str(tmp_path / "pid.json"), "--nmea", address])
    assert found.exit_code == 2, found.output
    assert message in " ".join(found.output.split())
