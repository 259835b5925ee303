"""The connections of `shipgym steer`: where data come from and where orders go."""

from __future__ import annotations

import asyncio

from agents.export.nmea import Link, Received
from shipgym import InputError


class Connection:
    """A link that is opened again whenever it is closed.

    Parameters
    ----------
    link : Link
    address : str
        Where to connect, or over UDP where to listen.
    sends : bool
        Over UDP send to the address instead.
    """

    def __init__(self, link: Link, address: str, *, sends: bool = False) -> None:
        self.link = link
        self.address = address
        self.sends = sends
        self.error = ""  # of the last try to open it
        self.retry_at = 0.0  # on the event loop's clock, s
        self.opening: asyncio.Task[None] | None = None

    async def open(self, first: bool = False) -> None:
        """Try to open the link; InputError at the first try if that can never work."""
        longest_s, pause_s = 5.0, 1.0
        self.error = ""
        try:
            async with asyncio.timeout(longest_s):
                await self.link.open(self.address, sends=self.sends)
        except TimeoutError:
            self.error = f"{self.address}: no answer"
        except InputError as error:
            may_come = isinstance(error.__cause__, (ConnectionError, TimeoutError))
            if first and not may_come:
                raise
            self.error = str(error)
        self.retry_at = asyncio.get_running_loop().time() + pause_s

    @property
    def is_open(self) -> bool:
        """True while somebody is connected."""
        return bool(self.link.ends)

    @property
    def problem(self) -> str:
        """Why nothing can come or go; empty where it can, as far as is known."""
        reason = self.link.error
        if self.is_open and self.sends and reason:
            return f"{self.address}: nobody receives orders"
        if self.is_open:
            return ""
        closed = f"{self.address}: closed ({reason})"
        return self.error or closed

    def retry(self) -> None:
        """Begin to open the link again if it is closed, at most once a second."""
        loop = asyncio.get_running_loop()
        if self.is_open or loop.time() < self.retry_at:
            return
        if self.opening is None or self.opening.done():
            self.opening = loop.create_task(self.open())

    def close(self) -> None:
        """Close the link and try no more."""
        if self.opening is not None:
            self.opening.cancel()
        self.link.close()


def connections(
    received: Received, nmea: str, gear: str | None
) -> tuple[Connection, Connection]:
    """Connections to the instruments and to the steering gear, not yet open.

    Without an address of the gear it is at the other end of the instruments'
    connection. Over UDP anybody may be there, so that InputError is raised.
    """
    data = Connection(Link(received), nmea)
    is_datagrams = nmea.startswith("udp:")
    if gear is None and is_datagrams:
        raise InputError(
            "--gear: expected the address that receives rudder orders, because over"
            " UDP no one is answered, got none; add --gear udp:HOST:PORT"
        )
    if gear is None or (gear == nmea and not is_datagrams):
        return data, data
    return data, Connection(Link(received), gear, sends=True)


def check_apart(data: Connection, gear: Connection) -> None:
    """Refuse a gear whose address is that at which data are received."""
    datagrams = "udp:"
    if data is gear or not data.address.startswith(datagrams):
        return
    if not gear.address.startswith(datagrams):
        return
    heard_at = data.link.address("sockname")
    sent_to = gear.link.address("peername")
    sent_from = gear.link.address("sockname")
    host, _, port = sent_to.rpartition(":")
    is_own_host = host.startswith("127.") or sent_from.startswith(f"{host}:")
    own = [sent_to]
    if is_own_host:
        own += [f"0.0.0.0:{port}", f":::{port}"]
    if heard_at in own:
        raise InputError(
            f"--gear: expected another address than that of the data, got"
            f" {gear.address} with --nmea {data.address}; rudder orders would come"
            " back as data"
        )
