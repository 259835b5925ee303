"""`shipgym simulate`: a ship model with instruments, to steer over NMEA 0183."""

import asyncio
from collections.abc import Callable, Mapping
from contextlib import closing
from math import atan2, cos, degrees, hypot, inf, radians, sin
from typing import Any

import numpy as np

from agents.export.c99 import render
from agents.export.interruptions import interruptions
from agents.export.nmea import Link, readings, sentences
from shipgym import InputError, ShipModel, Weather
from shipgym.checks import check_keys, check_number
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.models.simulate import Conditions, Passage

STEP = 0.1  # s, between two sentences of a compass
START = 54.0, 7.5  # degrees north and east, where the ship is at the beginning
MINUTE = 1852.0  # m, of latitude


class SimulatedShip:
    """A ship model that sails on, step by step, and the readings of her instruments.

    She begins to the north at service speed. Her plotter shows a leg through where she
    began, and a waypoint ten miles along it.

    Parameters
    ----------
    model : ShipModel
        The ship.
    leg : float
        Direction of the leg, rad.
    weather : Weather or str, optional
        By default calm.
    seed : int
        Seed of the weather.
    step : float
        Time step, s.
    """

    def __init__(
        self,
        model: ShipModel,
        leg: float = 0.0,
        weather: Weather | str | None = None,
        seed: int = 0,
        step: float = STEP,
    ) -> None:
        self.model = model
        self.leg = check_number(leg, "leg")
        self.order = 0.0  # rudder, rad
        self.ordered_at: float | None = None  # last valid order, s
        self.steps = 0
        self.step = step
        self.passage = Passage(model, Conditions(weather=weather, seed=seed), step)
        self.states = self.passage.states(model.service_state, 1)

    def hear(self, line: str, source: str = "") -> None:
        """Take a rudder order; an invalid one lets the rudder go amidships."""
        for reading in readings(line) or ():
            if reading.quantity == "order":
                self.order = reading.value
                self.ordered_at = self.time
            elif reading.quantity == "released":
                self.release()

    def release(self) -> None:
        """Let the rudder go amidships until the next valid order."""
        self.order = 0.0
        self.ordered_at = None

    @property
    def time(self) -> float:
        """Since she began, s."""
        return self.steps * self.step

    def advance(self) -> None:
        """Simulate one step; InputError if the ship runs away.

        Her rudder goes amidships when the orders that she heard stop.
        """
        patience_s = 5.0
        if self.ordered_at is not None and self.time - self.ordered_at > patience_s:
            self.release()
        passage = self.passage
        order = np.array([[self.order, self.model.service_shaft_speed]])
        simulate = passage.loop("simulate")
        is_sound = simulate(
            self.states,
            order,
            self.step,
            *passage.sea,
            passage.numbers,
        )
        if not is_sound:
            raise InputError(
                f"model '{self.model.name}' ran away after {self.time:.1f} s"
            )
        self.states[0] = self.states[1]
        self.steps += 1

    @property
    def now(self) -> dict[str, Any]:
        """State by name."""
        return dict(zip(self.model.state_names, self.states[0].tolist(), strict=False))

    def measured(self) -> dict[str, float]:
        """Readings by quantity of `shipgym/trials/nmea.toml`, SI units and radians."""
        return {**self._of_instruments(), **self._of_plotter()}

    def _of_instruments(self) -> dict[str, float]:
        """Readings of compass, gyro, rudder, log and GNSS receiver."""
        state = self.now
        psi = state["psi"]
        surge = state["u"]
        sway = state["v"] * cos(state.get("phi", 0.0))  # in the horizontal plane

        # the first-order motion that compass and gyro feel, and the current
        psi_wave, r_wave, _, _, current_north, current_east = self._sea()
        north = current_north + surge * cos(psi) - sway * sin(psi)
        east = current_east + surge * sin(psi) + sway * cos(psi)

        latitude = START[0] + state["x"] / MINUTE / 60.0
        per_degree = cos(radians(latitude))
        longitude = START[1] + state["y"] / MINUTE / 60.0 / per_degree
        return {
            "heading": psi + psi_wave,
            "yaw_rate": state["r"] + r_wave,
            "rudder": state["delta"],
            "surge": surge,
            "sway": state["v"],
            "course": atan2(east, north),
            "speed": hypot(north, east),
            "latitude": radians(latitude),
            "longitude": radians(longitude),
        }

    def _sea(self) -> list[float]:
        """The first six of `SEA_CHANNELS`; zeros in calm water."""
        sea = np.zeros(len(SEA_CHANNELS))
        if self.passage.windy:
            sea = self.states[0, -len(SEA_CHANNELS) :]
        channels: list[float] = sea[:6].tolist()
        return channels

    def _of_plotter(self) -> dict[str, float]:
        """Readings of the chart plotter: the leg, and a waypoint ten miles along it."""
        x = self.now["x"]
        y = self.now["y"]
        leg = self.leg
        waypoint_m = 10.0 * MINUTE
        north_to_go = waypoint_m * cos(leg) - x
        east_to_go = waypoint_m * sin(leg) - y
        cross_track = y * cos(leg) - x * sin(leg)
        bearing = atan2(east_to_go, north_to_go)
        return {
            "cross_track": cross_track,
            "leg": leg,
            "waypoint_bearing": bearing,
            "waypoint_distance": hypot(north_to_go, east_to_go),
        }

    def sentences(self) -> str:
        """Sentences that her instruments send now."""
        steps_of_slow = 10  # between two of the log, the GNSS receiver and the plotter
        known: dict[str, Any] = self.measured()
        off_miles = abs(known["cross_track"]) / MINUTE
        miles_to_go = known["waypoint_distance"] / MINUTE
        text = render(
            "instruments.nmea.j2",
            **known,
            slow=self.steps % steps_of_slow == 0,
            off=f"{off_miles:.5f}",
            side="L" if known["cross_track"] >= 0.0 else "R",
            miles=f"{miles_to_go:.4f}",
            north=_degrees_and_minutes(known["latitude"], 2),
            east=_degrees_and_minutes(known["longitude"], 3),
            time=self._time(),
        )
        return sentences(text)

    def _time(self) -> str:
        """Time of day as HHMMSS.SS; she begins at midnight."""
        minutes, seconds = divmod(self.time, 60.0)
        hours, minutes = divmod(int(minutes), 60)
        return f"{hours % 24:02d}{minutes:02d}{seconds:05.2f}"


def _degrees_and_minutes(angle: float, digits: int) -> str:
    """A latitude or longitude, rad, as 5430.5000 with so many digits of degrees."""
    value = degrees(angle)
    minutes = value % 1 * 60
    return f"{int(value):0{digits}d}{minutes:07.4f}"


async def simulate_ship(
    ship: SimulatedShip,
    address: str,
    *,
    gear: str | None = None,
    duration: float = inf,
    speed_up: float = 1.0,
    drop: Mapping[str, float] | None = None,
    log: Callable[[str], None] | None = None,
) -> str:
    """Simulate a ship over NMEA 0183; the signal that ended it, empty without one.

    Over TCP others connect to the address, over UDP she sends there. Raises InputError
    for an address that cannot be opened, or a type of sentence that she does not send.
    SIGINT, SIGTERM and SIGHUP end it.

    Parameters
    ----------
    ship : SimulatedShip
    address : str
        Address of a `Link`.
    gear : str, optional
        Address at which she receives rudder orders; by default on the same connection.
    duration : float
        How long, s of the ship.
    speed_up : float
        Seconds of the ship that pass in one.
    drop : mapping of str to float, optional
        Types of sentence that fall silent, such as HDT, and when, s.
    log : callable, optional
        Called with a line when her rudder is steered and when it is released.
    """
    check_number(speed_up, "speed_up", above=0.0)
    if gear == address and address.startswith("udp:"):
        raise InputError(
            "--gear: expected another address than that of the instruments, at which"
            f" she receives rudder orders, got {gear} for both"
        )
    dropped = dict(drop or {})
    lines = ship.sentences().splitlines()
    types = {_type(line) for line in lines}
    check_keys(dropped, sorted(types), "drop")

    loop = asyncio.get_running_loop()
    link = Link(ship.hear)
    orders = Link(ship.hear)
    begin = loop.time()
    steered = False
    with closing(link), closing(orders), interruptions() as signals:
        await link.open(address, serve=True, sends=True)
        if gear not in (None, address):
            await orders.open(gear, serve=True)
        while ship.time < duration:
            due = begin + ship.time / speed_up
            pause = due - loop.time()
            await asyncio.sleep(max(0.0, pause))
            text = _still_sent(ship.sentences(), dropped, ship.time)
            link.send(text)
            ship.advance()

            steered_before = steered
            steered = ship.ordered_at is not None
            if log is not None and steered != steered_before:
                log(f"{ship.time:.1f} s: {_GEAR[steered]}")
    return signals[0] if signals else ""


_GEAR = {
    True: "the rudder follows orders",
    False: "no valid rudder orders: rudder amidships",
}


def _still_sent(text: str, dropped: Mapping[str, float], now: float) -> str:
    """Sentences without those that have fallen silent by now."""
    sent = []
    for line in text.splitlines(keepends=True):
        silent_from = dropped.get(_type(line), inf)
        if now < silent_from:
            sent.append(line)
    return "".join(sent)


def _type(line: str) -> str:
    """Type of a sentence: HDT of $HEHDT,180.0,T."""
    return line[3:6]
