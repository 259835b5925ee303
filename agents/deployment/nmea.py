"""NMEA 0183 on a bridge: sentences to numbers in SI units and back, over TCP, UDP or a serial line."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

from shipgym import InputError, extras
from shipgym.trials.nmea import checksum, parse_sentence, steering_numbers

LONGEST_LINE = 512  # bytes; 82 are the standard's
BAUD = 4800  # of the standard
EXPECTED = "expected tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE or serial:DEVICE@BAUD"


class Reading(NamedTuple):
    """One number that an instrument sent."""

    quantity: str
    value: float  # SI units and radians
    talker: str  # who sent it: HE, GP, ...


@cache
def library(name: str) -> ModuleType:
    """pyserial; InputError where it is not installed."""
    found: ModuleType = extras.library(name, "nmea")
    return found


def readings(line: str) -> list[Reading] | None:
    """What a sentence tells; None for one that is damaged, nothing for one of another kind or not valid.

    A sentence without a checksum counts as damaged, as one with a wrong one.
    """
    try:
        sentence = parse_sentence(line)
        numbers = steering_numbers(sentence)
    except (ValueError, IndexError, KeyError):
        return None
    return [
        Reading(quantity, value, sentence.talker) for quantity, value in numbers.items()
    ]


def sentences(text: str) -> str:
    """Lines such as HEHDT,90,T as sentences, with their checksums."""
    return "".join(f"${line}*{checksum(line)}\r\n" for line in text.splitlines())


class Line(asyncio.Protocol, asyncio.DatagramProtocol):
    """One end of a connection: `received` is told each line; it stands among `ends` while it is open."""

    def __init__(self, received: Callable[[str], None], ends: set[Line]) -> None:
        self.received, self.ends, self.rest = received, ends, b""
        self.transport: Any = None
        self.peer: Any = None  # who was heard last, over UDP

    def connection_made(self, transport: Any) -> None:
        """A stream, or a socket of datagrams, is open."""
        self.transport = self.transport or transport
        self.ends.add(self)

    def connection_lost(self, error: Exception | None) -> None:
        """It is closed."""
        self.ends.discard(self)

    def data_received(self, data: bytes) -> None:
        """Bytes of a stream, in any portions."""
        *lines, self.rest = (self.rest + data).split(b"\n")
        self.rest = self.rest if len(self.rest) <= LONGEST_LINE else b""
        for line in filter(bytes.strip, lines):
            self.received(line[:LONGEST_LINE].decode("ascii", "replace").strip())

    def datagram_received(self, data: bytes, address: Any) -> None:
        """One datagram, of whole lines."""
        self.peer = address
        self.data_received(data + b"\n")

    def send(self, data: bytes) -> None:
        """Send bytes; a datagram to whoever was heard last, or to where the socket is connected."""
        if not hasattr(self.transport, "sendto"):
            self.transport.write(data)
        elif self.peer or self.transport.get_extra_info("peername"):
            self.transport.sendto(data, self.peer)


class Link:
    """A connection by its address: tcp:HOST:PORT, udp:HOST:PORT, serial:DEVICE or serial:DEVICE@BAUD."""

    def __init__(self, received: Callable[[str], None]) -> None:
        self.ends: set[Line] = set()  # what is connected
        self.others: list[Any] = []  # a server, what reads a serial line
        self.line: Callable[[], Line] = lambda: Line(received, self.ends)

    async def open(self, address: str, serve: bool = False) -> None:
        """Connect, or, as instruments do, wait to be connected to over TCP, and send first over UDP.

        Raises InputError for an address of another form, or one that cannot be opened.
        """
        kind, _, rest = address.partition(":")
        (host, _, port), loop = rest.rpartition(":"), asyncio.get_running_loop()
        try:
            if kind == "serial" and rest:
                await self._open_serial(*rest.partition("@")[::2])
            elif kind == "udp":
                where = "remote_addr" if serve else "local_addr"
                await loop.create_datagram_endpoint(
                    self.line, **{where: (host, int(port))}
                )  # type: ignore[arg-type]
            elif kind == "tcp" and serve:
                self.others.append(await loop.create_server(self.line, host, int(port)))
            elif kind == "tcp":
                await loop.create_connection(self.line, host, int(port))
            else:
                raise ValueError
        except (ValueError, OverflowError):
            raise InputError(f"address: '{address[:80]}' found, {EXPECTED}") from None
        except OSError as error:
            raise InputError(
                f"{address}: cannot be opened ({error.strerror or error})"
            ) from error

    async def _open_serial(self, device: str, baud: str) -> None:
        serial, line = library("serial"), self.line()
        port = serial.Serial(
            device, int(baud or BAUD), timeout=0, write_timeout=0, exclusive=True
        )
        line.transport = port  # written to at once, read when there is something
        self.others.append(
            (await asyncio.get_running_loop().connect_read_pipe(lambda: line, port))[0]
        )

    def send(self, text: str) -> None:
        """Send sentences to all that are connected."""
        for end in list(self.ends):
            with suppress(OSError):
                end.send(text.encode("ascii"))

    def close(self) -> None:
        """Close whatever is open."""
        for one in (*self.others, *(end.transport for end in self.ends)):
            one.close()
