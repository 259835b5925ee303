"""A simulated ship steered as `shipgym steer` would, by readings of her instruments instead of sentences."""

from collections.abc import Collection
from math import radians
from typing import Any, NamedTuple

import numpy as np

from agents.controllers.controller import Controller
from agents.deployment.helm import Helm
from agents.deployment.nmea import NmeaReading
from agents.deployment.route import Route
from agents.deployment.sensors import Limits
from agents.deployment.simulated import MINUTE, START, SimulatedShip
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
    """Steer a ship until the autopilot hands over; the quantities in `lost` fall silent after `LOST_S`."""
    dt = helm.pilot.dt
    rows = list[tuple[float, ...]]()
    given, warnings = list[dict[str, Any]](), list[list[str]]()
    while len(rows) * dt < seconds:
        now = len(rows) * dt
        measured = ship.measured()
        for quantity, value in measured.items():
            if quantity not in lost or now < LOST_S:
                helm.sensors.take(NmeaReading(quantity, value, "II"), now)
        helm.watch(dt, now)
        helm.steer(now)
        if helm.alarm:
            break

        off = (helm.heading or 0.0) - measured["heading"]
        angles_deg = np.degrees([off, measured["rudder"], helm.order])
        error_deg, rudder_deg, order_deg = angles_deg.tolist()
        rows.append((now, error_deg, measured["yaw_rate"], rudder_deg, order_deg))
        given.append(helm.inputs(now))
        warnings.append(helm.warnings)
        ship.order = helm.order
        for _ in range(PER_INTERVAL):
            ship.advance()

    t, error, yaw_rate, rudder, order = np.array(rows).T
    alarm_at = len(rows) * dt if helm.alarm else np.inf
    return SteeredRun(
        t, error, yaw_rate, rudder, order, given, warnings, helm.alarm, alarm_at
    )


def steer_to_heading(
    model: ShipModel,
    pilot: Controller,
    sea: str = "calm",
    heading: float = 0.0,
    limits: Limits | None = None,
    rate: float | None = None,
    lost: Collection[str] = (),
) -> SteeredRun:
    """Steer a ship from straight running to a heading, deg, or at a rate of turn, rad/s."""
    step = pilot.design["dt"] / PER_INTERVAL
    ship = SimulatedShip(model, weather=sea, seed=1, step=step)
    set_point = radians(heading) if rate is None else None
    helm = Helm(pilot, set_point, limits or Limits(), rate=rate)
    return steer(helm, ship, LENGTHS * model.travel_time, lost)


def steer_along(
    model: ShipModel,
    track: Track,
    limits: Limits,
    aside: float = 0.0,
    lost: Collection[str] = (),
) -> SteeredRun:
    """Keep a ship to a track, from a distance to starboard of where it begins, m."""
    pilot = track.controller
    north, east = track.waypoints.T / MINUTE / 60.0  # degrees of latitude
    latitude = START[0] + north
    longitude = START[1] + east / np.cos(np.radians(latitude))
    places = np.column_stack([latitude, longitude])
    route = Route(places, pilot.gains["path_radius"])

    step = pilot.design["dt"] / PER_INTERVAL
    ship = SimulatedShip(model, weather=track_task(model).weather, step=step)
    ship.states[0, model.state_names.index("y")] = aside
    helm = Helm(pilot, None, limits, route)
    return steer(helm, ship, 3.0 * LENGTHS * model.travel_time, lost)
