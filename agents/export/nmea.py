"""NMEA 0183 on a bridge: sentences and their numbers over TCP, UDP or a serial line."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from errno import EADDRINUSE
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

from shipgym import InputError, extras
from shipgym.trials.nmea import checksum, parse_sentence, steering_numbers


class NmeaSource(NamedTuple):
    """An instrument: who sends, in what sentence, and from where."""

    talker: str  # HE, GP, ...
    kind: str = ""  # of sentence: HDT, RMC, ...
    address: str = ""  # HOST:PORT or a serial port

    @property
    def host(self) -> tuple[str, str, str]:
        """The instrument, from whatever port of its host."""
        host, _, _ = self.address.rpartition(":")
        return self.talker, self.kind, host

    @property
    def is_magnetic(self) -> bool:
        """True for a compass whose headings are magnetic."""
        return self.kind in ("HDG", "HDM")

    def __str__(self) -> str:
        place = f" from {self.address}" if self.address else ""
        return f"{self.talker}{self.kind}{place}"


class NmeaReading(NamedTuple):
    """One number that an instrument sent."""

    quantity: str  # a key of `NMEA_QUANTITIES`
    value: float  # SI units and radians
    talker: str
    kind: str = ""
    address: str = ""

    @property
    def source(self) -> NmeaSource:
        """The instrument."""
        return NmeaSource(self.talker, self.kind, self.address)


#: Called with a line and the address from which it came.
Received = Callable[[str, str], None]


@cache
def library(name: str) -> ModuleType:
    """Import pyserial; InputError if it is not installed."""
    module: ModuleType = extras.library(name, "nmea")
    return module


def readings(line: str, address: str = "") -> list[NmeaReading] | None:
    """Numbers of a sentence that came from an address; None if it is damaged.

    A sentence of another kind, or that is marked as invalid, has no numbers. One
    without a checksum counts as damaged, as one with a wrong one. The rudder is the
    starboard or single one, or the port one if that alone is valid.
    """
    try:
        sentence = parse_sentence(line)
        numbers = steering_numbers(sentence)
    except (ValueError, IndexError, KeyError):
        return None
    port_rudder = numbers.pop("port_rudder", None)
    if port_rudder is not None:
        numbers.setdefault("rudder", port_rudder)

    found = []
    sender = (sentence.talker, sentence.kind, address)
    for quantity, value in numbers.items():
        reading = NmeaReading(quantity, value, *sender)
        found.append(reading)
    return found


def gives_up_steering(line: str) -> bool:
    """True for a command (HTC) to steer by hand, or one that overrides autopilots."""
    try:
        sentence = parse_sentence(line)
    except ValueError:
        return False
    if sentence.kind != "HTC":
        return False
    override, _, _, mode, *_ = [*sentence.fields, "", "", "", ""]
    return override == "A" or mode in ("M", "R")


def sentences(text: str) -> str:
    """Lines such as HEHDT,90,T as sentences, with their checksums."""
    lines = [f"${line}*{checksum(line)}\r\n" for line in text.splitlines()]
    return "".join(lines)


class Line(asyncio.Protocol, asyncio.DatagramProtocol):
    """One end of a connection; it is a member of `ends` while it is open.

    `received` is called with each line and the address from which it came.

    Attributes
    ----------
    error : str
        Why it was closed, or what came of the last datagram that was sent.
    """

    longest = 512  # bytes of a line; the standard allows 82
    most_waiting = 4096  # bytes that the other end may leave in a stream

    def __init__(self, received: Received, ends: set[Line], source: str = "") -> None:
        self.received = received
        self.ends = ends
        self.source = source  # of what is received
        self.rest = b""  # of a line that has not ended
        self.transport: Any = None
        self.reader: Any = None  # of a serial line
        self.error = ""

    def connection_made(self, transport: Any) -> None:
        """Register an open stream or socket of datagrams."""
        self.transport = self.transport or transport
        self.source = self.source or _place(transport.get_extra_info("peername"))
        self.ends.add(self)

    def connection_lost(self, error: Exception | None) -> None:
        """Forget a closed connection."""
        nobody = "the other end closed it" if self.reader is None else "it has vanished"
        self.error = reason_of(error) if error else nobody
        self.ends.discard(self)

    def error_received(self, error: Exception) -> None:
        """Note that nobody takes datagrams at the other end."""
        self.error = reason_of(error)

    def data_received(self, data: bytes) -> None:
        """Take bytes of a stream, in any portions."""
        received = self.rest + data
        *lines, self.rest = received.split(b"\n")
        if len(self.rest) > self.longest:
            self.rest = b""
        for line in lines:
            if line.strip():
                text = line[: self.longest].decode("ascii", "replace")
                self.received(text.strip(), self.source)

    def datagram_received(self, data: bytes, address: Any) -> None:
        """Take one datagram, of whole lines."""
        self.source = _place(address)
        self.data_received(data + b"\n")

    def send(self, data: bytes) -> None:
        """Send bytes; over UDP only to the address to which the socket is connected.

        A stream whose other end reads nothing is closed: orders do not wait in it.
        """
        transport = self.transport
        if hasattr(transport, "sendto"):
            if transport.get_extra_info("peername"):
                self.error = ""
                transport.sendto(data)
            return
        transport.write(data)
        if getattr(transport, "get_write_buffer_size", int)() > self.most_waiting:
            transport.abort()

    def close(self) -> None:
        """Close it."""
        if self.reader is not None:
            self.reader.close()
        with suppress(OSError):
            self.transport.close()


def reason_of(error: Exception) -> str:
    """What the system says of a failure."""
    text = str(getattr(error, "strerror", None) or error)
    if text.startswith("could not open port"):  # which pyserial says before it
        _, _, text = text.rpartition("] ")
        text, _, _ = text.partition(":")
    return text


def _place(address: Any) -> str:
    """HOST:PORT of a socket's address; empty without one."""
    return f"{address[0]}:{address[1]}" if isinstance(address, tuple) else ""


class Link:
    """A connection by its address.

    Addresses are tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE and serial:DEVICE@BAUD.
    """

    def __init__(self, received: Received) -> None:
        self.received = received
        self.ends: set[Line] = set()  # what is connected
        self.others: list[Any] = []  # a server
        self.last: Line | None = None  # the end that was made last

    def line(self, source: str = "") -> Line:
        """A new end of the connection."""
        self.last = Line(self.received, self.ends, source)
        return self.last

    @property
    def error(self) -> str:
        """Why the last end was closed, or nobody took the last datagram; or empty."""
        return self.last.error if self.last else ""

    async def open(
        self, address: str, *, serve: bool = False, sends: bool = False
    ) -> None:
        """Open a connection.

        Over TCP connect, or with `serve` wait for others to connect. Over UDP listen
        at the address, or with `sends` send to it. Raises InputError for an address of
        another form, or one that cannot be opened.
        """
        kind, _, rest = address.partition(":")
        try:
            if kind == "serial" and rest:
                await self._open_serial(rest)
                return
            host, _, port = rest.rpartition(":")
            place = (host, int(port))
            if kind == "tcp":
                await self._open_tcp(place, serve)
            elif kind == "udp":
                await self._open_udp(place, sends)
            else:
                raise ValueError(kind)
        except InputError:
            raise
        except (ValueError, OverflowError):
            raise InputError(
                "address: expected tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE or"
                f" serial:DEVICE@BAUD, got '{address[:80]}'"
            ) from None
        except OSError as error:
            reason = reason_of(error)
            if error.errno == EADDRINUSE:
                reason = "another program uses this port; end it or take another port"
            raise InputError(f"{address}: cannot be opened ({reason})") from error

    async def _open_tcp(self, place: tuple[str, int], serve: bool) -> None:
        loop = asyncio.get_running_loop()
        if serve:
            server = await loop.create_server(self.line, *place)
            self.others.append(server)
        else:
            await loop.create_connection(self.line, *place)

    async def _open_udp(self, place: tuple[str, int], sends: bool) -> None:
        loop = asyncio.get_running_loop()
        if sends:
            await loop.create_datagram_endpoint(self.line, remote_addr=place)
        else:
            await loop.create_datagram_endpoint(self.line, local_addr=place)

    async def _open_serial(self, rest: str) -> None:
        """Open a serial line, which is read when there is something."""
        device, _, baud = rest.partition("@")
        standard_baud = 4800
        port = library("serial").Serial(
            device,
            int(baud or standard_baud),
            timeout=0,
            write_timeout=0,
            exclusive=True,
        )
        line = self.line(device)
        line.transport = port
        loop = asyncio.get_running_loop()
        line.reader, _ = await loop.connect_read_pipe(lambda: line, port)

    def address(self, name: str) -> str:
        """HOST:PORT of the last end's `sockname` or `peername`; empty without one."""
        if self.last is None or self.last.transport is None:
            return ""
        return _place(self.last.transport.get_extra_info(name))

    def send(self, text: str) -> None:
        """Send sentences to all that are connected; an end that fails is closed."""
        for end in list(self.ends):
            try:
                end.send(text.encode("ascii", "replace"))
            except OSError as error:
                end.connection_lost(error)
                end.close()

    def close(self) -> None:
        """Close whatever is open."""
        for opened in (*self.others, *self.ends):
            opened.close()
