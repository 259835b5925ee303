"""`shipgym simulate`: a ship model with the instruments of a ship, to steer over NMEA 0183."""

import asyncio
from collections.abc import Mapping
from contextlib import closing, suppress
from math import atan2, cos, degrees, hypot, inf, radians, sin
from typing import Any

import numpy as np

from agents.deployment.c99 import render
from agents.deployment.nmea import Link, readings, sentences
from shipgym import InputError, ShipModel, Weather
from shipgym.checks import check_keys, check_number
from shipgym.engine.trajectories import SEA_CHANNELS
from shipgym.ships.simulate import Conditions, Passage

STEP = 0.1  # s, between two sentences of a compass
SLOW = 10  # steps between two of the log and the GNSS receiver
WAYPOINT = 10.0 * 1852.0  # m, of her plotter along the leg
START = 54.0, 7.5  # degrees north and east, where the ship is at the beginning
MINUTE = 1852.0  # m, of latitude


class SimulatedShip:
    """A ship model that sails on, step by step, and tells what her instruments show.

    She begins to the north at service speed in a weather (calm by default) that follows
    from the seed. Her plotter tells of a leg through where she began, to the direction
    `leg`, rad.
    """

    def __init__(
        self,
        model: ShipModel,
        leg: float = 0.0,
        weather: Weather | str | None = None,
        seed: int = 0,
        step: float = STEP,
    ) -> None:
        self.model, self.leg, self.order, self.steps = (
            model,
            check_number(leg, "leg"),
            0.0,
            0,
        )
        self.step = step  # s
        self.passage = Passage(model, Conditions(weather=weather, seed=seed), step)
        self.states = self.passage.states(model.service_state, 1)

    def hear(self, line: str) -> None:
        """Take a rudder order; one whose status is invalid lets the rudder go amidships."""
        for reading in readings(line) or ():
            if reading.quantity in ("order", "released"):
                self.order = reading.value if reading.quantity == "order" else 0.0

    def advance(self) -> None:
        """One step; InputError where the ship has run away."""
        order = np.array([[self.order, self.model.service_shaft_speed]])
        sail = self.passage.loop("simulate")
        if not sail(
            self.states, order, self.step, *self.passage.sea, self.passage.numbers
        ):
            raise InputError(
                f"model '{self.model.name}' ran away after"
                f" {self.steps * self.step:.1f} s"
            )
        self.states[0], self.steps = self.states[1], self.steps + 1

    @property
    def now(self) -> dict[str, Any]:
        """Her state by name."""
        return dict(zip(self.model.state_names, self.states[0].tolist(), strict=False))

    def measured(self) -> dict[str, float]:
        """What her instruments and plotter know, SI units and radians, by quantity of `shipgym/trials/nmea.toml`."""
        s, sea = self.now, np.zeros(len(SEA_CHANNELS))
        if (
            self.passage.windy
        ):  # its current, and the first-order motion that a compass and a gyro feel
            sea = self.states[0, -len(SEA_CHANNELS) :]
        psi_wave, r_wave, _, _, north, east = sea[:6].tolist()
        ahead, aside, sine, cosine = (
            s["u"],
            s["v"] * cos(s.get("phi", 0.0)),
            sin(s["psi"]),
            cos(s["psi"]),
        )
        north, east = (
            north + ahead * cosine - aside * sine,
            east + ahead * sine + aside * cosine,
        )
        latitude = START[0] + s["x"] / MINUTE / 60.0
        longitude = START[1] + s["y"] / MINUTE / 60.0 / cos(radians(latitude))
        left = WAYPOINT * cos(self.leg) - s["x"], WAYPOINT * sin(self.leg) - s["y"]
        return {
            "heading": s["psi"] + psi_wave,
            "yaw_rate": s["r"] + r_wave,
            "rudder": s["delta"],
            "surge": s["u"],
            "sway": s["v"],
            "course": atan2(east, north),
            "speed": hypot(north, east),
            "latitude": radians(latitude),
            "longitude": radians(longitude),
            "cross_track": s["y"] * cos(self.leg) - s["x"] * sin(self.leg),
            "leg": self.leg,
            "waypoint_bearing": atan2(left[1], left[0]),
            "waypoint_distance": hypot(*left),
        }

    def sentences(self) -> str:
        """What her instruments send now."""
        known: dict[str, Any] = self.measured()
        north, east = (degrees(known[name]) for name in ("latitude", "longitude"))
        minutes, seconds = divmod(self.steps * self.step, 60.0)
        text = render(
            "instruments.nmea.j2",
            **known,
            slow=self.steps % SLOW == 0,
            off=f"{abs(known['cross_track']) / MINUTE:.5f}",
            side="L" if known["cross_track"] >= 0.0 else "R",
            miles=f"{known['waypoint_distance'] / MINUTE:.4f}",
            north=f"{int(north):02d}{north % 1 * 60:07.4f}",
            east=f"{int(east):03d}{east % 1 * 60:07.4f}",
            time=f"{int(minutes) // 60 % 24:02d}{int(minutes) % 60:02d}{seconds:05.2f}",
        )
        return sentences(text)


async def simulate_ship(
    ship: SimulatedShip,
    address: str,
    *,
    duration: float = inf,
    speed_up: float = 1.0,
    drop: Mapping[str, float] | None = None,
) -> None:
    """Sail a ship over NMEA 0183, in real time or `speed_up` times as fast, for a duration in s.

    Over TCP others connect to the `address` (`Link`), over UDP it sends there. `drop`
    names types of sentence that fall silent, and when, s. Raises InputError for a type
    that she does not send, or an address that cannot be opened.
    """
    loop, link = asyncio.get_running_loop(), Link(ship.hear)
    check_number(speed_up, "speed_up", above=0.0)
    dropped = dict(drop or {})
    check_keys(
        dropped, sorted({line[3:6] for line in ship.sentences().splitlines()}), "drop"
    )
    await link.open(address, serve=True)
    begin = loop.time()
    with closing(link), suppress(asyncio.CancelledError):
        while (now := ship.steps * ship.step) < duration:
            await asyncio.sleep(max(0.0, begin + now / speed_up - loop.time()))
            lines = ship.sentences().splitlines(keepends=True)
            link.send(
                "".join(line for line in lines if now < dropped.get(line[3:6], inf))
            )
            ship.advance()
