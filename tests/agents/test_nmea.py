"""NMEA 0183: what sentences tell, and connections over TCP, UDP and serial lines."""

import asyncio
import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from agents.export import nmea
from agents.export.nmea import Line, Link, readings
from shipgym.errors import InputError
from tests.agents.steering import free_port, sentence


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
        (
            sentence("HCHDG", 90.0, 2.0, "W", 3.0, "E"),
            [
                ("compass_heading", np.pi / 2, "HC"),
                ("deviation", -np.pi / 90.0, "HC"),
                ("variation", np.pi / 60.0, "HC"),
            ],
        ),
        (sentence("HCHDM", 90.0, "M"), [("compass_heading", np.pi / 2, "HC")]),
        (
            sentence("IIHSC", 90.0, "T", 88.0, "M", "C"),
            [
                ("commanded", np.pi / 2, "II"),
                ("magnetic_commanded", np.radians(88.0), "II"),
            ],
        ),
        (sentence("IIHSC", 90.0, "T", "", "", "R"), []),
        (
            sentence("IIHTC", "V", "", "", "S", "N", *[""] * 4, 90.0, "", "", "M"),
            [("magnetic_commanded", np.pi / 2, "II")],
        ),
        (sentence("IIHTC", "V", "", "", "M", "N", *[""] * 4, 90.0, "", "", "T"), []),
        (sentence("IIHTC", "A", "", "", "S", "N", *[""] * 4, 90.0, "", "", "T"), []),
        (sentence("GPGLL", "5400.0", "N", "00700.0", "E"), []),
        (
            sentence("GPGLL", "0000.0", "N", "18000.0", "E", "", "A", "D"),
            [("latitude", 0.0, "GP"), ("longitude", np.pi, "GP")],
        ),
        (sentence("GPGLL", "0000.0", "N", "18000.0", "E", "", "A", "E"), []),
        (sentence("IIRSA", "", "V", 18.0, "A"), [("rudder", np.pi / 10.0, "II")]),
        (
            sentence("GPVTG", "", "T", 90.0, "M", "", "N"),
            [("magnetic_course", np.pi / 2.0, "GP")],
        ),
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


def moded(kind, mode, status="V"):
    """A sentence with a mode indicator, which is whole in all else."""
    position = ("5430.0", "N", "00815.0", "W")
    fields = {
        "RMC": ("", "A", *position, 9, 90, "010126", "2.0", "W", mode, status),
        "VTG": (90, "T", "", "M", 10, "N", 18.5, "K", mode),
        "XTE": ("A", "A", 0.1, "L", "N", mode),
        "APB": ("A", "A", 0.1, "L", "N", *"VV", 9, "M", 1, 9, "T", 9, "T", mode),
        "BWC": ("", *position, 45, "T", "", "M", 2.0, "N", 1, mode),
        "BWR": ("", *position, 45, "T", "", "M", 2.0, "N", 1, mode),
    }
    return sentence(f"GP{kind}", *fields[kind])


@pytest.mark.parametrize(
    ("kind", "quantities"),
    [
        ("RMC", ["course", "speed", "latitude", "longitude", "variation"]),
        ("VTG", ["course", "speed"]),
        ("XTE", ["cross_track"]),
        ("APB", ["cross_track", "to_steer", "magnetic_leg"]),
        ("BWC", ["waypoint_bearing", "waypoint_distance"]),
        ("BWR", ["waypoint_bearing", "waypoint_distance"]),
    ],
)
def test_only_a_mode_in_which_a_receiver_measures_is_steered_by(kind, quantities):
    for mode in ("A", "D", "R", "F", "P", ""):
        assert [one.quantity for one in readings(moded(kind, mode))] == quantities
    for mode in "NSEMX":
        assert readings(moded(kind, mode)) == []


def test_a_receiver_that_does_not_assess_integrity_is_believed_an_unsafe_one_not():
    assert all(readings(moded("RMC", "A", status)) for status in ("V", "S", "C", ""))
    assert readings(moded("RMC", "A", "U")) == []


@pytest.mark.parametrize(
    ("north", "side", "found"),
    [
        ("5459.9", "N", 54.99833),
        ("5460.0", "N", None),
        ("5499.0", "S", None),
        ("-5430.0", "N", None),
        ("9030.0", "N", ""),
        ("5430.0", "E", ""),
    ],
)
def test_a_latitude_has_minutes_below_sixty_and_its_own_letters(north, side, found):
    line = sentence("GPRMC", "", "A", north, side, "00815.0", "W", 9, 90, "010126")
    heard = readings(line)
    if found is None:
        assert heard is None
        return
    latitudes = [one.value for one in heard if one.quantity == "latitude"]
    assert latitudes == ([pytest.approx(np.radians(found))] if found else [])


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
    line = Line(lambda text, _: heard.append(text), set())
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
    """A transport that keeps what is sent; of datagrams if it has `sendto`."""

    def __init__(self, connected=None, datagrams=True, broken=False):
        self.sent, self.connected, self.broken, self.closed = (
            [],
            connected,
            broken,
            False,
        )
        if datagrams:
            self.sendto = self.sent.append

    def get_extra_info(self, name):
        return self.connected if name == "peername" else None

    def write(self, data):
        if self.broken:
            raise OSError("broken")
        self.sent.append(data)

    def close(self):
        self.closed = True


def test_datagrams_go_where_the_socket_is_connected_and_to_nobody_who_spoke():
    open_, connected = Wire(), Wire(connected=("host", 1))
    lines = [Line(lambda *_: None, set()) for _ in range(2)]
    for line, wire in zip(lines, (open_, connected), strict=True):
        line.connection_made(wire)
        line.datagram_received(b"$HEHDT,1", ("a", 2))
        line.send(b"1")
    assert (open_.sent, connected.sent) == ([], [b"1"])


def test_a_datagram_holds_whole_lines():
    heard = []
    line = Line(lambda text, _: heard.append(text), set())
    for data in (b"$A,1\r\n$B,2", b"$C,3\r\n"):
        line.datagram_received(data, ("a", 2))
    assert heard == ["$A,1", "$B,2", "$C,3"]


def test_all_connected_ends_are_sent_to_though_one_is_broken():
    link = Link(lambda *_: None)
    wires = [Wire(datagrams=False, broken=k == 0) for k in range(3)]
    lines = [link.line() for _ in wires]
    for line, wire in zip(lines, wires, strict=True):
        line.connection_made(wire)
    link.send("order")
    assert [wire.sent for wire in wires] == [[], [b"order"], [b"order"]]
    lines[2].connection_lost(None)
    assert link.ends == {lines[1]}
    link.others.append(server := Wire())
    link.close()
    assert [one.closed for one in (*wires, server)] == [True, True, False, True]
    assert lines[0].error == "broken"


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
        link = Link(lambda *_: None)
        await link.open(address)
        link.send("order")
        link.close()

    asyncio.run(talk())
    ((given, more),) = asked
    assert given == ("/dev/x", baud)
    assert (more["timeout"], more["write_timeout"], more["exclusive"]) == (0, 0, True)
    assert (port.sent, port.closed, reader.closed) == ([b"order"], True, True)


def test_datagrams_and_a_serial_line_carry_it_too():
    master, slave = os.openpty()
    port, heard = free_port(), []

    async def talk():
        ends = [Link(lambda text, _: heard.append(text)), Link(lambda *_: None)]
        await ends[0].open(f"udp:127.0.0.1:{port}")
        await ends[1].open(f"udp:127.0.0.1:{port}", sends=True)
        ends[1].send(sentence("HEHDT", 1.0, "T"))
        serial = Link(lambda text, _: heard.append(text))
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
        ("tcp:256.0.0.1:1", "tcp:256.0.0.1:1: cannot be opened"),
        ("tcp:somewhere", "expected tcp:HOST:PORT, .*got 'tcp:somewhere'"),
        ("usb:1", "expected tcp:HOST:PORT"),
        ("serial:", "expected tcp:HOST:PORT"),
        ("udp:127.0.0.1:99999999", "expected tcp:HOST:PORT"),
    ],
)
def test_an_address_that_cannot_be_opened_is_refused(address, message):
    with pytest.raises(InputError, match=message):
        asyncio.run(Link(lambda *_: None).open(address))


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    nmea.library.cache_clear()
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(InputError, match=r"pip install 'shipgym\[nmea\]'"):
        asyncio.run(Link(lambda *_: None).open("serial:/dev/null"))
    nmea.library.cache_clear()
