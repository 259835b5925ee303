"""An autopilot on NMEA 0183: what it understands, when it hands over, and a ship that it steers over TCP."""

import asyncio
import gc
import json
import math
import os
import re
import selectors
import socket
import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from agents import LQ, PID, IntegralLineOfSight, TurnRate, WheelOver, load_agent
from agents.cli import app
from agents.deployment import nmea, scheduling, steering
from agents.deployment.nmea import Line, Link, Reading, readings, sentences
from agents.deployment.route import Route
from agents.deployment.simulated import SimulatedShip, simulate_ship
from agents.deployment.steering import (
    MANUAL,
    STANDBY,
    STEERING,
    Helm,
    Limits,
    Sensors,
    _missing,
    steer,
)
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.tasks.task import Task
from tests.agents.policies import MARINER


def test_the_time_slice_is_the_shortest_for_a_while_and_then_the_default_again(
    monkeypatch,
):
    asked = []
    monkeypatch.setattr(scheduling, "_ask", asked.append)
    monkeypatch.setattr(scheduling.platform, "system", lambda: "Linux")
    monkeypatch.setattr(
        scheduling.os, "sched_getscheduler", lambda _: os.SCHED_OTHER, raising=False
    )
    with scheduling.short_slice():
        assert asked == [scheduling.SLICE_NS]
    assert asked == [scheduling.SLICE_NS, 0]
    monkeypatch.setattr(scheduling.platform, "system", lambda: "Darwin")
    with scheduling.short_slice():
        assert len(asked) == 2


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
        (
            sentence("ECXTE", "A", "A", "0.5", "L", "N", "A"),
            [("cross_track", 926.0, "EC")],
        ),
        (
            sentence("ECXTE", "A", "A", "0.5", "R", "N", "A"),
            [("cross_track", -926.0, "EC")],
        ),
        (
            sentence("GPVTG", 90.0, "T", "", "M", 10.0, "N"),
            [("course", np.pi / 2, "GP"), ("speed", 5.1444, "GP")],
        ),
        (
            sentence(
                "GPRMC",
                "120000",
                "A",
                "5430.0",
                "N",
                "00815.0",
                "W",
                "10.0",
                "90.0",
                "010126",
            ),
            [
                ("course", np.pi / 2, "GP"),
                ("speed", 5.1444, "GP"),
                ("latitude", np.radians(54.5), "GP"),
                ("longitude", np.radians(-8.25), "GP"),
            ],
        ),
        (
            sentence(
                "ECBWC", "", "", "", "", "", "45.0", "T", "", "M", "2.0", "N", "1"
            ),
            [
                ("waypoint_bearing", np.pi / 4, "EC"),
                ("waypoint_distance", 3704.0, "EC"),
            ],
        ),
        (sentence("GPGLL", "5400.0", "N", "00700.0", "E"), []),
        (sentence("HEHDT", "", "T"), []),
        (sentence("HEHDT", 999.0, "T"), []),
        ("$PGRME,15.0,M*1A", []),
    ],
)
def test_sentences_are_understood_in_si_units(line, expected):
    found = readings(line)
    assert [(one.quantity, one.talker) for one in found] == [
        (name, talker) for name, _, talker in expected
    ]
    assert [one.value for one in found] == pytest.approx(
        [value for _, value, _ in expected], abs=1e-4
    )


@pytest.mark.parametrize(
    "line",
    [
        "$HEHDT,180.0,T*27",
        "$HEHDT,180.0,T",
        "garbage",
        "",
        "\x00\xff",
        "$HEHDT,x,T*79",
        "$HEHDT*55",
    ],
)
def test_what_is_damaged_is_told_apart(line):
    assert readings(line) is None


def test_lines_come_in_any_portions_and_an_endless_one_is_forgotten():
    heard = []
    line = Line(heard.append, set())
    for portion in (
        b"$HE",
        b"HDT",
        b",1\r\n \n$B",
        b"\n",
        b"x" * 512,
        b"\n",
        b"y" * 513,
        b"rest\n",
    ):
        line.data_received(portion)
    assert heard == ["$HEHDT,1", "$B", "x" * 512, "rest"]
    line.data_received(b"z" * 600 + b"\n")  # whole, but too long
    assert heard[4:] == ["z" * 512]


class Wire:
    """A transport that keeps what is sent, of datagrams if it may be sent to someone."""

    def __init__(self, connected=None, datagrams=True, broken=False):
        self.sent, self.connected, self.broken, self.closed = (
            [],
            connected,
            broken,
            False,
        )
        if datagrams:
            self.sendto = lambda data, peer: self.sent.append((data, peer))

    def get_extra_info(self, name):
        return self.connected if name == "peername" else None

    def write(self, data):
        if self.broken:
            raise OSError("broken")
        self.sent.append(data)

    def close(self):
        self.closed = True


def test_datagrams_go_to_whoever_was_heard_last_or_where_the_socket_is_connected():
    open_, connected = Wire(), Wire(connected=("host", 1))
    lines = [Line(lambda line: None, set()) for _ in range(2)]
    for line, wire in zip(lines, (open_, connected), strict=True):
        line.connection_made(wire)
        line.send(b"1")
    assert (open_.sent, connected.sent) == ([], [(b"1", None)])
    lines[0].datagram_received(b"$HEHDT,1", ("a", 2))
    lines[0].send(b"2")
    lines[0].datagram_received(b"$HEHDT,1", ("b", 3))
    lines[0].send(b"3")
    assert open_.sent == [(b"2", ("a", 2)), (b"3", ("b", 3))]


def test_a_datagram_holds_whole_lines():
    heard = []
    line = Line(heard.append, set())
    for data in (b"$A,1\r\n$B,2", b"$C,3\r\n"):
        line.datagram_received(data, ("a", 2))
    assert heard == ["$A,1", "$B,2", "$C,3"]


def test_all_that_are_connected_are_told_though_one_line_is_broken_and_closed_at_the_end():
    link = Link(lambda line: None)
    wires = [Wire(datagrams=False, broken=k == 0) for k in range(3)]
    lines = [link.line() for _ in wires]
    for line, wire in zip(lines, wires, strict=True):
        line.connection_made(wire)
    link.send("order")
    assert [wire.sent for wire in wires] == [[], [b"order"], [b"order"]]
    lines[2].connection_lost(None)
    assert link.ends == {lines[0], lines[1]}
    link.others.append(server := Wire())
    link.close()
    assert [one.closed for one in (*wires, server)] == [True, True, False, True]


@pytest.mark.parametrize(
    ("address", "baud"), [("serial:/dev/x", 4800), ("serial:/dev/x@38400", 38400)]
)
def test_a_serial_line_has_the_speed_of_the_standard_unless_another_is_named(
    address, baud, monkeypatch
):
    """It is written to itself; what reads it is closed with it."""
    port, reader, asked = Wire(datagrams=False), Wire(), []
    serial = SimpleNamespace(
        Serial=lambda *given, **more: asked.append((given, more)) or port
    )
    monkeypatch.setattr(nmea, "library", lambda name: serial)

    async def talk():
        async def connected(made, pipe):
            line = made()
            line.connection_made(reader)
            return reader, line

        asyncio.get_running_loop().connect_read_pipe = connected
        link = Link(lambda line: None)
        await link.open(address)
        link.send("order")
        link.close()

    asyncio.run(talk())
    ((given, more),) = asked
    assert given == ("/dev/x", baud)
    assert (more["timeout"], more["write_timeout"], more["exclusive"]) == (0, 0, True)
    assert (port.sent, port.closed, reader.closed) == ([b"order"], True, True)


def test_the_kernel_is_asked_for_the_slice_as_its_interface_has_it(monkeypatch):
    """sched_setattr(pid, attr, flags): struct sched_attr of 48 bytes, its fields by include/uapi/linux."""
    asked = []
    library = SimpleNamespace(syscall=lambda *given: asked.append(given))
    monkeypatch.setattr(scheduling.ctypes, "CDLL", lambda name: library)
    for machine, number in (("x86_64", 314), ("aarch64", 274)):
        monkeypatch.setattr(
            scheduling.platform, "machine", lambda machine=machine: machine
        )
        scheduling._ask(123_456)
        call, thread, attributes, flags = asked.pop()
        assert (call, thread, flags) == (number, 0, 0)
        assert len(attributes) == 48
        fields = struct.unpack("=IIQiIQQQ", attributes)
        nice = os.getpriority(os.PRIO_PROCESS, 0)
        assert fields == (
            48,
            0,
            0,
            nice,
            0,
            123_456,
            0,
            0,
        )  # 0: ordinary policy, no flags, priority
    monkeypatch.setattr(scheduling.platform, "machine", lambda: "riscv64")
    scheduling._ask(1)
    assert asked == []
    assert scheduling.SLICE_NS == 100_000  # the least that Linux takes


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
    assert found.order == pytest.approx(
        PID_MARINER.gains["proportional"] * 0.1 + PID_MARINER.neutral_rudder
    )
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
        found.sensors.take(
            Reading("heading", 2 * np.pi - 0.01, "GP"), now
        )  # the same but for 2.3 degrees
        found.watch(0.5, now)
    assert found.state == STEERING
    for now in np.arange(5.0, 8.0, 0.5):
        tell(found, now, heading=-0.05)
        found.sensors.take(Reading("heading", 0.1, "GP"), now)
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
    found.steer(0.0)
    assert found.order == pytest.approx(np.radians(2.0))
    assert found.status == "steering, off heading"
    assert "AGALR,,002,A,V,OFF HEADING" in found.sentences()
    assert found.state == STEERING
    for one in (("speed", 8.0), ("waypoint_distance", 400.0)):
        found.sensors.take(Reading(*one, "EC"), 0.0)
    found.watch(1.0, 0.0)
    assert found.warnings == ["off heading", "course change ahead"]


def test_a_course_change_is_ahead_by_the_time_to_where_the_turn_is_begun_or_to_the_waypoint():
    found = Helm(
        WHEEL_OVER,
        None,
        Limits(),
        Route(np.array([[54.0, 7.5], [54.1, 7.5], [54.1, 7.6]]), 600.0),
    )
    reach = WHEEL_OVER.gains["turn_reach"]

    def seconds(next_m, next_angle, second_m, second_angle):
        given = {"next_turn_distance": reach + next_m, "next_turn_angle": next_angle}
        given |= {
            "second_turn_distance": reach + second_m,
            "second_turn_angle": second_angle,
        }
        return found._seconds_to_turn(given, 0.0)

    assert seconds(400.0, 0.5, 1000.0, -0.5) == math.inf  # without way
    found.sensors.take(Reading("speed", 8.0, "GP"), 0.0)
    assert seconds(400.0, -0.5, 1000.0, 0.5) == pytest.approx(50.0)
    assert (
        seconds(400.0, 0.0, 1000.0, 0.5)
        == seconds(-1.0, 0.5, 1000.0, 0.5)
        == pytest.approx(125.0)
    )
    assert seconds(400.0, 0.0, 1000.0, 0.0) == math.inf
    plotted = helm()
    assert plotted._seconds_to_turn({}, 0.0) == math.inf
    for one in (("speed", 8.0), ("waypoint_distance", 488.0)):
        plotted.sensors.take(Reading(*one, "EC"), 0.0)
    assert plotted._seconds_to_turn({}, 0.0) == pytest.approx(61.0)


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
        assert found._warned(given, 0.0) == told
    assert (
        found._warned(
            given | {"heading": 1.0, "cross_track": None, "rate_of_turn": 0.01}, 0.0
        )
        == []
    )


def test_a_plotters_bearing_to_the_waypoint_is_steered_if_it_was_heard_first():
    found = Helm(PID_MARINER, None, Limits())
    tell(found, 0.0)
    for one in (("waypoint_bearing", 0.7), ("to_steer", 0.9)):
        found.sensors.take(Reading(*one, "EC"), 0.0)
    assert found.given(0.0)["set_point"] == 0.7


TURN_RATE = TurnRate.from_model(MARINER)


@pytest.mark.parametrize(
    ("heading", "rate", "set_point"), [(None, -0.004, 0.0), (1.0, 0.002, 1.0)]
)
def test_a_rate_of_turn_is_steered_or_limits_the_way_to_a_heading(
    heading, rate, set_point
):
    found = Helm(TURN_RATE, heading, Limits(), rate=rate)
    tell(found, 0.0)
    given = found.given(0.0)
    assert given["set_point"] == set_point
    assert given["rate_of_turn"] == (rate if heading is None else 0.0)
    assert found.pilot.agent.gains["rate"] == (
        TURN_RATE.gains["rate"] if heading is None else rate
    )


WHEEL_OVER = WheelOver.from_model(MARINER, task=Task.of("PathFollowing-v1"))
ROUTE = "latitude,longitude\n54.0,7.5\n54.02,7.5\n54.03,7.52\n"


def test_a_route_is_kept_to_over_tcp_and_ends_in_the_helmsmans_hands(tmp_path):
    (tmp_path / "route.csv").write_text(ROUTE)
    route = Route.from_csv(tmp_path / "route.csv", WHEEL_OVER.gains["path_radius"])
    found, _, told = sailed(
        WHEEL_OVER, seconds=600.0, limits=Limits(off_track_m=60.0), route=route
    )
    assert found.alarm == "the end of the route is reached"
    states = [line.partition(" s: ")[2] for line in told[1:-1]]
    assert states == ["steering", "steering, course change ahead", "steering"]
    assert 450.0 < float(told[-1].partition(" s")[0]) < 560.0


def test_turns_ahead_are_those_of_the_path_following_environment():
    route = Route(np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]]), 600.0)
    given = route.given(np.radians(0.05), np.radians(0.001))
    assert given["set_point"] == pytest.approx(0.0)
    assert given["cross_track"] == pytest.approx(111.3, abs=0.1)
    assert given["next_turn_angle"] == pytest.approx(np.pi / 2)
    assert given["next_turn_distance"] == pytest.approx(
        0.05 * 110574.0 - 600.0, abs=2.0
    )
    assert not route.ended


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("latitude,longitude\n54,7\n", "1 waypoints found, expected at least 2"),
        (
            "latitude,longitude\n54,7\n95,7\n",
            r"line 3 \(data row 2\), column 'latitude': expected",
        ),
        ("latitude,longitude\n54,7\n54,\n", "column 'longitude': expected"),
        ("lat,lon\n54,7\n", "column 'latitude' not found"),
        (
            "latitude,longitude\n54,7\n54.001,7\n54.001,7.001\n",
            "are 1.* m apart, expected at least",
        ),
        (
            "latitude,longitude\n54,7\n58,7\n",
            "445 km from the first found, expected at most 100 km",
        ),
    ],
)
def test_a_route_that_cannot_be_sailed_is_refused_with_its_place(
    text, message, tmp_path
):
    (tmp_path / "route.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        Route.from_csv(tmp_path / "route.csv", 600.0)


def test_what_steers_no_route_and_no_rate_is_refused():
    route = Route(np.array([[54.0, 7.5], [54.1, 7.5]]), 600.0)
    with pytest.raises(
        InputError, match="autopilot 'pid' with a route found, expected 'wheel-over'"
    ):
        Helm(PID_MARINER, None, Limits(), route)
    with pytest.raises(
        InputError, match="autopilot 'wheel-over' without a route found"
    ):
        Helm(WHEEL_OVER, None, Limits())
    with pytest.raises(
        InputError, match="rate of turn: autopilot 'lq' found, expected 'turn-rate'"
    ):
        Helm(LQ_MARINER, None, Limits(), rate=0.01)
    with pytest.raises(
        InputError, match=r"rate of turn: expected .* .rad/s, to a heading"
    ):
        Helm(TURN_RATE, 0.5, Limits(), rate=1.0)


def test_speeds_are_those_over_ground_where_no_log_tells_them():
    found = Helm(LQ_MARINER, 0.5, Limits())
    for one in (("heading", 0.0), ("course", 0.1), ("speed", 7.0)):
        found.sensors.take(Reading(*one, "GP"), 0.0)
    numbers = found.sensors.numbers(["surge", "sway"], 0.0)
    assert numbers == pytest.approx(
        {"surge": 7.0 * np.cos(0.1), "sway": 7.0 * np.sin(0.1)}
    )


def test_what_no_sentence_tells_is_refused():
    with pytest.raises(
        InputError, match=r"roll, roll_rate.*which no sentence of NMEA 0183 tells it"
    ):
        Helm(load_agent("container-roll-path-ppo"), None, Limits())


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


class HearingShip(SimulatedShip):
    """She keeps what she hears."""

    def hear(self, line):
        self.heard = [*getattr(self, "heard", []), line]
        super().hear(line)


class NoisyShip(SimulatedShip):
    """Her line carries what no sentence is, and a compass whose checksums are wrong."""

    def sentences(self):
        return (
            super().sentences()
            + "\x00"
            + "x" * 600
            + "\r\n$HEHDT,270.0,T*00\r\n$HEHDT,\r\n"
        )


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
        other = asyncio.create_task(
            simulate_ship(ship, address, duration=seconds + 60.0, drop=drop)
        )
        await asyncio.sleep(0.05)
        _, writer = await asyncio.open_connection(
            "127.0.0.1", int(address.rpartition(":")[2])
        )
        writer.write(b"\xff\x00$AGROR,35,A,,V,B*00\r\n" + b"x" * 5000)
        await writer.drain()
        writer.close()
        found = await steer(agent, address, duration=seconds, told=told.append, **more)
        other.cancel()
        return found

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        return runner.run(both()), ship, told


def test_instruments_show_where_the_ship_is_and_sentences_tell_it():
    """6 miles north and half a mile east of 54 N, 7.5 E, in waves and a current, at a moment of hour 27."""
    ship = SimulatedShip(MARINER, leg=0.3, weather="moderate", step=0.5)
    state = {
        "x": 6 * 1852.0,
        "y": 926.0,
        "psi": 0.5,
        "u": 7.0,
        "v": -0.4,
        "r": 0.003,
        "delta": -0.1,
    }
    ship.states[0, : len(state)] = [state[name] for name in MARINER.state_names]
    ship.states[0, -len(SEA_CHANNELS) :] = 0.02, 0.004, 0.0, 0.0, -0.3, 0.5, 0.0, 0.0
    over_ground = (7.0 - 0.4j) * np.exp(0.5j) - 0.3 + 0.5j
    left = 18520.0 * np.exp(0.3j) - (6 * 1852.0 + 926.0j)
    shown = {
        "heading": 0.52,
        "yaw_rate": 0.007,
        "rudder": -0.1,
        "surge": 7.0,
        "sway": -0.4,
        "leg": 0.3,
        "course": np.angle(over_ground),
        "speed": abs(over_ground),
        "latitude": np.radians(54.1),
        "longitude": np.radians(7.5 + 0.5 / 60.0 / np.cos(np.radians(54.1))),
        "cross_track": 926.0 * np.cos(0.3) - 6 * 1852.0 * np.sin(0.3),
        "waypoint_bearing": np.angle(left),
        "waypoint_distance": abs(left),
    }
    assert ship.measured() == pytest.approx(shown)
    ship.steps = 2 * (27 * 3600 + 15 * 60 + 5)
    lines = ship.sentences().splitlines()
    told = {one.quantity: one.value for line in lines for one in readings(line)}
    assert told == pytest.approx({**shown, "to_steer": 0.3}, rel=1e-5, abs=3e-5)
    for name in ("latitude", "longitude"):
        assert told[name] == pytest.approx(shown[name], rel=0.0, abs=2e-8)
    assert any(",031505.00," in line for line in lines)


def test_what_a_heeled_ship_makes_sideways_over_ground_is_level():
    ship = SimulatedShip(load_model("container"))
    for name, value in (("u", 0.0), ("v", 2.0), ("phi", np.pi / 3)):
        ship.states[0, ship.model.state_names.index(name)] = value
    shown = ship.measured()
    assert (shown["sway"], shown["speed"], shown["course"]) == pytest.approx(
        (2.0, 1.0, np.pi / 2)
    )


def test_a_ship_is_steered_over_tcp_though_garbage_is_sent():
    found, ship, told = sailed(LQ_MARINER, NoisyShip, heading=0.3)
    assert (found.state, found.alarm, found.counts["damaged"] > 1000) == (
        STEERING,
        "",
        True,
    )
    assert ship.now["psi"] == pytest.approx(0.3, abs=0.02)
    assert told[0].startswith(
        "0.0 s: standby, waits for heading, yaw rate, sway, rudder"
    )
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


def test_it_waits_for_a_ship_connects_again_when_she_is_lost_and_steers_no_more():
    ships, address, told = (
        [HearingShip(MARINER) for _ in range(2)],
        f"tcp:127.0.0.1:{free_port()}",
        [],
    )

    async def both():
        found = asyncio.create_task(
            steer(PID_MARINER, address, heading=0.3, duration=90.0, told=told.append)
        )
        for ship in ships:
            await asyncio.sleep(10.0)
            await simulate_ship(ship, address, duration=20.0)
        return await found

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        found = runner.run(both())
    assert (found.state, found.alarm) == (MANUAL, "the connection was closed")
    assert "cannot be opened" in told[0]
    assert ships[0].order != 0.0
    assert ships[1].order == 0.0
    assert any("ALR" in line for line in ships[1].heard)


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


def test_the_command_steers_with_what_it_is_told_and_fails_after_an_alarm(
    tmp_path, monkeypatch
):
    given, ends = [], [("off", ""), ("manual", "no heading for 3 s")]

    async def stand_in(pilot, nmea, **more):
        given.append((pilot.kind, nmea, more))
        more["told"]("0.0 s: standby")
        state, alarm = ends[len(given) - 1]
        return SimpleNamespace(state=state, alarm=alarm, counts={"damaged": 2})

    monkeypatch.setattr("agents.deployment.steering.steer", stand_in)
    PID_MARINER.save(tmp_path / "pid.json")
    WHEEL_OVER.save(tmp_path / "guide.json")
    (tmp_path / "route.csv").write_text(ROUTE)
    words = [
        "steer",
        str(tmp_path / "pid.json"),
        "--nmea",
        "udp:ship:1",
        "--heading",
        "45",
    ]
    words += [
        "--limit",
        "silence_s=4",
        "--duration",
        "12",
        "--rate-of-turn",
        "15",
        "--speed-up",
        "2",
    ]
    calm = CliRunner().invoke(app, [*words, "--json"])
    assert (calm.exit_code, json.loads(calm.stdout)) == (
        0,
        {"state": "off", "alarm": "", "damaged": 2},
    )
    kind, address, more = given[0]
    assert (kind, address, more["limits"], more["route"]) == (
        "pid",
        "udp:ship:1",
        Limits(silence_s=4),
        None,
    )
    assert (more["heading"], more["rate"]) == pytest.approx(
        (np.pi / 4.0, np.pi / 12.0 / 60.0)
    )
    assert (more["duration"], more["speed_up"]) == (12.0, 2.0)
    route = ["--route", str(tmp_path / "route.csv")]
    lost = CliRunner().invoke(
        app, ["steer", str(tmp_path / "guide.json"), "--nmea", "udp:ship:1", *route]
    )
    assert lost.exit_code == 1
    assert "0.0 s: standby" in lost.output
    assert "handed over: no heading for 3 s" in lost.output
    _, _, more = given[1]
    assert (more["heading"], more["rate"], more["duration"], more["speed_up"]) == (
        None,
        None,
        math.inf,
        1.0,
    )
    assert more["limits"] == Limits()
    turn = more["route"].given(np.radians(54.0), np.radians(7.5))
    expected = Route.from_csv(tmp_path / "route.csv", WHEEL_OVER.gains["path_radius"])
    assert turn == expected.given(np.radians(54.0), np.radians(7.5))
    wrong = CliRunner().invoke(app, [*words, "--limit", "silense_s=4"])
    assert (wrong.exit_code, "--limit: unknown key 'silense_s'" in wrong.output) == (
        2,
        True,
    )


def test_the_command_simulates_the_ship_that_is_asked_for_and_drops_sentences():
    """Ten steps of 0.1 s; from 0.45 s on no HDT is heard, in whatever case it is named."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears:
        hears.bind(("127.0.0.1", 0))
        asked = [
            "simulate",
            "mariner",
            "--nmea",
            f"udp:127.0.0.1:{hears.getsockname()[1]}",
            "--leg",
            "30",
        ]
        asked += ["--drop", "hdt=0.45", "--duration", "1", "--speed-up", "40", "--json"]
        told = json.loads(CliRunner().invoke(app, asked).stdout)
        hears.settimeout(0.0)
        heard = "".join(hears.recv(65536).decode() for _ in range(10))
    assert [heard.count(f"{kind},") for kind in ("HDT", "ROT", "RSA")] == [5, 10, 10]
    (steered,) = {
        one.value
        for line in heard.splitlines()
        for one in readings(line)
        if one.quantity == "leg"
    }
    assert steered == pytest.approx(np.radians(30.0))
    assert (told["model"], told["duration_s"]) == ("mariner", 1.0)
    assert told["state"]["x"] == pytest.approx(MARINER.particulars["speed"], rel=1e-3)


def test_by_default_a_ship_is_simulated_as_time_goes_until_she_is_stopped(monkeypatch):
    asked = []

    async def stand_in(ship, nmea, **more):
        asked.append((ship.leg, nmea, more))

    monkeypatch.setattr("agents.deployment.simulated.simulate_ship", stand_in)
    answer = CliRunner().invoke(app, ["simulate", "mariner", "--nmea", "udp:1:2"])
    assert (answer.exit_code, answer.stdout) == (0, "mariner: sailed for 0.0 s\n")
    assert asked == [
        (0.0, "udp:1:2", {"duration": math.inf, "speed_up": 1.0, "drop": {}})
    ]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--drop", "HDT"],
            "--drop: expected name=value, such as --drop HDT=60",
        ),
        (["--drop", "hdt='late'"], "--drop hdt: expected"),
        (["--drop", "hdt=-1"], "--drop hdt: expected a number >= 0"),
        (
            ["--drop", "XYZ=3"],
            "drop: unknown key 'XYZ'. Known keys: 'APB', 'BWC', 'HDT', 'RMC', 'ROT'",
        ),
        (["--leg", "360.5"], "'--leg': Input should be less than or equal to 360"),
        (["--sea", "ruff"], "weather: 'ruff' found, expected one of 'calm'"),
    ],
)
def test_what_no_ship_can_be_asked_for_is_refused(words, message):
    found = CliRunner().invoke(
        app, ["simulate", "mariner", "--nmea", "udp:127.0.0.1:9", *words]
    )
    assert found.exit_code == 2, found.output
    assert re.search(message, " ".join(found.output.split()))


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("serial:/dev/no-such-port", "serial:/dev/no-such-port: cannot be opened"),
        ("tcp:256.0.0.1:1", "tcp:256.0.0.1:1: cannot be opened"),
        ("tcp:somewhere", "expected tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE"),
        ("usb:1", "expected tcp:HOST:PORT"),
        ("udp:127.0.0.1:99999999", "expected tcp:HOST:PORT"),
    ],
)
def test_an_address_that_cannot_be_opened_is_refused_by_the_command(
    address, message, tmp_path
):
    PID_MARINER.save(tmp_path / "pid.json")
    found = CliRunner().invoke(
        app, ["steer", str(tmp_path / "pid.json"), "--nmea", address]
    )
    assert found.exit_code == 2, found.output
    assert message in " ".join(found.output.split())


@pytest.mark.parametrize("heading", ["400", "-1", "nan"])
def test_a_heading_is_one_of_the_compass(heading, tmp_path):
    PID_MARINER.save(tmp_path / "pid.json")
    words = [
        "steer",
        str(tmp_path / "pid.json"),
        "--nmea",
        "tcp:127.0.0.1:1",
        "--heading",
        heading,
    ]
    found = CliRunner().invoke(app, words)
    assert (found.exit_code, found.stdout) == (2, "")
    assert "Invalid value for '--heading': Input should be " in found.stderr


def test_where_nobody_answers_until_the_end_the_command_fails(tmp_path):
    PID_MARINER.save(tmp_path / "pid.json")
    address = f"tcp:127.0.0.1:{free_port()}"
    words = [
        "steer",
        str(tmp_path / "pid.json"),
        "--nmea",
        address,
        "--duration",
        "2",
        "--speed-up",
        "20",
    ]
    found = CliRunner().invoke(app, words)
    assert found.exit_code == 2
    assert found.stderr.startswith(
        f"error: {address}: cannot be opened (Connect call failed"
    )
    assert found.stderr.endswith(
        "; nobody was heard in 2 s: start the other end first\n"
    )
    assert found.stderr.count("\n") == 1


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
    assert vars(limits) == {name: told[name] for name in vars(limits)} | {
        "disagreement_deg": 5.0
    }
    assert limits.between("heading") == pytest.approx(math.radians(5.0))
    assert limits.between("yaw_rate") == pytest.approx(math.radians(0.5))
    assert limits.between("speed") == pytest.approx(4.0 * 1852.0 / 3600.0)
    assert limits.between("latitude") == pytest.approx(100.0 / 6.371e6)
    assert limits.between("cross_track") == math.inf
    with pytest.raises(InputError, match="late_s: expected a number > 0"):
        Limits(late_s=0.0)


def test_instruments_disagree_when_it_lasts_and_while_both_speak():
    sensors = Sensors(Limits())

    def fault(seconds, second):
        sensors.take(Reading("heading", math.radians(179.0), "HE"), seconds)
        sensors.take(Reading("heading", math.radians(second), "HC"), seconds)
        return sensors.fault(0.0, 1.0, seconds)

    assert fault(0.0, -177.1) is None  # 3.9 degrees over south
    assert fault(5.0, -175.9) is None
    assert fault(7.0, -175.9) is None  # not longer than two seconds
    assert fault(7.1, -175.9) == "heading of HE and HC disagree"
    assert fault(8.0, -177.0) is None
    assert fault(9.0, -175.9) is None  # counted anew
    sensors.take(Reading("heading", math.radians(179.0), "HE"), 12.1)
    assert sensors.fault(0.0, 1.0, 12.1) is None  # the second one is silent
    assert sensors.value("heading", 15.1) == pytest.approx(math.radians(179.0))
    assert sensors.value("heading", 15.2) is None


def test_a_simulated_ship_keeps_time_and_runs_so_many_times_as_fast():
    """A minute of hers in six seconds, a step of a tenth of a second at a time."""
    ship, steps = SimulatedShip(MARINER), []

    async def sails():
        begin = asyncio.get_running_loop().time()
        await simulate_ship(
            ship, f"udp:127.0.0.1:{free_port()}", duration=60.0, speed_up=10.0
        )
        steps.append(asyncio.get_running_loop().time() - begin)

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        runner.run(sails())
        with pytest.raises(InputError, match="speed_up: expected a number > 0"):
            runner.run(simulate_ship(ship, "udp:127.0.0.1:9", speed_up=0.0))
    assert ship.steps == 600
    assert steps[0] == pytest.approx(59.9 / 10.0)


def test_a_ship_that_runs_away_says_when():
    ship = SimulatedShip(MARINER, step=0.5)
    ship.steps, ship.states[0, 3] = 7, np.nan
    with pytest.raises(InputError, match=r"model 'mariner' ran away after 3\.5 s"):
        ship.advance()


@pytest.mark.parametrize(
    ("delay_s", "alarm"), [(1.4, ""), (1.6, "a step came 2.2 s late")]
)
def test_it_hands_over_when_a_step_comes_a_second_late_and_not_sooner(delay_s, alarm):
    """Twice as fast as time goes; half a second of the delay is that to the step. Garbage is left alone."""
    ship, address, told = SimulatedShip(MARINER), f"tcp:127.0.0.1:{free_port()}", []
    gc.unfreeze()

    async def both():
        loop = asyncio.get_running_loop()

        def tell(line):
            told.append(line)
            if line.endswith("s: steering") and len(told) == 2:
                loop._selector.now += delay_s

        other = asyncio.create_task(
            simulate_ship(ship, address, duration=90.0, speed_up=2.0)
        )
        await asyncio.sleep(0.05)
        more = {
            "heading": 0.0,
            "duration": 20.0,
            "speed_up": 2.0,
            "limits": Limits(silence_s=20.0),
        }
        found = await steer(PID_MARINER, address, told=tell, **more)
        other.cancel()
        return found, loop.time()

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        found, ended = runner.run(both())
    frozen = gc.get_freeze_count()
    gc.unfreeze()
    assert told[1].endswith("s: steering")
    assert found.alarm == alarm
    assert ended < 20.0
    assert frozen > 0


@pytest.mark.parametrize("name", ["speed_up", "heading", "rate"])
def test_what_is_no_number_is_refused_before_anything_is_opened(name):
    given = {"heading": 0.1, "rate": 0.001} | {name: math.nan}
    with pytest.raises(InputError, match=f"{name}: expected"):
        asyncio.run(steer(PID_MARINER, "usb:1", **given))


def test_who_does_not_answer_within_five_seconds_is_waited_for(monkeypatch):
    link = Link(lambda line: None)

    async def silent(address):
        await asyncio.sleep(100.0)

    async def refused(address):
        raise InputError(f"{address}: cannot be opened") from ConnectionRefusedError()

    async def waits():
        loop = asyncio.get_running_loop()
        begin, said = loop.time(), await _missing(link, "tcp:ship:1", first=True)
        return said, loop.time() - begin

    with asyncio.Runner(loop_factory=no_waiting) as runner:
        monkeypatch.setattr(link, "open", silent)
        assert runner.run(waits()) == ("; tcp:ship:1: no answer", pytest.approx(5.0))
        monkeypatch.setattr(link, "open", refused)
        assert runner.run(waits())[0] == "; tcp:ship:1: cannot be opened"
    assert steering.RETRY_S == 1.0


@pytest.mark.parametrize(("dt", "looks"), [(3.0, 30), (2.1, 42)])
def test_sensors_are_looked_at_once_a_second_at_least_and_steered_by_in_each_interval(
    dt, looks, monkeypatch
):
    """In 30 s of intervals of 3 s three times in each, and as often of 2.1 s."""
    counts = dict.fromkeys(("watch", "sentences", "steer"), 0)

    def counted(name, method):
        def call(self, *given):
            counts[name] += 1
            return method(self, *given)

        return call

    for name in counts:
        monkeypatch.setattr(Helm, name, counted(name, getattr(Helm, name)))
    found, _, _ = sailed(
        PID.from_model(MARINER, dt=dt), seconds=looks * dt / 3.0, heading=0.3
    )
    assert found.state == STEERING
    assert counts == {"watch": looks, "sentences": looks, "steer": looks // 3}


def test_what_is_not_installed_is_named_with_its_extra():
    with pytest.raises(
        InputError,
        match=r"no_such_nmea is not installed: pip install 'shipgym\[nmea\]'",
    ):
        nmea.library.__wrapped__("no_such_nmea")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(111, "refused"), r"\(refused\)"),
        (OSError("several of them"), r"\(several of them\)"),
    ],
)
def test_why_an_address_cannot_be_opened_is_said(error, said):
    async def fails(*_):
        raise error

    async def opens():
        asyncio.get_running_loop().create_connection = fails
        await Link(lambda line: None).open("tcp:ship:1")

    with pytest.raises(
        InputError, match=f"^tcp:ship:1: cannot be opened {said}$"
    ) as refused:
        asyncio.run(opens())
    assert refused.value.__cause__ is error


def test_an_address_that_is_none_is_shown_by_its_beginning():
    for address in ("serial:", "usb:" + "x" * 200, "tcp:ship"):
        with pytest.raises(InputError) as refused:
            asyncio.run(Link(lambda line: None).open(address))
        assert f"address: '{address[:80]}' found, expected tcp:HOST:PORT" in str(
            refused.value
        )
