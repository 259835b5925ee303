"""What tests of the helm share: sentences, free ports, and a clock that
does not wait."""

import asyncio
import selectors
import socket

from agents.export.nmea import sentences


def sentence(address, *fields):
    """One with its checksum."""
    return sentences(",".join([address, *map(str, fields)]))


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


class NoWaiting(selectors.DefaultSelector):
    """Time goes on when there is nothing to do, and only then: tests do not depend on
    the computer."""

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
