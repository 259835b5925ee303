"""`shipgym simulate`: a ship model with the instruments of a ship, to steer over NMEA 0183."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from math import cos, degrees, hypot, inf, radians, sin

import numpy as np

from agents.deployment.nmea import KNOT, MILE, Link, heading_deg, readings, sentence
from shipgym.engine.loops import ship_loop
from shipgym.errors import InputError
from shipgym.sea.conditions import Weather
from shipgym.ships import ShipModel
from shipgym.ships.conditions import Conditions, Passage

STEP = 0.1  # s, between two sentences of a compass
SLOW = 10  # steps between two of the log and the GNSS receiver
START = 54.0, 7.5  # degrees, where the ship is at the beginning
SHIP, PLOTTER = "II", "EC"


class SimulatedShip:
    """A ship model that sails on, step by step, and tells what her instruments show.

    Parameters
    ----------
    model : ShipModel
        The ship, which begins to the north at service speed.
    leg : float
        Direction of the leg that her plotter tells of, through where she began, rad.
    weather : Weather or str, optional
        As of `simulate`; by default calm.
    seed : int
        Of the weather.
    """

    def __init__(
        self, model: ShipModel, leg: float = 0.0, weather: Weather | str | None = None, seed: int = 0
    ) -> None:
        self.model, self.leg, self.order = model, leg, 0.0
        self.passage = Passage(model, Conditions(weather=weather, seed=seed), STEP)
        self.states = self.passage.states(model.service_state, 1)
        self.loop, self.steps = self.passage.loop("simulate"), 0

    def hear(self, line: str) -> None:
        """Take a rudder order; with the autopilot's status invalid the rudder goes amidships."""
        for reading in readings(line) or ():
            if reading.quantity in ("order", "released"):
                self.order = reading.value if reading.quantity == "order" else 0.0

    def advance(self) -> None:
        """One step; InputError where the ship has run away."""
        order = np.array([[self.order, self.model.service_shaft_speed]])
        if not self.loop(self.states, order, STEP, *self.passage.sea, self.passage.numbers):
            raise InputError(f"model '{self.model.name}' ran away after {self.steps * STEP:.1f} s")
        self.states[0], self.steps = self.states[1], self.steps + 1

    @property
    def now(self) -> dict[str, float]:
        """Her state by name."""
        return dict(zip(self.model.state_names, self.states[0].tolist(), strict=False))

    def sentences(self) -> Iterator[tuple[str, str]]:
        """What her instruments send now, by type of sentence."""
        s = self.now
        heading = heading_deg(s["psi"])
        yield "HDT", sentence("HE", "HDT", heading, "T")
        yield "ROT", sentence("TI", "ROT", degrees(s["r"]) * 60.0, "A")
        yield "RSA", sentence(SHIP, "RSA", degrees(s["delta"]), "A", "", "V")
        if self.steps % SLOW:
            return
        north, east = self._over_ground()
        course, knots = heading_deg(np.arctan2(east, north)), hypot(north, east) / KNOT
        yield "VBW", sentence("VD", "VBW", s["u"] / KNOT, s["v"] / KNOT, "A", "", "", "V")
        yield "VTG", sentence("GP", "VTG", course, "T", "", "M", knots, "N", knots * 1.852, "K", "A")
        latitude = START[0] + s["x"] / MILE / 60.0
        longitude = START[1] + s["y"] / MILE / 60.0 / cos(radians(latitude))
        minutes, seconds = divmod(self.steps * STEP, 60.0)
        time = f"{int(minutes) // 60 % 24:02d}{int(minutes) % 60:02d}{seconds:05.2f}"
        place = [f"{int(abs(a)):0{n}d}{abs(a) % 1 * 60:07.4f}" for a, n in ((latitude, 2), (longitude, 3))]
        yield "RMC", sentence(
            "GP", "RMC", time, "A", place[0], "N" if latitude >= 0 else "S", place[1],
            "E" if longitude >= 0 else "W", knots, course, "010126", "", "", "A",
        )  # fmt: skip
        cross = s["y"] * cos(self.leg) - s["x"] * sin(self.leg)
        off, leg = (abs(cross) / MILE, "L" if cross >= 0.0 else "R"), heading_deg(self.leg)
        yield "XTE", sentence(PLOTTER, "XTE", "A", "A", f"{off[0]:.5f}", off[1], "N", "A")
        yield (
            "APB",
            sentence(
                PLOTTER,
                "APB",
                "A",
                "A",
                f"{off[0]:.5f}",
                off[1],
                "N",
                "V",
                "V",
                leg,
                "T",
                "1",
                leg,
                "T",
                leg,
                "T",
                "A",
            ),
        )

    def _over_ground(self) -> tuple[float, float]:
        """Velocity over ground to north and east, m/s; the current stands behind the state."""
        s, (north, east) = self.now, self.states[0, -4:-2] if self.passage.windy else (0.0, 0.0)
        ahead, aside = s["u"], s["v"] * cos(s.get("phi", 0.0))
        sine, cosine = sin(s["psi"]), cos(s["psi"])
        return ahead * cosine - aside * sine + north, ahead * sine + aside * cosine + east


async def simulate_ship(
    ship: SimulatedShip, address: str, *, duration: float = inf, speed_up: float = 1.0,
    drop: Mapping[str, float] | None = None,
) -> SimulatedShip:  # fmt: skip
    """Sail a ship over NMEA 0183, in real time or faster, until interrupted.

    Parameters
    ----------
    ship : SimulatedShip
    address : str
        As of `Link`; over TCP others connect to it, over UDP it sends there.
    duration : float
        s, simulated, after which it ends.
    speed_up : float
        How many seconds pass in one.
    drop : mapping of str to float
        Types of sentence that fall silent, and when, s.

    Raises
    ------
    InputError
        For an address that cannot be opened.
    """
    loop, link = asyncio.get_running_loop(), Link(ship.hear)
    await link.open(address, serve=True)
    begin = loop.time()
    try:
        while ship.steps * STEP < duration:
            now = ship.steps * STEP
            await asyncio.sleep(max(0.0, begin + now / speed_up - loop.time()))
            kept = [text for kind, text in ship.sentences() if now < (drop or {}).get(kind, inf)]
            link.send("".join(kept))
            ship.advance()
    finally:
        link.close()
    return ship
