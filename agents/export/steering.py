"""`shipgym steer`: an autopilot live on NMEA 0183."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from math import ceil, inf
from typing import Any

from agents.export.connection import check_apart, connections
from agents.export.helm import Helm
from agents.export.helm_commands import STEERING
from agents.export.interruptions import interruptions
from agents.export.route import Route
from agents.export.sensors import Limits
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


async def steer(
    agent: Any,
    address: str,
    *,
    gear: str | None = None,
    heading: float | None = None,
    limits: Limits | None = None,
    duration: float = inf,
    speed_up: float = 1.0,
    log: Callable[[str], None] = print,
    route: Route | None = None,
    rate: float | None = None,
    variation: float | None = None,
    rudder_feedback: bool = True,
    observers: Sequence[HelmObserver] = (),
) -> Helm:
    """Steer a ship over NMEA 0183; the helm as it was at the end.

    It waits for an address at which nobody answers yet, and connects again when the
    connection is closed, which ends in an alarm if it steered. On every way out the
    last sentences mark the order as invalid; SIGINT, SIGTERM and SIGHUP end it. Raises
    InputError for an address that cannot be opened at all, or from which no data came
    until the end, and as `Helm` does.

    Parameters
    ----------
    agent, heading, limits, route, rate, variation, rudder_feedback
        As in `Helm`.
    address : str
        Address of a `Link`, from which data come.
    gear : str, optional
        Address to which orders go; by default the other end of the same connection,
        which over UDP there is none.
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
    helm = Helm(
        agent,
        heading,
        limits or Limits(),
        route=route,
        rate=rate,
        variation=variation,
        rudder_feedback=rudder_feedback,
    )
    data_and_gear = (address, gear)
    bridge = Bridge(helm, data_and_gear, speed_up, log, observers)
    try:
        await bridge.open()
        with interruptions() as signals:
            await bridge.watch(duration)
        helm.ended_by = signals[0] if signals else helm.ended_by
    finally:
        bridge.close()
    bridge.check_heard()
    return helm


class Bridge:
    """The helm with its connections and those who watch it.

    Parameters
    ----------
    helm : Helm
    addresses : tuple of str and (str or None)
        Of the instruments, and of the steering gear.
    speed_up, log, observers
        As in `steer`.
    """

    def __init__(
        self,
        helm: Helm,
        addresses: tuple[str, str | None],
        speed_up: float,
        log: Callable[[str], None],
        observers: Sequence[HelmObserver],
    ) -> None:
        self.helm = helm
        self.data, self.gear = connections(self.hear, *addresses)
        self.speed_up = speed_up
        self.log = log
        self.observers = observers
        self.loop = asyncio.get_running_loop()
        self.status = ""
        self.seconds = 0.0  # on watch

    @property
    def now(self) -> float:
        """Time of the ship, s."""
        return self.loop.time() * self.speed_up

    async def open(self) -> None:
        """Connect to the instruments and to the steering gear."""
        await self.data.open(first=True)
        if self.gear is not self.data:
            await self.gear.open(first=True)
        check_apart(self.data, self.gear)

    def hear(self, line: str, source: str) -> None:
        """Take in a line from an address."""
        now = self.now
        self.helm.hear(line, source, now)
        for observer in self.observers:
            observer.heard(line, source, now)

    async def watch(self, duration: float) -> None:
        """Steer in ticks of at most a second for some time, s."""
        helm = self.helm
        ticks_per_step = ceil(helm.pilot.dt - 1e-9)
        tick = helm.pilot.dt / ticks_per_step
        begin = self.now
        number = 0
        while self.seconds < duration and not helm.ended_by:
            due = begin + self.seconds
            if number:  # the first order goes out at once
                pause = (due - self.now) / self.speed_up
                await asyncio.sleep(max(0.0, pause))
            now = self.now
            for observer in self.observers:
                for command in observer.commands():
                    command(helm)

            late_s = (now - due) / self.speed_up
            fault = self.fault(late_s)
            helm.watch(tick, now, fault)
            if number % ticks_per_step == 0:
                helm.steer(now)
            self.send(helm.sentences())
            for observer in self.observers:
                observer.update(helm, now)
            self.tell_status()
            self.data.retry()
            self.gear.retry()
            number += 1
            self.seconds = number * tick

    def fault(self, late_s: float) -> str | None:
        """A fault of a connection or the computer; nothing that has just begun."""
        helm = self.helm
        if not self.data.is_open:
            return "the connection was closed"
        if not self.gear.is_open:
            return "the connection to the steering gear was closed"
        is_steering = helm.state == STEERING
        is_refused = bool(self.gear.problem)
        has_lasted = helm.sensors.lasts("gear", is_refused, self.now)
        if has_lasted or (is_refused and not is_steering):
            return "nobody receives the orders"
        if is_steering and late_s > helm.limits.late_s:
            return f"a step came {late_s:.1f} s late"
        return None

    def send(self, text: str) -> None:
        """Send orders to the steering gear."""
        self.gear.link.send(text)
        for observer in self.observers:
            observer.sent(text, self.now)

    def tell_status(self) -> None:
        """Tell the state of the helm when it or that of a connection changes."""
        parts = {self.helm.status: True}  # in order, and each once
        for connection in (self.data, self.gear):
            if connection.problem:
                parts[connection.problem] = True
        status = "; ".join(parts)
        if status != self.status:
            self.log(f"{self.seconds:.1f} s: {status}")
        self.status = status

    def close(self) -> None:
        """Say for the last time that the order is invalid, and close everything."""
        try:
            self.send(self.helm.sentences(last=True))
        finally:
            self.data.close()
            self.gear.close()
            for observer in self.observers:
                observer.close()

    def check_heard(self) -> None:
        """Refuse a closed connection from which nothing ever came."""
        problem = self.data.problem
        has_heard = any(self.helm.counts.values())
        if problem and not self.helm.ended_by and not has_heard:
            raise InputError(
                f"{problem}; no data received for {self.seconds:g} s; is the other end"
                " running?"
            )
