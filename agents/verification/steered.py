"""A simulated ship steered as by `shipgym steer`, by readings instead of sentences."""

from collections.abc import Collection, Mapping
from math import radians
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.export.helm import Helm
from agents.export.nmea import NmeaReading
from agents.export.route import Route
from agents.export.sensors import Limits
from agents.export.simulated import MINUTE, START, SimulatedShip
from agents.verification.tracks import Track, track_task
from shipgym.arrays import Floats
from shipgym.ships import ShipModel

# of a run to a heading, times to travel a ship length; the first quarter does not count
LENGTHS = 40.0
PER_INTERVAL = 2  # steps of the simulation in a control interval
LOST_S = 60.0  # when a sensor falls silent


class SteeredRun(NamedTuple):
    """Recordings of a ship under an autopilot, one each control interval."""

    t: Floats  # s
    error: Floats  # of the heading, deg
    yaw_rate: Floats  # rad/s
    rudder: Floats  # deg
    order: Floats  # deg
    given: list[dict[str, Any]]  # to the autopilot
    warnings: list[list[str]]
    alarm: str
    alarm_at: float  # s, one interval after the last that was steered

    def unwarned(self, size: Floats, warning: str) -> float:
        """Largest of something in intervals in which a warning was not given."""
        quiet = [warning not in given for given in self.warnings]
        return float(np.max(size, where=np.array(quiet), initial=0.0))


def settled(values: Floats) -> Floats:
    """Values of a run without the first quarter, which does not count for keeping."""
    return values[len(values) // 4 :]


def steer(
    helm: Helm, ship: SimulatedShip, seconds: float, lost: Collection[str] = ()
) -> SteeredRun:
    """Steer a ship until the autopilot hands over.

    The quantities in `lost` fall silent after `LOST_S`.
    """
    dt = helm.pilot.dt
    rows: list[list[float]] = []
    given: list[dict[str, Any]] = []
    warnings: list[list[str]] = []
    now = 0.0
    while now < seconds:
        measured = ship.measured()
        silent = () if now < LOST_S else lost
        show(helm, measured, silent, now)
        helm.watch(dt, now)
        if not rows:
            helm.pilot.switch_on()  # nobody had the wheel before
        helm.steer(now)
        if helm.alarm:
            break

        error = (helm.heading or 0.0) - measured["heading"]
        rows.append([now, error, measured["yaw_rate"], measured["rudder"], helm.order])
        given.append(helm.inputs(now))
        warnings.append(helm.warnings)
        ship.order = helm.order
        for _ in range(PER_INTERVAL):
            ship.advance()
        now = len(rows) * dt

    times, errors, yaw_rates, rudders, orders = np.array(rows).T
    return SteeredRun(
        t=times,
        error=np.degrees(errors),
        yaw_rate=yaw_rates,
        rudder=np.degrees(rudders),
        order=np.degrees(orders),
        given=given,
        warnings=warnings,
        alarm=helm.alarm,
        alarm_at=now if helm.alarm else np.inf,
    )


def show(
    helm: Helm, measured: Mapping[str, float], silent: Collection[str], now: float
) -> None:
    """Show an autopilot what is measured, but for quantities that are silent."""
    for quantity, value in measured.items():
        if quantity in silent:
            continue
        reading = NmeaReading(quantity, value, talker="II")
        helm.sensors.take(reading, now)


def steer_to_heading(
    model: ShipModel,
    pilot: Controller,
    sea: str = "calm",
    heading: float = 0.0,
    limits: Limits | None = None,
    rate: float | None = None,
    lost: Collection[str] = (),
) -> SteeredRun:
    """Steer a ship from straight running to a heading, or at a rate of turn.

    `heading`: deg; `rate`: rad/s.
    """
    ship = SimulatedShip(
        model,
        weather=sea,
        seed=1,
        step=pilot.design["dt"] / PER_INTERVAL,
    )
    helm = Helm(
        pilot,
        heading=radians(heading) if rate is None else None,
        limits=limits or Limits(),
        rate=rate,
    )
    seconds = LENGTHS * model.travel_time
    return steer(helm, ship, seconds, lost)


def positions(places: Floats) -> Floats:
    """Latitude and longitude, degrees, of places north and east of the start, m.

    `places` and result: shape (n, 2).
    """
    north, east = places.T / MINUTE / 60.0  # degrees of latitude
    latitude = START[0] + north
    longitude = START[1] + east / np.cos(np.radians(latitude))
    return np.column_stack([latitude, longitude])


def steer_along(
    model: ShipModel,
    track: Track,
    limits: Limits,
    aside: float = 0.0,
    lost: Collection[str] = (),
) -> SteeredRun:
    """Keep a ship to a track, from a distance to starboard of where it begins, m."""
    pilot = track.controller
    waypoints = positions(track.waypoints)
    route = Route(waypoints, pilot.gains["path_radius"])

    ship = SimulatedShip(
        model,
        weather=track_task(model).weather,
        step=pilot.design["dt"] / PER_INTERVAL,
    )
    y = model.state_names.index("y")
    ship.states[0, y] = aside
    helm = Helm(pilot, heading=None, limits=limits, route=route)
    seconds = 3.0 * LENGTHS * model.travel_time
    return steer(helm, ship, seconds, lost)
