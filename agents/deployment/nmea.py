"""NMEA 0183 on a bridge: sentences to numbers in SI units and back, over TCP, UDP or a serial line."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib import import_module
from math import copysign, degrees, isfinite, pi
from types import ModuleType
from typing import Any, NamedTuple

from shipgym.errors import InputError

KNOT, MILE, DEGREE, PER_MINUTE = 1852.0 / 3600.0, 1852.0, pi / 180.0, pi / 180.0 / 60.0
LONGEST_LINE = 512  # bytes; 82 are the standard's
BAUD = 4800  # of the standard
#: By type of sentence: for each quantity its field, the unit of it, and what other fields must say.
FIELDS: dict[str, dict[str, tuple[int, float, dict[int, str]]]] = {
    "HDT": {"heading": (0, DEGREE, {1: "T"})},
    "THS": {"heading": (0, DEGREE, {1: "A"})},
    "ROT": {"yaw_rate": (0, PER_MINUTE, {1: "A"})},
    "RSA": {"rudder": (0, DEGREE, {1: "A"})},
    "ROR": {"order": (0, DEGREE, {1: "A"}), "released": (0, DEGREE, {1: "V"})},
    "VBW": {"surge": (0, KNOT, {2: "A"}), "sway": (1, KNOT, {2: "A"})},
    "VTG": {"course": (0, DEGREE, {1: "T"}), "speed": (4, KNOT, {5: "N"})},
    "RMC": {"course": (7, DEGREE, {1: "A"}), "speed": (6, KNOT, {1: "A"})},
    "XTE": {"cross_track": (2, MILE, {0: "A", 1: "A", 4: "N"})},
    "APB": {
        "cross_track": (2, MILE, {0: "A", 1: "A", 4: "N"}), "leg": (7, DEGREE, {0: "A", 1: "A", 8: "T"}),
        "to_steer": (12, DEGREE, {0: "A", 1: "A", 13: "T"}),
    },
}  # fmt: skip
STEER_TO = 3  # field of XTE and APB that says to which side to steer
#: Largest magnitude that is believed; more is an error of the sensor.
BELIEVED = {
    "heading": 2.0 * pi, "course": 2.0 * pi, "leg": 2.0 * pi, "to_steer": 2.0 * pi, "yaw_rate": 0.5,
    "rudder": 0.5 * pi, "order": 0.5 * pi, "released": 0.5 * pi, "surge": 50.0, "sway": 20.0, "speed": 50.0, "cross_track": 1e5,
}  # fmt: skip


class Reading(NamedTuple):
    """One number that an instrument sent."""

    quantity: str
    value: float  # SI units and radians
    talker: str  # who sent it: HE, GP, ...


def library() -> ModuleType:
    """pynmea2, taught what it does not know; InputError where it is not installed."""
    try:
        found = import_module("pynmea2")
    except ImportError:
        raise InputError("pynmea2 is not installed: pip install 'shipgym[nmea]'") from None
    for name in FIELDS.keys() - found.TalkerSentence.sentence_types.keys():
        type(name, (found.TalkerSentence,), {"fields": ()})
    return found


def readings(line: str) -> list[Reading] | None:
    """What a sentence tells; None for one that is damaged, nothing for one of another kind or not valid.

    A sentence without a checksum counts as damaged, as one with a wrong one.
    """
    nmea = library()
    try:
        sentence = nmea.parse(line, check=True)
        fields, kind, talker = sentence.data, sentence.sentence_type, sentence.talker
        return list(_told(fields, FIELDS.get(kind, {}), talker))
    except nmea.SentenceTypeError:
        return []
    except AttributeError:  # a sentence of a maker's own
        return []
    except (nmea.ParseError, ValueError, IndexError):
        return None


def _told(
    fields: list[str], kinds: dict[str, tuple[int, float, dict[int, str]]], talker: str
) -> Iterator[Reading]:
    for quantity, (place, unit, needed) in kinds.items():
        if all(fields[k] == text for k, text in needed.items()) and fields[place]:
            value = float(fields[place]) * unit
            if quantity == "cross_track":
                value = copysign(value, {"L": 1.0, "R": -1.0}[fields[STEER_TO]])
            if isfinite(value) and abs(value) <= BELIEVED[quantity]:
                yield Reading(quantity, value, talker)


def sentence(talker: str, kind: str, *fields: str | float) -> str:
    """A sentence with its checksum and the end of its line; numbers with four decimals at most."""
    texts = [f"{one:.4f}".rstrip("0").rstrip(".") if isinstance(one, float) else one for one in fields]
    return str(library().TalkerSentence(talker, kind, texts).render(newline=True))


def heading_deg(angle: float) -> float:
    """A heading in rad as degrees from 0 to 360."""
    return round(degrees(angle) % 360.0, 4) % 360.0


class Line(asyncio.Protocol, asyncio.DatagramProtocol):
    """One end of a connection: lines in, sentences out, whatever it runs over.

    Parameters
    ----------
    received : callable
        Told each line.
    ends : set of Line
        All ends that are open; this one adds itself.
    """

    def __init__(self, received: Callable[[str], None], ends: set[Line]) -> None:
        self.received, self.ends, self.rest = received, ends, b""
        self.transport: Any = None

    def connection_made(self, transport: Any) -> None:
        """A stream, or a socket of datagrams, is open."""
        self.transport = transport
        self.ends.add(self)

    def send(self, data: bytes) -> None:
        """Send bytes to the other end."""
        self.transport.write(data)

    def connection_lost(self, error: Exception | None) -> None:
        """It is closed."""
        self.ends.discard(self)

    def data_received(self, data: bytes) -> None:
        """Bytes of a stream, in any portions."""
        *lines, self.rest = (self.rest + data).split(b"\n")
        self.rest = self.rest if len(self.rest) <= LONGEST_LINE else b""
        for line in filter(bytes.strip, lines):
            self.received(line[:LONGEST_LINE].decode("ascii", "replace").strip())


class Datagrams(Line):
    """The same over UDP: what is sent goes to whoever was heard last."""

    peer: Any = None

    def datagram_received(self, data: bytes, address: Any) -> None:
        """One datagram, of whole lines."""
        self.peer = address
        self.data_received(data + b"\n")

    def send(self, data: bytes) -> None:
        """Send a datagram; nobody is known before the first is received, unless the socket is connected."""
        if self.peer or self.transport.get_extra_info("peername"):
            self.transport.sendto(data, self.peer)

    def error_received(self, error: Exception) -> None:
        """Nobody listens at the other end yet."""


class Link:
    """A connection by its address: `tcp:HOST:PORT`, `udp:HOST:PORT`, `serial:DEVICE` or `serial:DEVICE@BAUD`.

    Attributes
    ----------
    ends : set of Line
        What is connected.
    """

    def __init__(self, received: Callable[[str], None]) -> None:
        self.received, self.ends = received, set[Line]()
        self.closers: list[Callable[[], Any]] = []

    async def open(self, address: str, serve: bool = False) -> None:
        """Connect, or, as instruments do, wait to be connected to over TCP, and send first over UDP.

        Raises InputError for an address of another form, or one that cannot be opened.
        """
        kind, _, rest = address.partition(":")
        try:
            if kind == "serial" and rest:
                self._open_serial(*rest.partition("@")[::2])
            elif kind in ("tcp", "udp"):
                host, _, port = rest.rpartition(":")
                await self._open_socket(kind, host or "127.0.0.1", int(port), serve)
            else:
                raise ValueError("unknown kind")
        except (ValueError, OverflowError):
            raise InputError(
                f"address: '{address[:80]}' found, expected tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE or "
                "serial:DEVICE@BAUD"
            ) from None
        except OSError as error:
            raise InputError(f"{address}: cannot be opened ({error.strerror or error})") from None

    async def _open_socket(self, kind: str, host: str, port: int, serve: bool) -> None:
        loop = asyncio.get_running_loop()
        if kind == "udp":
            where = {"remote_addr": (host, port)} if serve else {"local_addr": (host, port)}
            await loop.create_datagram_endpoint(lambda: Datagrams(self.received, self.ends), **where)  # type: ignore[arg-type]
        elif serve:
            server = await loop.create_server(lambda: Line(self.received, self.ends), host, port)
            self.closers.append(server.close)
        else:
            await loop.create_connection(lambda: Line(self.received, self.ends), host, port)

    def _open_serial(self, device: str, baud: str) -> None:
        try:
            serial = import_module("serial")
        except ImportError:
            raise InputError("pyserial is not installed: pip install 'shipgym[nmea]'") from None
        port = serial.Serial(device, int(baud or BAUD), timeout=0, write_timeout=0, exclusive=True)
        line, loop = Line(self.received, self.ends), asyncio.get_running_loop()
        line.connection_made(port)
        number = port.fileno()

        def read() -> None:
            try:
                line.data_received(port.read(LONGEST_LINE))
            except OSError as error:  # unplugged
                loop.remove_reader(number)
                line.connection_lost(error)

        loop.add_reader(number, read)
        self.closers.append(lambda: loop.remove_reader(number))

    def send(self, text: str) -> None:
        """Send sentences to all that are connected."""
        for end in list(self.ends):
            with suppress(OSError):
                end.send(text.encode("ascii"))

    def close(self) -> None:
        """Close whatever is open."""
        for close in (*self.closers, *(end.transport.close for end in self.ends)):
            close()
