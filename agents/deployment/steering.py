"""`shipgym steer`: an autopilot live on NMEA 0183."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing, suppress
from math import ceil, inf
from typing import Any

from agents.deployment.helm import STEERING, Helm
from agents.deployment.nmea import Link
from agents.deployment.route import Route
from agents.deployment.sensors import Limits
from shipgym import InputError
from shipgym.checks import check_number


class HelmObserver:
    """What watches the helm: a display, a page or a log; it sees and may ask."""

    def heard(self, line: str, source: str, time: float) -> None:
        """A line was received from an address, at a time, s."""

    def sent(self, text: str, time: float) -> None:
        """Sentences were sent, each ending in a line break, at a time, s."""

    def update(self, helm: Helm, now: float) -> None:
        """The helm has been on watch for one more tick."""

    def commands(self) -> Iterable[Callable[[Helm], object]]:
        """Calls such as `Helm.stand_by` that the helmsman asked for since the last."""
        return ()

    def close(self) -> None:
        """The helm has ended."""


class Connection:
    """A link that is opened again whenever it is closed."""

    def __init__(self, link: Link, address: str) -> None:
        self.link = link
        self.address = address
        self.error = ""  # of the last try to open it
        self.retry_at = 0.0  # on the event loop's clock, s

    async def open(self, first: bool = False) -> None:
        """Try to open the link; InputError at the first try if that can never work."""
        longest_s, pause_s = 5.0, 1.0
        self.error = ""
        try:
            await asyncio.wait_for(self.link.open(self.address), longest_s)
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
        """Why the link cannot be opened; empty while it is open."""
        return "" if self.is_open else self.error

    async def retry(self) -> None:
        """Open the link again if it is closed, at most once a second."""
        if not self.is_open and asyncio.get_running_loop().time() >= self.retry_at:
            await self.open()


async def steer(
    agent: Any,
    address: str,
    *,
    heading: float | None = None,
    limits: Limits | None = None,
    duration: float = inf,
    speed_up: float = 1.0,
    log: Callable[[str], None] = print,
    route: Route | None = None,
    rate: float | None = None,
    observers: Sequence[HelmObserver] = (),
) -> Helm:
    """Steer a ship over NMEA 0183; the helm as it was at the end.

    It waits for an address at which nobody answers yet, and connects again when the
    connection is closed, which ends in an alarm if it steered. Raises InputError for an
    address that cannot be opened at all, or from which no data came until the end, and
    as `Helm` does.

    Parameters
    ----------
    agent, heading, limits, route, rate
        As in `Helm`.
    address : str
        Address of a `Link`.
    duration : float
        How long to steer, s.
    speed_up : float
        Seconds of a simulated ship that pass in one.
    log : callable
        Called with a line for each change of state.
    observers : sequence of HelmObserver
        A display, a page, a log.
    """
    check_number(speed_up, "speed_up")
    check_number(heading or 0.0, "heading")
    check_number(rate or 0.0, "rate")
    helm = Helm(agent, heading, limits or Limits(), route, rate)
    loop = asyncio.get_running_loop()

    def ship_time() -> float:
        return loop.time() * speed_up

    def hear(line: str, source: str) -> None:
        now = ship_time()
        helm.hear(line, source, now)
        for observer in observers:
            observer.heard(line, source, now)

    link = Link(hear)
    connection = Connection(link, address)
    await connection.open(first=True)

    ticks_per_step = ceil(helm.pilot.dt - 1e-9)  # at most 1 s each
    tick = helm.pilot.dt / ticks_per_step
    begin = ship_time()
    number = 0
    status = ""
    with closing(link), suppress(asyncio.CancelledError):  # an interruption ends it
        while number * tick < duration:
            due = begin + number * tick
            pause = (due - ship_time()) / speed_up
            await asyncio.sleep(max(0.0, pause))
            now = ship_time()
            for observer in observers:
                for command in observer.commands():
                    command(helm)
            late_s = (now - due) / speed_up
            helm.watch(tick, now, _fault(helm, connection, late_s))
            if number % ticks_per_step == 0:
                helm.steer(now)
            orders = helm.sentences()
            link.send(orders)
            for observer in observers:
                observer.sent(orders, now)
                observer.update(helm, now)

            status_before = status
            status = _status(helm, connection)
            if status != status_before:
                log(f"{number * tick:.1f} s: {status}")
            await connection.retry()
            number += 1

    _check_heard(helm, connection, number * tick)
    return helm


def _check_heard(helm: Helm, connection: Connection, seconds: float) -> None:
    """Refuse a closed connection from which nothing came for some time, s."""
    if connection.problem and not any(helm.counts.values()):
        raise InputError(
            f"{connection.problem}; no data received for {seconds:g} s; is the"
            " other end running?"
        )


def _status(helm: Helm, connection: Connection) -> str:
    """State of the helm, and why its connection is closed."""
    if connection.problem:
        return f"{helm.status}; {connection.problem}"
    return helm.status


def _fault(helm: Helm, connection: Connection, late_s: float) -> str | None:
    """A fault of the connection or the computer: it is closed, or the step is late."""
    if not connection.is_open:
        return "the connection was closed"
    is_late = late_s > helm.limits.late_s
    if helm.state == STEERING and is_late:
        return f"a step came {late_s:.1f} s late"
    return None
